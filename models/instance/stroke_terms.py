"""The stroke terms of an energy as arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .grid import Floats, Ints


@dataclass(frozen=True, eq=False)
class StrokeTerms:
    """One residual R = alpha + beta - goal for each stroke pixel, shapes (s,).

    pixel: number of the pixel. goal: its direction in the gauge's range. weight: its reliability times the
    instance's `stroke_coefficient`.
    """

    pixel: Ints
    goal: Floats
    weight: Floats

    def residuals(self, alpha: Floats, beta: Floats) -> Floats:
        """R of each term in radians, shape (s,), of the angles (n,) of all pixels."""
        return alpha[self.pixel] + beta[self.pixel] - self.goal

    def at_pixels(self, values: Floats, size: int) -> Floats:
        """Sums of the terms' values at each of `size` pixels, shape (size,)."""
        return np.bincount(self.pixel, values, size).astype(np.float64, copy=False)

    def chosen(self, terms: Ints, number: Ints) -> StrokeTerms:
        """Some of the terms, by their numbers, at pixels renumbered by `number` (n,)."""
        return StrokeTerms(number[self.pixel[terms]], self.goal[terms], self.weight[terms])
