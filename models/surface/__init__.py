"""Surfaces from cross fields."""
