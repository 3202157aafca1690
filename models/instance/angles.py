"""Line directions: angles modulo pi, counter-clockwise, y up, averaged only by the double angle."""

from __future__ import annotations

from typing import Final

import numpy as np

from .elementary import arctangent, cosine, sine
from .grid import Floats

MOST_ANGLE: Final = 1e6  # largest absolute angle in radians that keeps enough digits modulo pi


def wrap(angle: Floats, lower: Floats | float, period: float) -> Floats:
    """The angles moved by multiples of `period` into [lower, lower + period)."""
    wrapped = lower + np.mod(angle - lower, period)
    # np.mod of a tiny negative number rounds up to the period itself.
    return np.where(wrapped >= lower + period, lower, wrapped)


def line_difference(first: Floats, second: Floats) -> Floats:
    """The angle between lines, in [0, pi/2] radians."""
    difference = np.abs(wrap(first - second, -np.pi / 2, np.pi))
    return np.minimum(difference, np.pi / 2)


def double_angle(angle: Floats) -> Floats:
    """Unit vectors (cos 2a, sin 2a) that are equal for equal lines; a last axis of length 2 is added."""
    return np.stack([cosine(2 * angle), sine(2 * angle)], axis=-1)


def line_of(vector: Floats) -> Floats:
    """The line direction in [0, pi) of double-angle vectors (last axis of length 2)."""
    return wrap(arctangent(vector[..., 1], vector[..., 0]) / 2, 0.0, np.pi)
