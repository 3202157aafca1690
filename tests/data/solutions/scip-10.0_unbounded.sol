unbounded

Options
3
1
0
1
1
0
5
5
0
-100000
1
0
0
objno 0 300
