"""Solvers that run here.

Their drivers (highs.py, casadi.py and its child process), solve, the two stages, the methods, and
`run`. Searches that need no solver are models/search; programs that only check our files are
export/verify.
"""
