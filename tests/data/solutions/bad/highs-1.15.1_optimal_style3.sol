Problem:    mip
Rows:       3
Columns:    5 (1 integer, 1 binary)
Non-zeros:  9
Status:     INTEGER OPTIMAL
Objective:  obj = -14.4 (MINimum)

   No.   Row name        Activity     Lower bound   Upper bound
------ ------------    ------------- ------------- -------------
     1 obj                     -14.4                             
     2 c1                         11                        11.3 
     3 c2                        0.3           0.3               

   No. Column name       Activity     Lower bound   Upper bound
------ ------------    ------------- ------------- -------------
     1 x                          10             0            10 
     2 y                        -9.7                             
     3 b            *              1             0             1 
     4 u                           0             0             5 
     5 one                         1             1             = 

Integer feasibility conditions:

KKT.PE: max.abs.err = 0.00e+00 on row 0
        max.rel.err = 0.00e+00 on row 0
        High quality

KKT.PB: max.abs.err = 0.00e+00 on row 0
        max.rel.err = 0.00e+00 on row 0
        High quality

End of output
