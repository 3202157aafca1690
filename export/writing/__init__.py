"""Common parts of all writers.

Names of columns and rows, blocks of equal records as bytes, expressions as text, and the sink that
hashes and compresses. Single formats belong to export/formats.
"""
