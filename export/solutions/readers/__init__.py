"""Readers of solution files, by a table of layouts.

The table of readers, shared parsing (text), and a reader for each kind. A reader returns the content of a
file; export/solutions interprets it for a problem.
"""
