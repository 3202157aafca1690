Model status
Time limit reached

# Primal solution values
Feasible
Objective 9.55
# Columns -3
x 0.5 0
y 1.25 1
one 1 4
