"""From crosses to the surface that has them."""
