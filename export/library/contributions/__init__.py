"""New bounds and better points.

Runs of local solvers on the entries, and files that others submit: checked, compared, kept in the ledger.
"""
