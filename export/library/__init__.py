"""Instances in the style of MINLPLib and QPLIB.

Folders in the order of the work: plan, documents, ledger, building, checking, contributions, site.
Nothing of the package uses a library but the command line.
"""
