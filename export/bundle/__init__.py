"""Sets of files written by an export.

One problem in several formats, together with the instance, the manifest (with schema) and starting points
for each solver. export/formats writes the text of a format; export/solving solves the files.
"""
