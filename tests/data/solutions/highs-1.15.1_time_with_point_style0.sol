Model status
Time limit reached

# Primal solution values
Feasible
Objective 9.55
# Columns 5
x 0.5
y 1.25
b 0
u 0
one 1
# Rows 2
c1 0.5
c2 1.75

# Dual solution values
None

# Basis
HiGHS_basis_file v2
None
