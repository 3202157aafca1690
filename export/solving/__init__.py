"""Solving on this machine, by every program of the table (export/programs)."""
