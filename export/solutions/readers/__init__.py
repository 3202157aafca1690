"""Readers of solution files, one module per kind.

The table of readers, shared parsing (text), and a reader for each kind. A reader returns the content of a
file; export/solutions interprets it for a problem.
"""
