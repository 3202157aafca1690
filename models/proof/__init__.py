"""Proofs that no field has a lower energy.

Lower bounds of the 2-norm energy on lattices of crosses, the labels that they leave possible, and fields that
are proven optimal. models/search finds fields.
"""
