infeasible

Options
3
1
0
1
3
0
5
0
objno 0 0
