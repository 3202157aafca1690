"""Surfaces in light: shaded pictures, matcaps, normal maps."""
