"""Contents of a library."""
