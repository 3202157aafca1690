"""A library as static pages."""
