"""Passes over all pairs of a lattice: the dual of the local polytope, by TRW-S.

Kolmogorov, Convergent tree-reweighted message passing for energy minimization, IEEE TPAMI 28 (2006), written
in shares: the amounts that a pair gives to the labels of its ends. In a forward pass every pixel i, in the
grid's order, takes from each pair to an earlier pixel j the largest possible share,

    share_i(x) = min over y of c(x, y) - share_j(y),        theta_i = D_i + sum of the shares at i,

and passes gamma (theta_i - min theta_i) to its pairs to later pixels, with gamma = 1 / the greater number
of pairs to earlier or to later pixels. A backward pass does the same with earlier and later exchanged. After
a pass min (c - shares) is 0 at every pair, and the bound, the sum of min theta_i, has not fallen.

Passes alone are slow on large grids. So before each pair of passes the shares are extrapolated along their
last change, by a factor that grows as in Nesterov's method (Soviet Math. Dokl. 27, 1983) and restarts
where the bound falls (O'Donoghue and Candes, Found. Comput. Math. 15, 2015). This halves the number of
passes, and any shares prove a bound.

The code for one pixel and one pair is models/proof/products.py.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..field.field import CrossField
from ..instance.grid import Floats, Grid
from ..processes.compiled import Crew, compiled
from ..processes.deadline import Over, never
from .clusters import cluster_fronts, clusters_on, extended, least_of_clusters, table_work, update_clusters
from .lattice import Lattice
from .products import all_taken, pair_minimum, pixel_pass
from .slack import quad_slacks
from .state import Clusters, Indices, State

_ALONE: Final = 30_000  # labels up to which sharing a pass takes longer than it saves
_LOST: Final = 0.1  # share of the gap that rounding may cost at most; a fifth of it is usual
_TABLES: Final = 0.25  # of this, the part of the tables, which are few but large
_ROUNDING: Final = 32 * 2.0**-53
"""Relative error of a term: eight numbers, with angles right to four units in the last place, squared."""


class Dual:
    """A dual solution on a lattice: the shares of all pairs, and the bound of the last pass."""

    state: State
    _before: list[NDArray[np.float32]]  # the direction of a change needs no more digits

    def __init__(self, lattice: Lattice, crew: Crew) -> None:
        """Start from zero shares and without clusters."""
        grid = lattice.instance.grid
        self.lattice, self.crew = lattice, crew
        self._pass_seconds = self._table_seconds = 0.0  # of the last pass that was not cut off
        self._fronts = fronts(grid)
        shares = [np.zeros(int(lattice.share_starts(ends)[-1])) for ends in (grid.first, grid.second)]
        self._begin(shares, clusters_on(lattice, np.zeros(0, np.int64)))

    def move(self, lattice: Lattice, shares: Sequence[Floats], clusters: Clusters) -> None:
        """Go on with these shares and clusters on another lattice of the same grid."""
        self._pass_seconds, self._table_seconds = self._seconds_on(lattice)
        self.lattice = lattice
        del self.state  # the new arrays need its memory
        self._begin(shares, clusters)

    def _begin(self, shares: Sequence[Floats], clusters: Clusters) -> None:
        self.state = _state(self.lattice, shares, clusters)
        self._take_clusters()
        self._parts = [self.crew.parts(self.lattice.count[front]) for front in self._fronts]
        self._times, self._reached = 0, -math.inf

    def forward(self, over: Over = never) -> float:
        """The bound after a forward pass."""
        return self._pass(0, over)

    def backward(self, over: Over = never) -> float:
        """The bound after a backward pass."""
        return self._pass(2, over)

    def ascend(self, times: int, over: Over = never, closing: Over = never) -> float:
        """The bound after that many passes forwards and backwards; -inf if time cut a pass off.

        over: returns whether to cut a pass off. closing: returns whether not to begin another two.
        """
        bound = self._reached
        for _ in range(times):
            if closing():
                break
            self._extrapolate()
            self.update_clusters(1)
            self.forward(over)
            self.update_clusters(-1)
            bound = self.backward(over)
            if bound < self._reached:
                self._times = 0
            self._reached = bound
            if over():
                break
        return bound

    def _extrapolate(self) -> None:
        """Move shares and tables along their last change, further the longer the bound has not fallen."""
        part = self._times / (self._times + 3)
        self._times += 1
        state = self.state
        moved = (state.shares_first, state.shares_second, state.clusters.tables)
        if not self._before:
            self._before = [values.astype(np.float32) for values in moved]
            return
        for values, before in zip(moved, self._before, strict=True):
            parts = [(values[at], before[at]) for at in self.crew.equal_parts(len(values))]
            self.crew.run(lambda each: _carry_on(*each, part), parts)

    def add_clusters(self, count: int, field: CrossField) -> None:
        """Add clusters, with zero tables, on the quads that hold most of the gap to the energy of the field.

        Before: a backward pass.
        """
        old = self.state.clusters
        grid = self.lattice.instance.grid
        slack = quad_slacks(self.lattice, self.state, field)
        slack[np.isin(grid.quads[:, 0], old.quads[:, 0])] = np.inf
        quads = np.sort(np.argsort(-slack, kind="stable")[: len(old.quads) + count])
        self.state = self.state._replace(clusters=extended(old, clusters_on(self.lattice, quads)))
        self._take_clusters()

    def _take_clusters(self) -> None:
        self._before = []
        self._cluster_fronts = cluster_fronts(self.lattice.instance.grid, self.state.clusters)
        self._of_clusters = self._least_of_clusters()

    def update_clusters(self, way: int = 1) -> None:
        """Update all clusters; way: -1 for the reverse order."""
        if not len(self._of_clusters):
            return
        began = time.monotonic()
        self._of_clusters[:] = 0.0
        for front in self._cluster_fronts[::way]:
            self.crew.run(
                lambda numbers: update_clusters(numbers, self.state),
                [front[k : k + 1] for k in range(len(front))],
            )
        self._table_seconds = time.monotonic() - began

    def _pass(self, earlier: int, over: Over) -> float:
        def work(pixels: Indices) -> None:
            _pass_pixels(pixels, earlier, self.state)

        began, way = time.monotonic(), 1 if earlier == 0 else -1
        if self.lattice.start[-1] < _ALONE:
            work(np.concatenate(self._fronts[::way]))
        else:
            for front, parts in zip(self._fronts[::way], self._parts[::way], strict=True):
                if over():
                    return -math.inf
                self.crew.run(work, [front[part] for part in parts])
        self._pass_seconds = time.monotonic() - began
        return math.fsum([*self.state.least, *self._of_clusters])

    @property
    def seconds(self) -> float:
        """Expected seconds of a pass and an update of the clusters."""
        return self._pass_seconds + self._table_seconds

    def seconds_on(self, lattice: Lattice) -> float:
        """The same on another lattice, after a pass over this one."""
        return sum(self._seconds_on(lattice))

    def _seconds_on(self, lattice: Lattice) -> tuple[float, float]:
        quads = self.state.clusters.quads
        passes = lattice.work / max(self.lattice.work, 1.0)
        tables = table_work(lattice, quads) / max(table_work(self.lattice, quads), 1.0)
        return self._pass_seconds * passes, self._table_seconds * tables

    def quantise(self, gap: float = 0.0) -> tuple[float, float]:
        """Round shares and tables to whole multiples of two powers of two, and return these.

        Multiples of a greater power take less space in a certificate. gap: of the level's bound, of which
        the rounding costs a small part at most.
        """
        both = (self.state.shares_first, self.state.shares_second, self.state.clusters.tables)
        most = max(*(_most(shares) for shares in both), 2.0**-16)
        least = 2.0 ** (math.ceil(math.log2(most)) - (30 if self.lattice.norm == 2 else 48))
        # Shares and tables, wrong by half a quantum, enter the minima of pixels and pairs, or of clusters.
        wrong = np.array([2 * len(self.state.first), 4 * len(self._of_clusters)])
        lost = _LOST * gap * np.array([1 - _TABLES, _TABLES]) / np.maximum(wrong, 1)
        of_shares, of_tables = (2.0 ** math.floor(math.log2(max(each, least))) for each in lost)
        for values, quantum in zip(both, (of_shares, of_shares, of_tables), strict=True):
            np.multiply(values, 1 / quantum, out=values)
            np.round(values, out=values)
            np.multiply(values, quantum, out=values)
        return of_shares, of_tables

    def bound(self) -> float:
        """The bound that any shares prove, as `LevelRecord` defines it."""
        pixels = self._minima(_pixel_minima, self.lattice.instance.grid.size)
        pairs = self._minima(_pair_minima, len(self.state.first))
        clusters = self._least_of_clusters()
        error = _ROUNDING * (len(pixels) + len(pairs) + len(clusters)) * self._largest()
        return math.fsum([*pixels, *pairs, *clusters, -error])

    def _least_of_clusters(self) -> Floats:
        count = len(self.state.clusters.quads)
        return self._minima(least_of_clusters, count) if count else np.zeros(0)

    def _minima(self, work: Callable[[int, int, State, Floats], None], many: int) -> Floats:
        found = np.zeros(many)
        self.crew.run(
            lambda part: work(part.start, part.stop, self.state, found), self.crew.equal_parts(many)
        )
        return found

    def _largest(self) -> float:
        """An upper limit of every angle's square, cost and sum of shares that enter a bound."""
        state = self.state
        most = max(map(_most, (state.shares_first, state.shares_second, state.clusters.tables)))
        return 64 + _most(state.unary[np.isfinite(state.unary)]) + 4 * most


