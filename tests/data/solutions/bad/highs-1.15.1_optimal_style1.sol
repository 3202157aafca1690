Columns
    Index Status        Lower        Upper       Primal         Dual  Type        Name
        0                   0           10           10               Continuous  x
        1                -inf          inf         -9.7               Continuous  y
        2                   0            1            1               Integer     b
        3                   0            5            0               Continuous  u
        4                   1            1            1               Continuous  one
Rows
    Index Status        Lower        Upper       Primal         Dual  Name
        0                -inf         11.3           11               c1
        1                 0.3          inf          0.3               c2

Model status: Optimal

Objective value: -14.4
