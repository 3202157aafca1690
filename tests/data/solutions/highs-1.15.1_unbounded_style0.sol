Model status
Unbounded

# Primal solution values
Feasible
Objective -3
# Columns 2
x 0
y 3
# Rows 1
c1 3

# Dual solution values
Infeasible
# Columns 2
x 2
y 0
# Rows 1
c1 -1

# Basis
HiGHS_basis_file v2
Valid
# Columns 2
x 0
y 1
# Rows 1
c1 0
