"""What is minimised, in the paper's notation.

The symbols, the catalogue of formulations, the Problem (a formulation bound to an instance, as arrays),
monomials, LaTeX. No text of any file format: that is export/formats.
"""
