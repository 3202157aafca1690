"""A library as static pages.

A table of all entries, a page for each instance and entry, pictures and files. The layouts are
templates/site.
"""
