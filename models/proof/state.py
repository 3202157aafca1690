"""Arrays that the compiled passes of a proof read and change."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..instance.grid import Floats, Ints
from .lattice import Starts

Indices = NDArray[np.int64]
"""Numbers of pixels and pairs: all of one type, so that each function is compiled once."""

Ends = tuple[Indices, Indices]
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
