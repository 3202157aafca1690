"""The instance library: built from a specification, checked, given better points, and shown as a static site."""
