time limit reached

Options
3
1
0
1
2
0
5
0
objno 0 472
