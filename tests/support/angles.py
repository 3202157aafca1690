"""Angles between lines, without the code that is tested."""

import numpy as np

HALF = np.pi / 2
QUARTER = np.pi / 4


def line_difference(first, second):
    """The angle between lines, in [0, pi/2] radians."""
    return np.abs((np.subtract(first, second) + HALF) % np.pi - HALF)
