"""Fields by one sparse system.

The power field and the PolyVector field: unknowns that do not see labels or jumps are smoothed, and crosses,
labels and jumps are read off. The bend field goes on from one of them, with one system a round. Whatever
changes jumps afterwards is models/search.
"""
