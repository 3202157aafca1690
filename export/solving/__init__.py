"""Solving on this machine.

`solve` runs every solver of the table on files that it writes; the modules of programs are in export/programs.
"""
