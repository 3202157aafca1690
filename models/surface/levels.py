"""One part of a mask on coarser and coarser grids, and heights from a coarser one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import sparse

from ..instance.grid import Floats, Grid
from .crosses import Crosses
from .stencils import Stencils, around

SMALL: Final = 500  # most pixels of the coarsest level, where all starts are tried
_DOME: Final = 0.7  # height of a dome, relative to a half sphere
_PLANE: Final = 0.5  # slope of a plane


@dataclass(frozen=True, eq=False)
class Level:
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

    def coarser(self) -> Level:
        """The level of pixels twice as large: one for each nonempty 2 x 2, with its mean cross."""
        grid = self.grid
        even = np.pad(grid.mask, [(0, size % 2) for size in grid.mask.shape])
        larger = Grid(np.any([even[down::2, right::2] for down in (0, 1) for right in (0, 1)], axis=0))
        at = larger.number[grid.rows // 2, grid.columns // 2]
        share = 1 / np.bincount(at, minlength=larger.size)[at]
        mean = sparse.csr_array((share, (at, np.arange(grid.size))), shape=(larger.size, grid.size))
        return Level(Stencils(larger), self.crosses.averaged(mean), self.corner, self.halved + 1)

    def refined(self, coarse: Level, heights: Floats) -> Floats:
        """The heights (N,) interpolated from the coarser level, which was made from this one."""
        picture = np.zeros(coarse.stencils.used.shape)
        picture[coarse.stencils.used] = heights
        row, column = np.nonzero(self.stencils.used)
        ends = [picture[r, c] for r in (row // 2, (row + 1) // 2) for c in (column // 2, (column + 1) // 2)]
        fine: Floats = 2 * np.mean(ends, axis=0)
        return fine

    @property
    def starts(self) -> list[Floats]:
        """Initial heights: a dome over the mask, and planes that rise to the right and upwards."""
        from scipy import ndimage

        used = self.stencils.used
        row, column = np.nonzero(used)
        inside = ndimage.distance_transform_edt(np.pad(self.grid.mask, 1))
        depth = np.min(around(inside), axis=0)[used]
        radius = depth.max() + 1
        dome = _DOME * np.sqrt(depth * (2 * radius - depth))
        return [dome, _PLANE * (column - column.mean()), -_PLANE * (row - row.mean())]


def levels_of(level: Level) -> list[Level]:
    """The level and coarser ones, the coarsest first."""
    found = [level]
    while found[0].grid.size > SMALL:
        found.insert(0, found[0].coarser())
    return found
