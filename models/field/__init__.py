"""Crosses at every pixel, and their meaning.

CrossField with its jumps, energy, singularities and errors, and its files (.npz, .json, .rawfield,
schema). models/search and export/solving find fields; export/pictures draws them.
"""
