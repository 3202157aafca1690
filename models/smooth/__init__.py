"""Fields from one sparse system."""
