"""Fields without a solver.

The greedy field, best angles for given jumps, local improvement, and the search over jumps.
Whatever needs an installed solver or a written file is export/solving.
"""
