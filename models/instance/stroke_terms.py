"""The stroke terms of an energy as arrays: at a crossing two of them pull at one pixel, each at its line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .grid import Floats, Ints


@dataclass(frozen=True, eq=False)
class StrokeTerms:
    """One residual R = alpha + side beta - goal for each stroke of each pixel, shapes (r,).

    pixel: its number. side: 1 where line u follows the stroke, -1 where line v does, whose goal is pi/2 less
    than its direction. weight: w_strokes times the reliability of the direction.
    """

    pixel: Ints
    side: Floats
    goal: Floats
    weight: Floats

    def residuals(self, alpha: Floats, beta: Floats) -> Floats:
        """R of each term in radians, shape (r,), of the angles (n,) of all pixels."""
        return alpha[self.pixel] + self.side * beta[self.pixel] - self.goal

    def at_pixels(self, values: Floats, size: int) -> Floats:
        """Sums of the terms' values at each of `size` pixels, shape (size,)."""
        return np.bincount(self.pixel, values, size).astype(np.float64, copy=False)

    def chosen(self, terms: Ints, number: Ints) -> StrokeTerms:
        """Some of the terms, by their numbers, at pixels that are numbered anew by `number` (n,)."""
        return StrokeTerms(number[self.pixel[terms]], self.side[terms], self.goal[terms], self.weight[terms])
