"""Fields by sparse systems.

The power field and the PolyVector field: unknowns that do not see labels or jumps are smoothed, and crosses,
labels and jumps are read off. The bend field goes on from one of them. Whatever changes jumps afterwards is
models/search.
"""
