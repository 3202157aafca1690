"""Instances in the style of MINLPLib and QPLIB.

Folders in the order of the work: plan, documents, ledger, building, contributions.
Only the command line uses libraries.
"""
