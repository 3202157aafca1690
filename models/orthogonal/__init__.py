"""Integers of orthogonal crosses (beta = 0), on pixels and on faces.

With right angles the energy at fixed jumps is a quadratic form in alpha alone, as of springs on a graph.
"""
