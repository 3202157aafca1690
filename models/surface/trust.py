"""x."""
from .surface import Surface
import numpy as np
def judged(field, heights):
    return Surface(field, heights, np.ones(field.instance.grid.size))
