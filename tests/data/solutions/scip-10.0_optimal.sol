optimal solution found

Options
3
1
0
1
2
0
5
5
10
-9.6999999999999993
1
0
1
objno 0 0
