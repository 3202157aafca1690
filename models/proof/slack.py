"""Where the bound of a level falls short of the energy of the best known field.

Rounding that field gives each pixel one of a few labels. In the mean over them, costs of pixels and pairs
exceed the least values that the bound takes there. These slacks sum to the gap that the level leaves. At a
vortex, a few pixels hold most of it.
"""

from __future__ import annotations

from itertools import product
from typing import Final

import numpy as np

from ..instance.grid import Floats, Ints
from ..processes.compiled import compiled
from .lattice import Lattice
from .products import all_taken
from .state import State

_THRESHOLDS: Final = (0.25, 0.75)  # of the rounding


def quad_slacks(lattice: Lattice, state: State, angles: tuple[Floats, Floats]) -> Floats:
    """The slack of the four pixels of each quad, and half of the slack of each of their pairs; shape (q,).

    Pairs count as after a pass, when their least value is 0. Without a label near the field, a slack is 0.
    angles: alpha and beta of a field, as from `labels_at`.
    """
    grid = lattice.instance.grid
    corners = _corners(lattice, *angles)
    theta = np.empty(lattice.start[-1])
    _fill_taken(state, theta)
    begin = lattice.start[:-1]
    least = np.minimum.reduceat(theta, begin)
    at_pixel = np.mean([theta[begin + corner.label] for corner in corners], axis=0) - least
    at_pair = np.mean([_pairs(lattice, state, corner) for corner in corners], axis=0) / 2
    for ends in (grid.first, grid.second):
        np.add.at(at_pixel, ends, at_pair)
    bottom, _, top, _ = grid.quads.T
    pixels = (grid.first[bottom], grid.second[bottom], grid.first[top], grid.second[top])
    found: Floats = np.sum([at_pixel[each] for each in pixels], axis=0)
    return np.where(np.isfinite(found), found, 0.0)


class _Corner:
    """A label of each pixel.

    label (n,): its number. row (n,): that of its alpha. alpha, beta (n,): its angles.
    """

    def __init__(self, lattice: Lattice, k: Ints, l: Ints) -> None:  # noqa: E741 - the letter of the equation
        self.row: Ints = np.clip(k - lattice.alpha_first, 0, lattice.alpha_count - 1)
        column = np.clip(l - lattice.beta_first, 0, lattice.beta_count - 1)
        self.label: Ints = self.row * lattice.beta_count + column
        self.alpha = lattice.alpha + lattice.h * (self.row + lattice.alpha_first + lattice.offset)
        self.beta = lattice.beta + lattice.h * (column + lattice.beta_first + lattice.offset)


def _corners(lattice: Lattice, alpha: Floats, beta: Floats) -> list[_Corner]:
    """The labels to which a few thresholds round a field."""
    k = (alpha - lattice.alpha) / lattice.h - lattice.offset
    l = (beta - lattice.beta) / lattice.h - lattice.offset  # noqa: E741 - the letter of the equation
    return [
        _Corner(lattice, np.floor(k + s).astype(np.int32), np.floor(l + t).astype(np.int32))
        for s, t in product(_THRESHOLDS, repeat=2)
    ]


@compiled
def _fill_taken(state: State, theta: Floats) -> None:
    """Fill in the cost of each label plus the shares of all pairs there."""
    for i in range(state.least.size):
        theta[state.start[i] : state.start[i + 1]] = all_taken(i, state)


def _pairs(lattice: Lattice, state: State, corner: _Corner) -> Floats:
    """The costs of pairs with their tables, less their shares, at a corner of both ends."""
    i, j = state.first, state.second
    size = np.square if lattice.norm == 2 else np.abs
    cost = lattice.instance.pair_terms.least_costs(corner.alpha, corner.beta, size)
    cost -= lattice.h**2 if lattice.norm == 2 else 0.0
    cost -= state.shares_first[state.start_first[:-1] + corner.label[i]]
    cost -= state.shares_second[state.start_second[:-1] + corner.label[j]]
    clusters = state.clusters
    for numbers in clusters.of_pair.T:
        at = np.flatnonzero(numbers >= 0)
        wide = lattice.alpha_count[j[at]]
        place = clusters.start[numbers[at]] + corner.row[i[at]] * wide + corner.row[j[at]]
        cost[at] += clusters.tables[place]
    return cost
