"""The problem's data: a grid and its strokes.

The pixel grid with its neighbour pairs, line angles, the validated Instance with its gauge, and its files
(.json, .npz, schema). How a drawing becomes an instance is models/sketch; what is minimised is
models/formulations.
"""
