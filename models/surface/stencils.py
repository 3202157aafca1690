"""Sparse matrices from heights at the corners of pixels to slopes and to changes of slopes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse

from ..instance.grid import Bools, Floats, Grid, Ints


@dataclass(frozen=True, eq=False)
class Stencils:
    """The matrices of a mask with n pixels, N corners numbered row by row, and b blocks of 2 x 2 pixels.

    Heights are a vector (N,), in pixels; x runs to the right, y up.
    """

    grid: Grid

    @cached_property
    def used(self) -> Bools:
        """Which corners [height + 1, width + 1] belong to a pixel of the mask."""
        used = np.zeros((self.grid.height + 1, self.grid.width + 1), dtype=bool)
        for corner in around(used):
            corner[self.grid.mask] = True
        return used

    @cached_property
    def count(self) -> int:
        """Number of corners N."""
        return int(self.used.sum())

    @cached_property
    def slopes(self) -> tuple[Any, Any]:
        """The matrices (n, N) of dz/dx and of dz/dy at the centres of pixels."""
        return self._at_pixels(-0.5, 0.5, -0.5, 0.5), self._at_pixels(0.5, 0.5, -0.5, -0.5)

    @cached_property
    def twist(self) -> Any:
        """The matrix (n, N) of the component without slope: the difference of a pixel's two diagonals."""
        return self._at_pixels(-1.0, 1.0, 1.0, -1.0)

    @cached_property
    def blocks(self) -> Ints:
        """Numbers of the pixels of each block, shape (4, b): upper left and right, lower left and right."""
        pixels = np.stack(around(self.grid.number))
        return pixels[:, (pixels >= 0).all(axis=0)]

    @cached_property
    def changes(self) -> tuple[Any, Any]:
        """The matrices (b, n) from values of pixels to derivatives by x and y at the centres of blocks."""
        size = self.grid.size
        return _sums(self.blocks, size, -0.5, 0.5, -0.5, 0.5), _sums(self.blocks, size, 0.5, 0.5, -0.5, -0.5)

    @cached_property
    def unevenness(self) -> Any:
        """The matrix (n, n) of sum (x_i - x_j)^2 over pairs of neighbours."""
        grid = self.grid
        ends = np.stack([grid.second, grid.first])
        difference = _sums(ends, grid.size, 1.0, -1.0)
        return difference.T @ difference

    def _at_pixels(self, *weights: float) -> Any:
        number = np.full(self.used.shape, -1, dtype=np.int32)
        number[self.used] = np.arange(self.count, dtype=np.int32)
        corners = np.stack([corner[self.grid.mask] for corner in around(number)])
        return _sums(corners, self.count, *weights)


def around(corners: np.ndarray[Any, Any]) -> list[np.ndarray[Any, Any]]:
    """Views of a picture of points: upper left and right, lower left and right of each 2 x 2 of them."""
    ends = (slice(None, -1), slice(1, None))
    return [corners[down, right] for down in ends for right in ends]


def scaled(matrix: Any, by: Floats) -> Any:
    """The sparse matrix with each row multiplied by a number."""
    return sparse.diags_array(by) @ matrix


def _sums(places: Ints, size: int, *weights: float) -> Any:
    """The matrix (k, size) of weighted sums of the values at places (w, k)."""
    count = places.shape[1]
    at = (np.tile(np.arange(count), len(weights)), places.ravel())
    return sparse.csr_array((np.repeat(np.array(weights), count), at), shape=(count, size))
