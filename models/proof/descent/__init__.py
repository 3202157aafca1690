"""From level to level, until the bound is the energy of a field.

`descent` does this in the 2-norm, `absolute_descent` for absolute values, and `orthogonal` for orthogonal
crosses. `last_step` branches on the boxes that a level leaves, and `record` is the result.
"""
