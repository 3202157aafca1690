"""Checks that every program reads what was meant.

Each written file handed to each program, what it read compared with the problem, optima compared on request.
The programs themselves are in programs; checks of a library are export/library/checking.
"""
