"""Instances: a grid and its strokes."""
