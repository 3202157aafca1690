"""Solvers that run here.

HiGHS, Ipopt and Bonmin on the written files, their child processes, the two stages, exact windows, the methods, and `run`.
Searches that need no solver are models/search; programs that only check our files are export/verify.
"""
