Model status
Optimal

# Primal solution values
Feasible
Objective -14.4
Objective_bound -14.4
MIP_rel_gap 0
# Columns -4 sparse
x 10 0
y -9.7 1
b 1 2
one 1 3
