Model status
Optimal

# Primal solution values
Feasible
Objective -14.4
# Columns 5
x 10
y nan
b 1
u 0
one 1
# Rows 2
c1 11
c2 0.3

# Dual solution values
None

# Basis
HiGHS_basis_file v2
None
