"""New bounds and better points.

Runs of local solvers on the entries, and points that others send in: checked, compared, kept in the ledger.
"""
