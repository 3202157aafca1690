"""Checks of a library against its own statements.

Every file, document, entry and point compared with the problem, formulated again from the instance.
The checker for users without this package is documents/check_point.py.
"""
