"""Solving on this machine: `solve` for every solver of the table, whose modules are in export/programs."""
