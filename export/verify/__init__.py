"""Checks that every program reads the intended model.

Each written file is passed to each program, the model that it reads is compared with the problem, and optima
are compared on request. The programs are in export/programs; checks of a library in export/library/building.
"""
