"""From crosses to heights: the surface whose curvature lines they are."""
