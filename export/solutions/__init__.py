"""From a solver's answer to a field.

The Solution: a point mapped back by name, its recomputed values, and contradictions with the file's claims.
No reader runs a solver; that belongs to export/solving.
"""
