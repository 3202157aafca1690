"""Shaded pictures of surfaces."""
