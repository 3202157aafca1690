"""The nearest stroke to a pixel, inside the mask."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import dijkstra

from ..instance.domain import Ints
from ..instance.grid import Grid
from ..instance.instance import Instance


def nearest_strokes(instance: Instance) -> Ints:
    """The nearest stroke pixel's number by `chamfer_distances`, -1 in a part without strokes; (n,)."""
    grid = instance.grid
    _, _, source = dijkstra(
        chamfer_distances(grid),
        directed=False,
        indices=instance.stroke_index,
        min_only=True,
        return_predecessors=True,
    )
    number = np.full(grid.size + 1, -1, dtype=np.int32)
    number[instance.stroke_index] = np.arange(len(instance.stroke_index))
    nearest: Ints = number[np.where(source >= 0, source, grid.size)]
    return nearest


def chamfer_distances(grid: Grid) -> Any:
    """Distances between neighbours: 3 along the grid, 4 across a corner next to a pixel of the mask."""
    first, second = [grid.first], [grid.second]
    for down in (-1, 1):
        end = grid.numbers_at(grid.rows + down, grid.columns + 1)
        one = grid.numbers_at(grid.rows + down, grid.columns)
        another = grid.numbers_at(grid.rows, grid.columns + 1)
        passable = (end >= 0) & ((one >= 0) | (another >= 0))
        first.append(np.nonzero(passable)[0].astype(np.int32))
        second.append(end[passable])
    length = np.full(sum(map(len, first)), 4.0)
    length[: len(grid.first)] = 3.0
    place = (np.concatenate(first), np.concatenate(second))
    return sparse.csr_array((length, place), shape=(grid.size, grid.size))
