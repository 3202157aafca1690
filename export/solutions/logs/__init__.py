"""Readers of solvers' logs: bound, time, both over time.

A log is recognised by its content and read for the last run that it describes. Logs checked: HiGHS 1.15,
Gurobi 13.0, CPLEX 22.2 (Python, and in GAMS), SCIP 10.0, Xpress 9.9, BARON 26.5 in GAMS.
"""
