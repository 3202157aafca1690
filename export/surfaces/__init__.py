"""The files that a surface leaves."""
