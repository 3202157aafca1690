"""Sparse matrices from heights at corners of pixels to slopes, crosses without order, and coarser grids."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..field.field import CrossField
from ..instance.domain import Bools, Floats, Ints
from ..instance.grid import Grid
from ..smooth.polyvector import roots

_SMALL: Final = 500  # most pixels of the coarsest level, where all starts are tried
SLOPES: Final = np.array([[-0.5, 0.5, -0.5, 0.5], [0.5, 0.5, -0.5, -0.5]])
"""Weights of the four values of a 2 x 2 block, row by row, in the derivatives by x and y at its centre."""
_DOME: Final = 0.7  # height of a dome, relative to a half sphere
_PLANE: Final = 0.5  # slope of a plane


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
        for corner in corners_of_blocks(used):
            corner[self.grid.mask] = True
        return used

    @cached_property
    def count(self) -> int:
        """Number of corners N."""
        return int(self.used.sum())

    @cached_property
    def slopes(self) -> tuple[Any, Any]:
        """The matrices (n, N) of dz/dx and of dz/dy at the centres of pixels."""
        return self._at_points(*SLOPES[0]), self._at_points(*SLOPES[1])

    @cached_property
    def twist(self) -> Any:
        """The matrix (n, N) of the component without slope: the difference of a pixel's two diagonals."""
        return self._at_points(-1.0, 1.0, 1.0, -1.0)

    @cached_property
    def blocks(self) -> Ints:
        """Numbers of the pixels of each block, shape (4, b): upper left and right, lower left and right."""
        pixels = np.stack(corners_of_blocks(self.grid.number))
        return pixels[:, (pixels >= 0).all(axis=0)]

    @cached_property
    def changes(self) -> tuple[Any, Any]:
        """The matrices (b, n) from values of pixels to derivatives by x and y at the centres of blocks."""
        size = self.grid.size
        return _weighted_sums(self.blocks, size, *SLOPES[0]), _weighted_sums(self.blocks, size, *SLOPES[1])

    @cached_property
    def unevenness(self) -> Any:
        """The matrix (n, n) of sum (x_i - x_j)^2 over pairs of neighbours."""
        grid = self.grid
        ends = np.stack([grid.second, grid.first])
        difference = _weighted_sums(ends, grid.size, 1.0, -1.0)
        return difference.T @ difference

    @cached_property
    def corners(self) -> Ints:
        """Numbers of the corners of each pixel, shape (4, n): upper left and right, lower left and right."""
        number = np.full(self.used.shape, -1, dtype=np.int32)
        number[self.used] = np.arange(self.count, dtype=np.int32)
        return np.stack([corner[self.grid.mask] for corner in corners_of_blocks(number)])

    def gradient(self, z: Floats) -> Floats:
        """The slopes (2, n) by x and y of heights (N,)."""
        return SLOPES @ z[self.corners]

    def spread(self, parts: Floats) -> Floats:
        """The sums (N,) of numbers (2, n) by the slopes in which each height takes part."""
        return np.bincount(self.corners.ravel(), (SLOPES.T @ parts).ravel(), self.count)

    def _at_points(self, *weights: float) -> Any:
        return _weighted_sums(self.corners, self.count, *weights)


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

    def at(self, places: Ints) -> Crosses:
        """The crosses at some places, their numbers (k,)."""
        return Crosses(self.product[places], self.total[places])

    @property
    def lines(self) -> tuple[Floats, Floats]:
        """Unit vectors (x, y) of both lines, shape (n, 2) each."""
        first, second = (
            np.stack([np.cos(angle), np.sin(angle)], axis=1) for angle in roots(self.product, -self.total)
        )
        return first, second


def corners_of_blocks(corners: np.ndarray[Any, Any]) -> list[np.ndarray[Any, Any]]:
    """Views of a picture of points: upper left and right, lower left and right of each 2 x 2 of them."""
    ends = (slice(None, -1), slice(1, None))
    return [corners[down, right] for down in ends for right in ends]


def scale_rows(matrix: Any, by: Floats) -> Any:
    """The sparse matrix with each row multiplied by a number."""
    return sparse.diags_array(by) @ matrix


def _weighted_sums(places: Ints, size: int, *weights: float) -> Any:
    """The matrix (k, size) of weighted sums of the values at places (w, k)."""
    count = places.shape[1]
    at = (np.tile(np.arange(count), len(weights)), places.ravel())
    return sparse.csr_array((np.repeat(np.array(weights), count), at), shape=(count, size))


@dataclass(frozen=True, eq=False)
class GridLevel:
    """A mask and its crosses, with pixels of 2^`halved` of the pixels of the field.

    corner: row and column, in pixels of the field, of the upper left corner of the mask's picture.
    """

    stencils: Stencils
    crosses: Crosses
    corner: tuple[int, int] = (0, 0)
    halved: int = 0

    @property
    def grid(self) -> Grid:
        """Its pixels."""
        return self.stencils.grid

    def coarsen(self) -> GridLevel:
        """The level of pixels twice as large: one for each nonempty 2 x 2, with its mean cross."""
        grid = self.grid
        even = np.pad(grid.mask, [(0, size % 2) for size in grid.mask.shape])
        larger = Grid(np.any([even[down::2, right::2] for down in (0, 1) for right in (0, 1)], axis=0))
        at = larger.number[grid.rows // 2, grid.columns // 2]
        share = 1 / np.bincount(at, minlength=larger.size)[at]
        mean = sparse.csr_array((share, (at, np.arange(grid.size))), shape=(larger.size, grid.size))
        return GridLevel(Stencils(larger), self.crosses.averaged(mean), self.corner, self.halved + 1)

    def interpolate(self, coarse: GridLevel, heights: Floats) -> Floats:
        """The heights (N,) interpolated from the coarser level, which was made from this one."""
        picture = np.zeros(coarse.stencils.used.shape)
        picture[coarse.stencils.used] = heights
        row, column = np.nonzero(self.stencils.used)
        ends = [picture[r, c] for r in (row // 2, (row + 1) // 2) for c in (column // 2, (column + 1) // 2)]
        return np.asarray(2 * np.mean(ends, axis=0))

    @property
    def initial_heights(self) -> list[Floats]:
        """Initial heights: a dome over the mask, and planes that rise to the right and upwards."""
        from scipy import ndimage

        used = self.stencils.used
        row, column = np.nonzero(used)
        inside = ndimage.distance_transform_edt(np.pad(self.grid.mask, 1))
        depth = np.min(corners_of_blocks(inside), axis=0)[used]
        radius = depth.max() + 1
        dome = _DOME * np.sqrt(depth * (2 * radius - depth))
        return [dome, _PLANE * (column - column.mean()), -_PLANE * (row - row.mean())]


def levels_of(level: GridLevel) -> list[GridLevel]:
    """The level and coarser ones, the coarsest first."""
    levels = [level]
    while levels[0].grid.size > _SMALL:
        levels.insert(0, levels[0].coarsen())
    return levels
