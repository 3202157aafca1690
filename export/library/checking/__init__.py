"""Checks that a library is what it says.

Every file, document, entry and point compared with the problem, formulated again from the instance.
The checker for users without this package is documents/check_point.py.
"""
