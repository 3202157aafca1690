"""Solver packages in memory: a problem as a model of each, and the answer of a solved model."""
