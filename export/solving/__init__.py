"""Solving on this machine.

`solve` for every solver of the table, the two stages, the methods, and `run`. Searches that need no solver
are in models/search; the modules of programs are in export/programs.
"""
