"""Files of a library that describe its entries.

Sidecars with their schemas, statistics of a problem, formulas for browsers, and the checker that is
shipped in each library. The folders `building` and `checking` create and compare them.
"""
