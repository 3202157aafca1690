"""Fields without an external solver.

The greedy field, best angles for given jumps, local improvement, and the search over jumps.
Methods that need an installed solver or a written file belong to export/solving.
"""
