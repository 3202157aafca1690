"""Documents beside the model files.

Sidecars with their schemas, statistics of a problem, formulas for browsers, archives, and the checker that is
shipped in each library. They describe; making is building, comparing is checking.
"""
