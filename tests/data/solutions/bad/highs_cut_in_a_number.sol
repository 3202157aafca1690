Model status
Optimal

# Primal solution values
Feasible
Objective -14.4
# Columns -4
x 10 0
y -9.7 1
b 1 2
one 