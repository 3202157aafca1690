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
from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..field.field import CrossField
from ..instance.grid import Floats, Grid
from ..processes.compiled import Crew, compiled
from ..processes.deadline import Over, never
from .clusters import cluster_fronts, clusters_on, extended, least_of_clusters, update_clusters
from .lattice import Lattice
from .products import add, pair_minimum, pixel_pass, share_of
from .slack import quad_slacks
from .state import Clusters, Indices, State

_ALONE: Final = 30_000  # labels up to which sharing a pass takes longer than it saves
_LOST: Final = 0.1  # share of the gap that rounding shares may cost at most; a fifth of it is usual
_ROUNDING: Final = 32 * 2.0**-53
"""Relative error of a term: eight numbers, with angles right to four units in the last place, squared."""


class Dual:
    """A dual solution on a lattice: the shares of all pairs, and the bound of the last pass."""

    def __init__(
        self,
        lattice: Lattice,
        crew: Crew,
        shares: tuple[Floats, Floats] | None = None,
        clusters: Clusters | None = None,
    ) -> None:
        """Start from zero shares and without clusters, or from the given ones."""
        self.lattice, self.crew = lattice, crew
        self.state = _state(lattice, shares, clusters)
        self._before: list[NDArray[np.float32]]  # the direction of a change needs no more digits
        self._take_clusters()
        self._fronts = fronts(lattice.instance.grid)
        self._parts = [crew.parts(lattice.count[front]) for front in self._fronts]
        self._times, self._reached = 0, -math.inf
        self.seconds = 0.0  # of the last pass that was not cut off

    def forward(self, over: Over = never) -> float:
        """The bound after a forward pass."""
        return self._pass(0, over)

    def backward(self, over: Over = never) -> float:
        """The bound after a backward pass."""
        return self._pass(2, over)

    def ascend(self, times: int, over: Over = never) -> float:
        """The bound after that many passes forwards and backwards; -inf if time cut a pass off."""
        bound = -math.inf
        for _ in range(times):
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
        self._of_clusters[:] = 0.0
        for front in self._cluster_fronts[::way]:
            parts = [front[part] for part in self.crew.equal_parts(len(front))]
            self.crew.run(lambda numbers: update_clusters(numbers, self.state), parts)

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
        self.seconds = time.monotonic() - began
        return math.fsum([*self.state.least, *self._of_clusters])

    def seconds_on(self, lattice: Lattice) -> float:
        """Expected seconds of a pass over another lattice, after one over this one."""
        return self.seconds * lattice.work / max(self.lattice.work, 1.0)

    def quantise(self, gap: float = 0.0) -> float:
        """Round the shares to whole multiples of a power of two, and return it; see `LevelRecord`.

        Multiples of a greater power take less space in a certificate. gap: of the level's bound, of which
        the rounding costs a small part at most.
        """
        both = (self.state.shares_first, self.state.shares_second, self.state.clusters.tables)
        most = max(*(_most(shares) for shares in both), 2.0**-16)
        least = 2.0 ** (math.ceil(math.log2(most)) - (30 if self.lattice.norm == 2 else 48))
        # Shares and tables, wrong by half a quantum, enter the minima of pixels and pairs, or of clusters.
        wrong = 2 * len(self.state.first) + 4 * len(self._of_clusters)
        quantum = 2.0 ** math.floor(math.log2(max(_LOST * gap / max(wrong, 1), least)))
        for shares in both:
            np.round(shares / quantum, out=shares)
            np.multiply(shares, quantum, out=shares)
        return quantum

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


def _state(lattice: Lattice, shares: tuple[Floats, Floats] | None, clusters: Clusters | None) -> State:
    grid = lattice.instance.grid
    unary = lattice.unary_costs()
    start_first, start_second = lattice.share_starts(grid.first), lattice.share_starts(grid.second)
    first, second = shares or (np.zeros(start_first[-1]), np.zeros(start_second[-1]))
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
        first,
        second,
        unary.copy(),
        np.zeros(grid.size),
        2 if lattice.norm == 2 else 1,
        clusters_on(lattice, np.zeros(0, np.int64)) if clusters is None else clusters,
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
    return float(np.abs(values).max(initial=0.0))


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
        theta = state.unary[state.start[i] : state.start[i + 1]].copy()
        for pair in state.around[i]:
            if pair >= 0:
                add(theta, share_of(pair, i, state))
        found[i] = theta.min()
