"""Checks of a library against its own statements."""
