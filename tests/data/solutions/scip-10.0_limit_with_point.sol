solution limit reached

Options
3
1
0
1
2
0
5
5
5
100000
1
0
0
objno 0 408
