"""The state of a strip, some rows of a lattice, and the work on it; see models/proof/dual.py.

A strip has the labels of its own pixels and of the rows above and below. Passes change the shares of its own
pixels only. So that its pairs to other strips have the shares of both ends, it receives those of the other
ends from the strips beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..array_archive import Arrays
from ..instance.grid import Bools, Floats, Grid
from ..processes.compiled import Crew, compiled
from ..processes.deadline import Over, never
from .clusters import (
    cluster_fronts,
    clusters_on,
    extended,
    least_of_clusters,
    prolonged_clusters,
    update_clusters,
)
from .combs import Combs
from .decoding import Crosses, decode
from .encoding import messages_of, tables_of
from .lattice import Lattice, Starts
from .products import all_taken, ends_of, pair_minimum, pixel_pass, share_of
from .pruning import cells_left, prolonged_shares, rows_of
from .slack import quad_slacks
from .state import Clusters, Ends, Indices, State

Singles = NDArray[np.float32]

_ALONE: Final = 30_000  # labels up to which sharing a pass takes longer than it saves


class Part(NamedTuple):
    """A strip's part of a lattice: the lattice without labels elsewhere, and the strip's own pixels."""

    lattice: Lattice
    own: slice


class Passed(NamedTuple):
    """Result of a pass: the least theta of each own pixel, and the shares for the strips above and below."""

    least: Floats
    above: Floats
    below: Floats


def part_of(lattice: Lattice, own: slice) -> Part:
    """The part of a lattice for a strip with those pixels, which are whole rows."""
    grid, count = lattice.instance.grid, len(lattice.count)
    if own == slice(0, count):
        return Part(lattice, own)
    rows = grid.rows[own.start] - 1, grid.rows[own.stop - 1] + 2
    begin, end = np.searchsorted(grid.rows, rows)
    inside = np.zeros(count, dtype=np.int32)
    inside[begin:end] = 1
    labels = slice(lattice.start[begin], lattice.start[end])
    return Part(
        replace(
            lattice,
            alpha_count=lattice.alpha_count * inside,
            beta_count=lattice.beta_count * inside,
            allowed=lattice.allowed[labels],
        ),
        own,
    )


class Strip:
    """The shares on a strip, zero and without clusters at first."""

    state: State
    _before: list[Singles]  # the direction of a change needs no more digits
    _combs: Combs

    def __init__(self, part: Part, crew: Crew) -> None:
        """Start on a part of a lattice, with the threads of a crew."""
        self._saved: dict[int, dict[str, Any]] = {}
        self.lattice, self.own, self.crew = part.lattice, part.own, crew
        grid = self.lattice.instance.grid
        mine = np.zeros(grid.size, dtype=bool)
        mine[self.own] = True
        self.pairs = slice(*np.searchsorted(grid.first, [self.own.start, self.own.stop]).tolist())
        # Pairs to the strips above and below: the first pixel of a pair is the lower one.
        above = np.flatnonzero(mine[grid.first] & ~mine[grid.second])
        below = np.flatnonzero(~mine[grid.first] & mine[grid.second])
        self._crossing = (above, below)
        self._fronts = [front[mine[front]] for front in fronts(grid)]
        shares = [np.zeros(int(self.lattice.share_starts(ends)[-1])) for ends in (grid.first, grid.second)]
        self._begin(shares, clusters_on(self.lattice, np.zeros(0, np.int64)))

    def _begin(self, shares: Sequence[Floats], clusters: Clusters) -> None:
        self.state = _state(self.lattice, shares, clusters)
        self._find_edges()
        self._take_clusters()
        self._parts = [self.crew.parts(self.lattice.count[front]) for front in self._fronts]

    def move(self, lattice: Lattice) -> None:
        """Interpolate shares and tables to a finer or smaller lattice with the same centres."""
        self._before = []  # first of all, for memory
        old, state = self.lattice, self.state
        shares = prolonged_shares(old, state, lattice)
        clusters = prolonged_clusters(old, state.clusters, lattice)
        self.lattice = lattice
        del self.state, state  # the new arrays need its memory
        self._begin(shares, clusters)

    def save(self, name: int) -> None:
        """Keep the present state under a name. Moves to other lattices leave its arrays as they are."""
        self._saved[name] = {key: value for key, value in vars(self).items() if key != "_saved"}

    def restore(self, name: int, *, last: bool) -> None:
        """Return to the state under a name, which is forgotten if it is the last time."""
        vars(self).update(self._saved.pop(name) if last else self._saved[name])

    def _find_edges(self) -> None:
        """Find the places of shares of the pairs above and below: at the own ends, and at the others."""
        (above, below), state = self._crossing, self.state
        self._mine = _places(state.start_first, above), _places(state.start_second, below)
        self._theirs = _places(state.start_second, above), _places(state.start_first, below)

    def take(self, edge: Floats, *, above: bool) -> None:
        """Receive the shares at the other ends of the pairs to the strip above or below."""
        upper, lower = self._theirs
        if above:
            self.state.shares_second[upper] = edge
        else:
            self.state.shares_first[lower] = edge

    def sweep(self, earlier: int, over: Over = never) -> Passed | None:
        """Do a pass over the own pixels; earlier: 0 forwards, 2 backwards. None if time cuts it off."""

        def work(pixels: Indices) -> None:
            _pass_pixels(pixels, earlier, self.state)

        way = 1 if earlier == 0 else -1
        if self.lattice.start[-1] < _ALONE:
            work(np.concatenate(self._fronts[::way]))
        else:
            for front, parts in zip(self._fronts[::way], self._parts[::way], strict=True):
                if over():
                    return None
                self.crew.run(work, [front[part] for part in parts])
        (upper, lower), state = self._mine, self.state
        return Passed(state.least[self.own], state.shares_first[upper], state.shares_second[lower])

    def extrapolate(self, part: float) -> None:
        """Move shares and tables by a part of their last change, which the first call begins to follow."""
        moved = self._values
        if not self._before:
            self._before = [values.astype(np.float32) for values in moved]
            return
        first, second, was = self._before
        tables, state = self.state.clusters.tables, self.state
        self.crew.run(
            lambda pairs: _carry_shares(pairs, state, (first, second), part),
            [(at.start, at.stop) for at in self.crew.equal_parts(len(state.first))],
        )
        self.crew.run(lambda at: _carry_on(tables[at], was[at], part), self.crew.equal_parts(len(tables)))

    @property
    def _values(self) -> tuple[Floats, Floats, Floats]:
        return (self.state.shares_first, self.state.shares_second, self.state.clusters.tables)

    def inside(self) -> Bools:
        """Whether each quad of the grid is of own pixels alone."""
        grid = self.lattice.instance.grid
        bottom, _, top, _ = grid.quads.T
        found: Bools = (grid.first[top] >= self.own.start) & (grid.second[bottom] < self.own.stop)
        return found

    def slacks(self, alpha: Floats, beta: Floats) -> Floats:
        """The slacks of own quads as `quad_slacks` has them; 0 for others."""
        slack = quad_slacks(self.lattice, self.state, (alpha, beta), self.own)
        return np.where(self.inside(), slack, 0.0)

    def add_clusters(self, quads: Indices) -> Floats:
        """Have clusters on those quads of own pixels, new ones with zero tables; the least of each."""
        added = clusters_on(self.lattice, quads)
        self.state = self.state._replace(clusters=extended(self.state.clusters, added))
        self._take_clusters()
        return self.least_of_clusters()

    def _take_clusters(self) -> None:
        self._before = []
        self._cluster_fronts = cluster_fronts(self.lattice.instance.grid, self.state.clusters)

    def update_clusters(self, way: int) -> None:
        """Update all clusters; way: -1 for the reverse order."""
        for front in self._cluster_fronts[::way]:
            self.crew.run(
                lambda numbers: update_clusters(numbers, self.state),
                [front[k : k + 1] for k in range(len(front))],
            )

    def least_of_clusters(self) -> Floats:
        """The least of the negative tables of each cluster."""
        count = len(self.state.clusters.quads)
        if not count:
            return np.zeros(0)
        found = np.zeros(count)
        self.crew.run(
            lambda part: least_of_clusters(part.start, part.stop, self.state, found),
            self.crew.equal_parts(count),
        )
        return found

    def greatest(self) -> tuple[float, float]:
        """The greatest size of a share or a number of a table, and of a finite cost of a pixel."""
        unary = self.state.unary
        return max(map(_most, self._values)), _most(unary[np.isfinite(unary)])

    def quantise(self, of_shares: float, of_tables: float) -> None:
        """Round shares and tables to whole multiples of these powers of two, and forget their change."""
        self._before = []  # a level is recorded next, which takes memory
        for values, quantum in zip(self._values, (of_shares, of_shares, of_tables), strict=True):
            np.multiply(values, 1 / quantum, out=values)
            np.round(values, out=values)
            np.multiply(values, quantum, out=values)

    def minima(self) -> list[Floats]:
        """The least D + shares of own pixels, the least c - shares of own pairs, and those of clusters."""
        pixels, pairs = np.zeros(len(self.lattice.count)), np.zeros(len(self.state.first))
        for work, found, own in ((_pixel_minima, pixels, self.own), (_pair_minima, pairs, self.pairs)):
            many = self.crew.equal_parts(own.stop - own.start)
            parts = [slice(own.start + part.start, own.start + part.stop) for part in many]
            self.crew.run(lambda part: work(part.start, part.stop, self.state, found), parts)  # noqa: B023
        return [pixels[self.own], pairs[self.pairs], self.least_of_clusters()]

    def cells(self, excess: float) -> Bools:
        """The cells of own pixels where a vertex's theta exceeds the least by at most `excess`, flat."""
        return self._cells(self.state.theta <= np.repeat(self.state.least + excess, self.lattice.count))

    def cells_by_comb(self, excess: float) -> Bools:
        """The cells of own pixels where a vertex's excess on the comb is at most `excess`, flat."""
        return self._cells(self._combs.excesses <= excess)

    def _cells(self, survives: Bools) -> Bools:
        begin, end = self.lattice.start[[self.own.start, self.own.stop]]
        return cells_left(self.lattice, survives)[begin:end]

    def begin_combs(self) -> None:
        """Find the excesses of single pixels, after a forward pass."""
        self._combs = Combs(self.state, self.own, self.crew)

    def turn_comb(self, *, first: bool) -> None:
        """Start to follow pairs of another direction, as `Combs.turn`."""
        self._combs.turn(first=first)

    def follow_comb(self, edge: Floats, *, column: bool, back: bool) -> Floats:
        """Follow the comb, as `Combs.follow`."""
        return self._combs.follow(edge, column=column, back=back)

    def forget_combs(self) -> None:
        """Release the memory of combs."""
        del self._combs

    def decoded(self, crosses: Crosses, *, forwards: bool) -> Crosses:
        """The crosses with those of the own pixels replaced by what the shares suggest."""
        order = np.arange(self.own.start, self.own.stop)[:: 1 if forwards else -1].copy()
        return decode(order, self.state, crosses)

    def arrays(self, of_shares: float, of_tables: float) -> tuple[Arrays, Arrays]:
        """Messages of the own pairs, and tables, as whole numbers of their scales."""
        shares = self.state.shares_first, self.state.shares_second
        messages = messages_of(self.lattice, shares, of_shares, self.pairs)
        return messages, tables_of(self.lattice, self.state.clusters, of_tables)


