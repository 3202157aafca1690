"""The set of files that an export leaves.

One problem in several formats, the instance and the manifest (with schema) beside them, and starting points
for each solver. The text of a format is export/formats; solving the files is export/solving.
"""
