"""Fields from one sparse system.

The power field and the PolyVector field smooth unknowns that do not depend on labels or jumps; crosses,
labels and jumps follow from them. The bend field starts from one of them and solves one system per round.
Changes of jumps after that belong to models/search.
"""