def _places(starts: Starts, pairs: Starts) -> Starts:
    """The places of the shares of some pairs."""
    return np.concatenate([np.zeros(0, np.int64), *(np.arange(starts[e], starts[e + 1]) for e in pairs)])


@compiled
def _carry_shares(pairs: tuple[int, int], state: State, before: tuple[Singles, Singles], part: float) -> None:
    """Extrapolate the shares of consecutive pairs. before: those at their first and their second pixels."""
    for pair in range(pairs[0], pairs[1]):
        i, j = state.first[pair], state.second[pair]
        was = before[0][state.start_first[pair] : state.start_first[pair + 1]]
        _carry_used(share_of(pair, i, state), was, ends_of(i, state), state.beta_count[i], part)
        was = before[1][state.start_second[pair] : state.start_second[pair + 1]]
        _carry_used(share_of(pair, j, state), was, ends_of(j, state), state.beta_count[j], part)


@compiled
def _carry_used(values: Floats, before: Singles, ends: Ends, columns: int, part: float) -> None:
    """Extrapolate the used part of the shares of a pair at one pixel."""
    for row in range(ends[0].size):
        begin, end = row * columns + ends[0][row], row * columns + ends[1][row]
        _carry_on(values[begin:end], before[begin:end], part)


@compiled
def _carry_on(values: Floats, before: Singles, part: float) -> None:
    """Extrapolate numbers by a part of their last change, and store them as they were."""
    for x in range(values.size):
        now = values[x]
        values[x] = now + part * (now - before[x])
        before[x] = now


def _state(lattice: Lattice, shares: Sequence[Floats], clusters: Clusters) -> State:
    grid = lattice.instance.grid
    unary = lattice.unary_costs()
    row_start, begin, end = rows_of(lattice)
    start_first, start_second = lattice.share_starts(grid.first), lattice.share_starts(grid.second)
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
