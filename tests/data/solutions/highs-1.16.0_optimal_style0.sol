Model status
Optimal

# Primal solution values
Feasible
Objective -14.4
Objective_bound -14.4
MIP_rel_gap 0
# Columns 5
x 10
y -9.7
b 1
one 1
u 0
# Rows 2
c1 11
c2 0.3

# Dual solution values
None

# Basis
HiGHS_basis_file v2
None
