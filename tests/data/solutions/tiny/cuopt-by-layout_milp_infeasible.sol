# Status: Infeasible
