"""Line directions: angles modulo pi, counter-clockwise, y up, averaged only by the double angle.

Sine, cosine, arctangent, lengths and products are correct to 1e-15 and equal on every processor: they use
only additions, multiplications, divisions and square roots, one at a time, which IEEE 754 rounds in one way.
"""

from __future__ import annotations

from math import factorial
from typing import Final

import numpy as np

from .domain import Floats

QUARTER: Final = np.pi / 4
HALF: Final = np.pi / 2
MOST_ANGLE: Final = 1e6  # largest absolute angle in radians that keeps enough digits modulo pi
SLACK: Final = 1e-9  # radians or quarter turns by which rounding may move the end of a range
_TERMS: Final = 9  # of the series of sine and cosine: beyond, less than 1e-17 on [-pi/4, pi/4]
_SINE: Final = [(-1) ** k / factorial(2 * k + 1) for k in range(_TERMS)]
_COSINE: Final = [(-1) ** k / factorial(2 * k) for k in range(_TERMS)]
_ARCTANGENT: Final = [(-1) ** k / (2 * k + 1) for k in range(13)]  # beyond, less than 1e-19 for tan(pi/16)
_HALF_TURNS: Final = (1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
"""pi/2 as a sum; the first two have 33 bits, so that their products with numbers up to 2^20 are exact."""


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


def sine(angle: Floats) -> Floats:
    """The sine of angles in radians, up to a million; any shape."""
    return _quarter_wave(angle, 0)


def cosine(angle: Floats) -> Floats:
    """The cosine of angles in radians, up to a million; any shape."""
    return _quarter_wave(angle, 1)


def arctangent(y: Floats, x: Floats) -> Floats:
    """The angle in (-pi, pi] of vectors (x, y), in radians; 0 for the vector 0. Shapes are broadcast."""
    across, along = np.abs(y), np.abs(x)
    larger = np.maximum(across, along)
    t = np.minimum(across, along) / np.where(larger > 0, larger, 1.0)
    for _ in range(2):  # tan(a / 2) from tan(a)
        t = t / (1 + np.sqrt(1 + t * t))
    angle = 4 * t * _series(_ARCTANGENT, t * t)
    angle = np.where(across > along, np.pi / 2 - angle, angle)
    angle = np.where(x < 0, np.pi - angle, angle)
    return np.where(y < 0, -angle, angle)


def vector_length(x: Floats, y: Floats) -> Floats:
    """The length of vectors (x, y), without protection from overflow; shapes are broadcast."""
    return np.sqrt(x * x + y * y)


def transform_vectors(vectors: Floats, matrix: Floats) -> Floats:
    """The vectors (..., k) times the matrix (c, k), shape (..., c), summed from left to right."""
    total = vectors[..., :1] * matrix[:, 0]
    for k in range(1, matrix.shape[1]):
        total = total + vectors[..., k : k + 1] * matrix[:, k]
    return total


def _quarter_wave(angle: Floats, quarters: int) -> Floats:
    """The sine of the angles plus a number of quarter turns."""
    angle = np.asarray(angle, dtype=np.float64)
    turns = np.rint(angle * (2 / np.pi))
    rest = angle
    for part in _HALF_TURNS:
        rest = rest - turns * part
    square = rest * rest
    quadrant = np.mod(turns + quarters, 4)
    wave = np.where(np.mod(quadrant, 2) == 0, rest * _series(_SINE, square), _series(_COSINE, square))
    return np.where(quadrant >= 2, -wave, wave)


def _series(coefficients: list[float], x: Floats) -> Floats:
    """The value of the polynomial with these coefficients, the constant first."""
    value = np.full_like(x, coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        value = value * x + coefficient
    return value
