"""Errors of fields on curves that were hidden from them."""
