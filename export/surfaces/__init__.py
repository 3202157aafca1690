"""Files of a surface."""
