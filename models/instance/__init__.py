"""Instances: a grid and its strokes.

The pixel grid with its neighbour pairs, line angles, the validated Instance with its gauge, and its files
(.json, .npz, schema). models/sketch makes instances from drawings; models/formulations states objectives.
"""
