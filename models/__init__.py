"""The mathematics: sketch, instance, formulations, problem, field. Knows no file format of a solver."""
