"""Arrays that the compiled passes of a proof read and change."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..instance.domain import Floats, Ints
from ..instance.grid import Grid
from .lattice import Lattice, Starts
from .pruning import allowed_rows

Indices = NDArray[np.int64]
"""Numbers of pixels and pairs: all of one type, so that each function is compiled once."""

RowEnds = tuple[Indices, Indices]
"""For each row of a matrix, the first column in use, and the one after the last."""


class Clusters(NamedTuple):
    """Tables on pairs of alphas, four for each quad; see models/proof/clusters.py."""

    quads: Indices  # (q, 4): the pairs of each quad, as in `Grid.quads`
    start: (
        Starts  # (4 q + 1,): start of each table, alpha-major from the first to the second pixel of its pair
    )
    of_pair: Indices  # (m, 2): numbers of the tables of each pair, or -1
    tables: Floats


class State(NamedTuple):
    """A lattice and the shares on it as arrays, which the compiled passes read and change."""

    h: float
    alpha: Floats  # of each pixel's first label
    beta: Floats
    alpha_count: Ints
    beta_count: Ints
    start: Starts
    row_start: Starts  # (n + 1,): start of the rows of each pixel, one for each alpha
    begin: Indices  # of each row: its first allowed label
    end: Indices  # and the one after the last, twice 0 for none
    unary: Floats
    first: Indices
    second: Indices
    odd: Ints
    start_first: Starts
    start_second: Starts
    around: Indices  # pairs to the upper, left, lower, right neighbour of each pixel, or -1
    shares_first: Floats  # numbers before `begin` and after `end` are not used
    shares_second: Floats
    theta: Floats  # as the last pass found it at each pixel; there inf
    least: Floats  # of each pixel's theta
    power: int  # of the residuals of pairs: 1 or 2
    clusters: Clusters


def state_on(lattice: Lattice, shares: tuple[Floats, Floats], clusters: Clusters) -> State:
    """A lattice as arrays, with shares at the first and at the second pixels of all pairs, and clusters."""
    grid = lattice.instance.grid
    unary = lattice.unary_costs()
    row_start, begin, end = allowed_rows(lattice)
    return State(
        lattice.h,
        lattice.alpha + lattice.h * (lattice.alpha_first + lattice.offset),
        lattice.beta + lattice.h * (lattice.beta_first + lattice.offset),
        lattice.alpha_count,
        lattice.beta_count,
        lattice.start,
        row_start,
        begin,
        end,
        unary,
        grid.first.astype(np.int64),
        grid.second.astype(np.int64),
        lattice.p & 1,
        lattice.share_starts(grid.first),
        lattice.share_starts(grid.second),
        _around(grid),
        *shares,
        unary.copy(),
        np.zeros(grid.size),
        2 if lattice.norm == 2 else 1,
        clusters,
    )


def _around(grid: Grid) -> Indices:
    """The pairs of each pixel with its upper, left, lower and right neighbour, -1 for none; shape (n, 4)."""
    upper, right = (np.pad(table, 1, constant_values=-1) for table in grid.pair_number)
    row, column = grid.rows + 1, grid.columns + 1
    pairs = (upper[row, column], right[row, column - 1], upper[row + 1, column], right[row, column])
    return np.stack(pairs, axis=1).astype(np.int64)
