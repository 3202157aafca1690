"""Crosses at every pixel, and what they mean.

The CrossField with its jumps, energy, singularities and errors, and its files (.npz, .json, .rawfield,
schema). How a field is found is models/search and export/solving; how it is drawn is export/pictures.
"""
