"""Files out (formats), files in (solutions), local solvers, drawing, command line."""
