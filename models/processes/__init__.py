"""Execution of work, and its end.

Deadlines, Ctrl-C, and parallel work in processes that never outlive this one. The work itself belongs to
models/search; solvers that are separate programs belong to export/solving.
"""
