"""Measures of a field: its energy and its singularities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..instance.domain import Floats, Ints
from ..instance.instance import Instance


@dataclass(frozen=True)
class Energy:
    """The three sums of an energy and their total, each already weighted."""

    smooth: float
    strokes: float
    beta: float

    @property
    def total(self) -> float:
        """Smooth + strokes + beta."""
        return self.smooth + self.strokes + self.beta


@dataclass(frozen=True)
class Singularities:
    """Rings around which the crosses turn.

    instance: on whose domain. ring: number of each, (k,). index: turns of the cross on a counter-clockwise
    walk, (k,), multiples of 1/4; on a closed mesh they add up to the Euler characteristic.
    """

    instance: Instance
    ring: Ints
    index: Floats

    @property
    def row(self) -> Ints:
        """Row of the upper left of the four pixels of each ring of a grid, (k,)."""
        return self.instance.grid.rows[self._corner] - 1

    @property
    def column(self) -> Ints:
        """Column of the upper left of the four pixels of each ring of a grid, (k,)."""
        return self.instance.grid.columns[self._corner]

    @property
    def vertex(self) -> Ints:
        """Vertex inside each ring, as `mesh_of` numbers them, ascending, (k,)."""
        return self.instance.domain.ring_vertices[self.ring]

    @property
    def _corner(self) -> Ints:
        """The lower left pixel of each ring of a grid, where its first pair begins."""
        grid = self.instance.grid
        return np.asarray(grid.first[grid.quads[self.ring, 0]])
