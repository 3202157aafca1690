"""The built-in samples of all kinds."""
