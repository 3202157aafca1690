"""Contents of a library.

The specification (TOML), every instance and entry that follows from it, where sketches come from, which
entries are one problem. Nothing is made here.
"""
