"""From a solver's answer to a field.

The Solution: a point mapped back by name, what is recomputed of it, and what in the file that contradicts.
No reader runs a solver; the running is export/solving.
"""
