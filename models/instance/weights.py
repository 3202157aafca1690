"""Weights that mean the same on every grid, and their coefficients in the energy on one grid.

The smoothness of a field is a sum of squared differences over pairs of pixels. It keeps its value on a finer
grid: twice as many pixels per side give four times as many pairs of half the difference. A stroke then runs
through twice as many pixels, and the area holds four times as many. So a weight of the strokes is divided by
the pixels of the longer side, and a weight of the skew by their square.
"""

from __future__ import annotations

from typing import Final

from .digits import in_digits

REFERENCE: Final = 24
"""Pixels of the longer side of the grid on which weights are the coefficients of the energy."""
STROKE_WEIGHT: Final = 20.0
"""Default weight of the strokes of a sketch; see docs/evidence.md for the reason."""
SKEW_WEIGHT: Final = 1e-6
"""Default weight of the skew in a sketch."""


def stroke_coefficient(weight: float, longer: int) -> float:
    """The coefficient of a weight of the strokes; longer: pixels of the grid's longer side."""
    return weight * REFERENCE / longer


def skew_coefficient(weight: float, longer: int) -> float:
    """The coefficient of a weight of the skew; longer: pixels of the grid's longer side."""
    return weight * REFERENCE**2 / longer**2


def stroke_weight(coefficient: float, longer: int) -> float:
    """The weight of the strokes, to 12 digits, with this coefficient on a grid."""
    return in_digits(coefficient * longer / REFERENCE)


def skew_weight(coefficient: float, longer: int) -> float:
    """The weight of the skew, to 12 digits, with this coefficient on a grid."""
    return in_digits(coefficient * longer**2 / REFERENCE**2)
