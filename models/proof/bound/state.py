"""Arrays that the compiled passes of a proof read and change."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...instance.domain import Floats
from ...instance.grid import Grid
from .lattice import Lattice, Starts
from .pruning import allowed_rows

Indices = NDArray[np.int64]
"""Numbers of pixels and pairs: all of one type, so that each function is compiled once."""

Records = NDArray[np.void]

_PIXEL: Final = np.dtype(
    [
        ("alpha", np.float64),  # of the first label
        ("beta", np.float64),
        ("alpha_count", np.int64),
        ("beta_count", np.int64),
        ("start", np.int64),  # of the labels
        ("row_start", np.int64),  # of the rows, one for each alpha
        ("least", np.float64),  # of theta
    ]
)
_PAIR: Final = np.dtype(
    [(name, np.int64) for name in ("first", "second", "odd", "start_first", "start_second")]
)

RowEnds = tuple[Indices, Indices]
"""For each row of a matrix, the first column in use, and the one after the last."""


class Clusters(NamedTuple):
    """Tables on pairs of alphas, four for each quad; see models/proof/bound/clusters.py."""

    quads: Indices  # (q, 4): the pairs of each quad, as in `Grid.quads`
    start: (
        Starts  # (4 q + 1,): start of each table, alpha-major from the first to the second pixel of its pair
    )
    of_pair: Indices  # (m, 2): numbers of the tables of each pair, or -1
    tables: Floats


class State(NamedTuple):
    """A lattice and the shares on it as arrays, which the compiled passes read and change.

    Numbers of a pixel or a pair are records: each array costs the compiler time in every function.
    """

    h: float
    pixels: Records  # as of _PIXEL; the last one has the ends of starts alone
    pairs: Records  # as of _PAIR, likewise
    begin: Indices  # of each row: its first allowed label
    end: Indices  # and the one after the last, twice 0 for none
    unary: Floats
    around: Indices  # pairs to the upper, left, lower, right neighbour of each pixel, or -1
    shares_first: Floats  # numbers before `begin` and after `end` are not used
    shares_second: Floats
    theta: Floats  # as the last pass found it at each pixel; there inf
    power: int  # of the residuals of pairs: 1 or 2
    clusters: Clusters

    @property
    def start(self) -> Starts:
        """Start of the labels of each pixel, and the end of the last; shape (n + 1,)."""
        return self.pixels["start"]

    @property
    def least(self) -> Floats:
        """The least of each pixel's theta, shape (n,)."""
        return self.pixels["least"][:-1]


def state_on(lattice: Lattice, shares: tuple[Floats, Floats], clusters: Clusters) -> State:
    """A lattice as arrays, with shares at the first and at the second pixels of all pairs, and clusters."""
    grid = lattice.instance.grid
    unary = lattice.unary_costs()
    row_start, begin, end = allowed_rows(lattice, lattice.allowed)
    pixels, pairs = np.zeros(grid.size + 1, _PIXEL), np.zeros(len(grid.first) + 1, _PAIR)
    pixels["alpha"][:-1] = lattice.alpha + lattice.h * (lattice.alpha_first + lattice.offset)
    pixels["beta"][:-1] = lattice.beta + lattice.h * (lattice.beta_first + lattice.offset)
    pixels["alpha_count"][:-1], pixels["beta_count"][:-1] = lattice.alpha_count, lattice.beta_count
    pixels["start"], pixels["row_start"] = lattice.start, row_start
    pairs["first"][:-1], pairs["second"][:-1], pairs["odd"][:-1] = grid.first, grid.second, lattice.p & 1
    pairs["start_first"] = lattice.share_starts(grid.first)
    pairs["start_second"] = lattice.share_starts(grid.second)
    return State(
        lattice.h,
        pixels,
        pairs,
        begin,
        end,
        unary,
        _around(grid),
        *shares,
        unary.copy(),
        2 if lattice.norm == 2 else 1,
        clusters,
    )


def _around(grid: Grid) -> Indices:
    """The pairs of each pixel with its upper, left, lower and right neighbour, -1 for none; shape (n, 4)."""
    pairs = np.full((grid.size, 4), -1, dtype=np.int64)
    upwards, to_right = np.nonzero(grid.upward)[0], np.nonzero(~grid.upward)[0]
    pairs[grid.first[upwards], 0], pairs[grid.second[to_right], 1] = upwards, to_right
    pairs[grid.second[upwards], 2], pairs[grid.first[to_right], 3] = upwards, to_right
    return pairs
