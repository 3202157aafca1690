"""Crosses at every pixel, and their meaning."""
