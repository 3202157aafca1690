"""New bounds and better points."""
