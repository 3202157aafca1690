"""Formulations in the paper's notation.

The symbols, the catalogue of formulations, the Problem (a formulation bound to an instance, as arrays),
monomials, LaTeX. Texts of file formats belong to export/formats.
"""
