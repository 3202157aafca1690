"""What all writers share.

Names of columns and rows, blocks of equal records as bytes, expressions as text, and the sink that counts,
hashes and compresses. Nothing here knows one format: that is export/formats.
"""
