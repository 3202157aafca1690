c Problem:    
c Rows:       48
c Columns:    36
c Non-zeros:  150
c Status:     OPTIMAL
c Objective:  obj_sha256_a1a5428ed32 = 0 (MINimum)
c
s bas 48 36 f f 0
i 1 l 0 0
i 2 b 0 0
i 3 l 0 0
i 4 l 0 0
i 5 b 2.22044604925031e-16 0
i 6 l 0 0
i 7 b 0 0
i 8 b 0 0
i 9 l 0 0
i 10 l 0 0
i 11 l 0 0
i 12 l 0 0
i 13 b 0 0
i 14 b 0 0
i 15 b 0 0
i 16 b 0 0
i 17 b 0 0
i 18 b 0.1 0
i 19 l 0 0
i 20 b 0 0
i 21 b 0 0
i 22 b 0.1 0
i 23 b 0 0
i 24 b 0 0
i 25 b 0 0
i 26 b -0.1 0
i 27 b 0 0
i 28 b 0 0
i 29 b 0 0
i 30 b -0.1 0
i 31 b 0 0
i 32 b 0 0
i 33 b 0.891267681314614 0
i 34 b 0.891267681314614 0
i 35 l -0.2 0.75
i 36 l -1.6 0.5625
i 37 l -2.6 0.375
i 38 l 0.2 0.75
i 39 l 1.6 0.5625
i 40 l 2.6 0.375
i 41 l 0 0
i 42 l 0 0
i 43 l 0 0
i 44 b 0 0
i 45 b 0 0
i 46 b 0 0
i 47 b 0 0
i 48 b 0 0
j 1 s 1 0
j 2 b 0.2 0
j 3 b 1.6 0
j 4 l 0 0
j 5 b 2.6 0
j 6 b 0 0
j 7 b 0 0
j 8 b 0 0
j 9 b 0 0
j 10 l 0 0
j 11 b 0.127323954473516 0
j 12 l 0 0
j 13 l 0 0
j 14 b 0.445633840657307 0
j 15 u 0 0
j 16 b 0.827605704077856 0
j 17 b -0.318309886183791 0
j 18 l 0 2
j 19 l 0 2
j 20 l 0 2
j 21 l 0 2
j 22 l 0 2
j 23 l 0 2
j 24 l 0 2
j 25 l 0 2
j 26 b 0 0
j 27 b 0 0
j 28 b 0 0
j 29 b 0 0
j 30 b 0 0
j 31 b 0 0
j 32 b 0 0
j 33 l 0 0.001
j 34 l 0 0.001
j 35 l 0 0.001
j 36 l 0 0.001
e o f
