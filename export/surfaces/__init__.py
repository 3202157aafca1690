"""What a surface leaves: pictures, heights, mesh, report."""
