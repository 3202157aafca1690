"""From a solver's answer to a field.

The Solution: a point mapped back by name, its objective and violations recomputed, and what in the file they contradict.
No reader runs a solver; the running is export/solving.
"""