@compiled
def _carry_on(values: Floats, before: NDArray[np.float32], part: float) -> None:
    """Extrapolate by a part of the change since the previous pass, and store the values as they were."""
    for x in range(values.size):
        now = values[x]
        values[x] = now + part * (now - before[x])
        before[x] = now


def _state(lattice: Lattice, shares: Sequence[Floats], clusters: Clusters) -> State:
    grid = lattice.instance.grid
    unary = lattice.unary_costs()
    start_first, start_second = lattice.share_starts(grid.first), lattice.share_starts(grid.second)
    return State(
        lattice.h,
        lattice.alpha + lattice.h * (lattice.alpha_first + lattice.offset),
        lattice.beta + lattice.h * (lattice.beta_first + lattice.offset),
        lattice.alpha_count,
        lattice.beta_count,
        lattice.start,
        unary,
        grid.first.astype(np.int64),
        grid.second.astype(np.int64),
        lattice.p & 1,
        start_first,
        start_second,
        _around(grid),
        shares[0],
        shares[1],
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


def fronts(grid: Grid) -> list[Indices]:
    """The pixels of each anti-diagonal. No two of one diagonal form a pair; earlier pixels come sooner."""
    diagonal = grid.rows + grid.columns
    order = np.argsort(diagonal, kind="stable")
    _, begin = np.unique(diagonal[order], return_index=True)
    return np.split(order, begin[1:])


def _most(values: Floats) -> float:
    """The greatest size, without an array of all sizes."""
    return float(max(values.max(initial=0.0), -values.min(initial=0.0)))


@compiled
def _pass_pixels(pixels: Indices, earlier: int, state: State) -> None:
    """Do a pass over some pixels, one after the other; earlier: 0 forwards, 2 backwards."""
    for i in pixels:
        pixel_pass(i, earlier, state)


@compiled
def _pair_minima(begin: int, end: int, state: State, found: Floats) -> None:
    """Fill in the least c - shares of some pairs."""
    for pair in range(begin, end):
        found[pair] = pair_minimum(pair, state)


@compiled
def _pixel_minima(begin: int, end: int, state: State, found: Floats) -> None:
    """Fill in the least D + sum of the shares of some pixels."""
    for i in range(begin, end):
        found[i] = all_taken(i, state).min()
