"""Where the bound of a level falls short of the energy of the field at its centre.

Rounding that field gives each pixel one or four labels of equal probability. In the mean over them, costs of
pixels and pairs exceed the least values that the bound takes there. These slacks sum to the gap that the
level leaves. At a vortex, a few pixels hold most of it.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from ..instance.grid import Floats, Ints
from ..instance.instance import HALF
from .lattice import Lattice
from .state import State


def quad_slacks(lattice: Lattice, state: State) -> Floats:
    """The slack of the four pixels of each quad, and half of the slack of each of their pairs; shape (q,).

    Pairs count as after a pass, when their least value is 0.
    """
    grid = lattice.instance.grid
    corners = [_Corner(lattice, *each) for each in product((0, -1), repeat=2)]
    theta = _all_taken(lattice, state)
    least = np.minimum.reduceat(theta, lattice.start[:-1])
    at_pixel = np.mean([theta[lattice.start[:-1] + corner.label] for corner in corners], axis=0) - least
    at_pair = np.mean([_pairs(lattice, state, x, y) for x, y in product(corners, repeat=2)], axis=0) / 2
    for ends in (grid.first, grid.second):
        np.add.at(at_pixel, ends, at_pair)
    bottom, _, top, _ = grid.quads.T
    pixels = (grid.first[bottom], grid.second[bottom], grid.first[top], grid.second[top])
    found: Floats = np.sum([at_pixel[each] for each in pixels], axis=0)
    return found


class _Corner:
    """One of the labels round the centre of each pixel: on black pixels always the centre itself.

    label (n,): its number. row (n,): that of its alpha. alpha, beta (n,): its angles.
    """

    def __init__(self, lattice: Lattice, k: int, l: int) -> None:  # noqa: E741 - the letter of the equation
        white = lattice.offset > 0
        self.row: Ints = k * white - lattice.alpha_first
        self.label: Ints = self.row * lattice.beta_count + l * white - lattice.beta_first
        self.alpha = lattice.alpha + lattice.h * (k * white + lattice.offset)
        self.beta = lattice.beta + lattice.h * (l * white + lattice.offset)


def _all_taken(lattice: Lattice, state: State) -> Floats:
    """The cost of each label plus the shares of all pairs there."""
    theta = state.unary.copy()
    for ends, shares in ((state.first, state.shares_first), (state.second, state.shares_second)):
        counts = lattice.count[ends]
        begin = np.cumsum(counts) - counts
        place = np.arange(len(shares)) + np.repeat(lattice.start[ends] - begin, counts)
        np.add.at(theta, place, shares)
    return theta


def _pairs(lattice: Lattice, state: State, x: _Corner, y: _Corner) -> Floats:
    """The cost of each pair with its tables, less its shares, at a corner of each end; shape (m,)."""
    i, j = state.first, state.second
    apart = x.alpha[i] - y.alpha[j]
    cost = np.full(len(i), np.inf)
    for parity in (0, 1):
        a = apart + HALF * parity
        a -= np.pi * np.round(a / np.pi)
        b = (1 - 2 * parity) * x.beta[i] - y.beta[j]
        size = a * a + b * b if lattice.norm == 2 else np.abs(a) + np.abs(b)
        cost = np.minimum(cost, 2 * size)
    cost -= lattice.h**2 if lattice.norm == 2 else 0.0
    cost -= state.shares_first[state.start_first[:-1] + x.label[i]]
    cost -= state.shares_second[state.start_second[:-1] + y.label[j]]
    clusters = state.clusters
    for numbers in clusters.of_pair.T:
        at = np.flatnonzero(numbers >= 0)
        wide = lattice.alpha_count[j[at]]
        place = clusters.start[numbers[at]] + x.row[i[at]] * wide + y.row[j[at]]
        cost[at] += clusters.tables[place]
    return cost
