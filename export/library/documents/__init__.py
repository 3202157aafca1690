"""Files of a library that describe its entries."""
