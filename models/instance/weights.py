"""Weights that mean the same on every grid, and their coefficients in the energy on one grid.

The smoothness of a field is a sum of squared differences over pairs of pixels. It keeps its value on a finer
grid: twice as many pixels per side give four times as many pairs of half the difference. A stroke then runs
through twice as many pixels, and the area holds four times as many. So a weight of the strokes is divided by
the pixels of the longer side, and a weight of the skew by their square.
"""

from __future__ import annotations

from typing import Final

REFERENCE: Final = 24  # pixels of the longer side of the grid on which weights are coefficients
STROKE_WEIGHT: Final = 20.0  # default weight of the strokes of a sketch; see docs/weights.md for the reason
SKEW_WEIGHT: Final = 1e-6  # default weight of the skew in a sketch


def coefficient_of(weight: float, longer: int, power: int) -> float:
    """The coefficient of a weight on a grid; longer: pixels of its longer side."""
    return float(weight * REFERENCE**power / longer**power)


def weight_of(coefficient: float, longer: int, power: int) -> float:
    """The weight, to 12 digits, with this coefficient on a grid."""
    return in_digits(coefficient * longer**power / REFERENCE**power)


def in_digits(value: float) -> float:
    """The number to 12 significant digits, equal on processors that differ in the last digit."""
    return float(f"{value:.12g}") + 0.0  # no -0.0
