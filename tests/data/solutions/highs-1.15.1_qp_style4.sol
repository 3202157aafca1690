Model status
Optimal

# Primal solution values
Feasible
Objective -0.175
# Columns -2
alpha_0_0 0.3499999875 0
alpha_0_1 -0.0499999975 1
