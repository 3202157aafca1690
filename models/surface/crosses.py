"""Means of crosses whose lines have no order: means of the polynomials that have both lines as roots."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..field.field import CrossField
from ..instance.grid import Bools, Floats
from ..smooth.polyvector import roots


@dataclass(frozen=True, eq=False)
class Crosses:
    """Two lines at each of n places: product and total of their numbers exp(2 i angle), complex (n,)."""

    product: NDArray[np.complex128]
    total: NDArray[np.complex128]

    @classmethod
    def of(cls, field: CrossField) -> Crosses:
        """The crosses of a field, from u at alpha + beta and v at alpha + pi/2 - beta."""
        return cls(-np.exp(4j * field.alpha), 2j * np.sin(2 * field.beta) * np.exp(2j * field.alpha))

    def averaged(self, mean: Any) -> Crosses:
        """The means by a matrix (k, n) whose rows add up to 1."""
        return Crosses(mean @ self.product, mean @ self.total)

    def at(self, places: Bools) -> Crosses:
        """The crosses at some places, a mask (n,)."""
        return Crosses(self.product[places], self.total[places])

    @property
    def lines(self) -> tuple[Floats, Floats]:
        """Unit vectors (x, y) of both lines, shape (n, 2) each."""
        first, second = (
            np.stack([np.cos(angle), np.sin(angle)], axis=1) for angle in roots(self.product, -self.total)
        )
        return first, second
