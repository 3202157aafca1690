Model status
Optimal

# Primal solution values
Feasible
Objective -0.175
# Columns 2
alpha_0_0 0.3499999875
alpha_0_1 -0.0499999975
# Rows 1
c1 0.29999999

# Dual solution values
Feasible
# Columns 2
alpha_0_0 0
alpha_0_1 0
# Rows 1
c1 0

# Basis
HiGHS_basis_file v2
Valid
# Columns 2
alpha_0_0 1
alpha_0_1 4
# Rows 1
c1 4
