"""Best known points and bounds.

The ledger with the points that are shipped, the points of every formulation that a field gives, and fields of
low 1-norm energy. An input of every build, never made by one.
"""
