"""From a mesh file to an instance."""
