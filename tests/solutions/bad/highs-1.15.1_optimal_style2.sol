c Problem:    mip
c Rows:       3
c Columns:    5
c Non-zeros:  9
c Status:     INTEGER OPTIMAL
c Objective:  obj = -14.4 (MINimum)
c
s mip 3 5 o -14.4
i 1 -14.4
i 2 11
i 3 0.3
j 1 10
j 2 -9.7
j 3 1
j 4 0
j 5 1
e o f
