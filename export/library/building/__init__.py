"""Making a library."""
