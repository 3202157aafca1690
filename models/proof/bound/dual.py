"""The dual of the local polytope (Schlesinger's linear relaxation), raised by TRW-S.

Kolmogorov, Convergent tree-reweighted message passing for energy minimization, IEEE TPAMI 28 (2006). Its
reparametrisation is written in *shares*, which are the dual variables: the amounts that a pair gives to the
labels of its ends. In a forward pass every pixel i, in the grid's order, takes from each pair to an earlier
pixel j the largest possible share,

    share_i(x) = min over y of c(x, y) - share_j(y),        theta_i = D_i + sum of the shares at i,

and passes gamma (theta_i - min theta_i) to its pairs to later pixels, with gamma = 1 / the greater number
of pairs to earlier or to later pixels. A backward pass does the same with earlier and later exchanged. After
a pass min (c - shares) is 0 at every pair, and the bound, the sum of min theta_i, has not fallen.

The compiled code for one pixel and one pair is passes.py.
"""

from __future__ import annotations

import math
import time
from typing import Final

import numpy as np

from ...array_archive import Arrays
from ...field.field import CrossField
from ...instance.domain import Bools, Floats
from ...instance.grid import Grid
from ...processes.compilation import Crew
from ...processes.deadline import IsOver, never
from ..checkers import check_certificate
from .clusters import (
    copy_tables,
    independent_clusters,
    interpolate_clusters,
    quad_slacks,
    table_work,
    visit_clusters,
    zero_clusters,
)
from .combs import comb_excesses, reparametrised_costs, single_excesses
from .encoding import share_arrays, table_arrays
from .lattice import Lattice, nearest_labels
from .passes import MINIMA, PASS, work_on
from .pruning import (
    RemainingCells,
    allowed_rows,
    corners_of,
    interpolate_shares,
    surviving_cells,
)
from .state import Clusters, Indices, State, state_on

_TOLERANCE: Final = 1e-7  # excess over the energy with which labels still survive, relative to 1 + it
_LOST: Final = 0.3  # share of the gap that rounding may cost at most; a fifth of it is usual
_LOST_TABLES: Final = 0.25  # of this, the part of the tables, which are few but large
_LEVELS: Final = 64  # more than usual; the checker allows for the sides of domains at each
_BEYOND: Final = 1.5  # step of tables before the last update: 29 % more per pass on mouse at 48 pixels;
# the least values of clusters are then not 0, so only the last pass states the bound
_ALONE: Final = 30_000  # labels up to which sharing a pass among threads takes longer than it saves


class Dual:
    """A dual solution on a lattice: the shares of all pairs, and the bound of the last pass.

    A shallow copy stays as it is when the dual moves to another lattice, because a move makes new arrays.
    """

    lattice: Lattice
    state: State

    def __init__(self, lattice: Lattice, crew: Crew) -> None:
        """Start from zero shares and without clusters."""
        self._crew = crew
        grid = lattice.instance.grid
        self._fronts = antidiagonals(grid)
        self._pass_seconds = self._table_seconds = 0.0  # of the last pass that was not cut off
        self._left_by_combs = 1.0
        first, second = (np.zeros(int(lattice.share_starts(ends)[-1])) for ends in (grid.first, grid.second))
        self._start_on(lattice, (first, second), zero_clusters(lattice, np.zeros(0, np.int64)))

    def _start_on(self, lattice: Lattice, shares: tuple[Floats, Floats], clusters: Clusters) -> None:
        self.lattice, self.state = lattice, state_on(lattice, shares, clusters)
        self._parts = [self._crew.parts(lattice.count[front]) for front in self._fronts]
        self._adopt_clusters(clusters)

    def _adopt_clusters(self, clusters: Clusters) -> None:
        self.state = self.state._replace(clusters=clusters)
        self._cluster_fronts = independent_clusters(self.lattice.instance.grid, clusters)
        self._least_of_clusters = self._find_least_of_clusters()

    @property
    def quads(self) -> Indices:
        """The quads with clusters, as in `Grid.quads`."""
        return self.state.clusters.quads

    def move(self, lattice: Lattice) -> None:
        """Go on, with interpolated shares and tables, on a finer or smaller lattice with the same centres."""
        self._pass_seconds, self._table_seconds = self.expected_seconds(lattice)
        old, state = self.lattice, self.state
        shares = interpolate_shares(old, (state.shares_first, state.shares_second), lattice)
        clusters = interpolate_clusters(old, state.clusters, lattice)
        del self.state, state  # the new arrays need its memory
        self._start_on(lattice, shares, clusters)

    def forward(self, is_over: IsOver = never) -> float:
        """The bound after a forward pass; -inf if time cut it off."""
        return self._pass(0, is_over)

    def backward(self, is_over: IsOver = never) -> float:
        """The bound after a backward pass; -inf if time cut it off."""
        return self._pass(2, is_over)

    def ascend(self, times: int, is_over: IsOver = never, closing: IsOver = never) -> float:
        """The bound after that many passes forwards and backwards; -inf if time does not allow all of them.

        is_over: returns whether to cut a pass off. closing: returns whether not to begin another two.
        """
        bound = -math.inf
        for left in reversed(range(times)):
            if closing():
                if left + 1 < times:  # tables went too far on purpose
                    self.update_clusters(-1)
                return -math.inf
            self.update_clusters(1, _BEYOND)
            self.forward(is_over)
            self.update_clusters(-1, _BEYOND if left else 1.0)
            bound = self.backward(is_over)
            if is_over():
                return -math.inf if left else bound
        return bound

    def _pass(self, earlier: int, is_over: IsOver) -> float:
        """The bound after a pass; earlier: 0 forwards, 2 backwards."""
        began, way, nothing = time.monotonic(), 1 if earlier == 0 else -1, np.zeros(0)

        def visit(pixels: Indices) -> None:
            work_on(PASS, pixels, earlier, self.state, nothing, nothing)

        if self.lattice.start[-1] < _ALONE:
            visit(np.concatenate(self._fronts[::way]))
        else:
            for front, parts in zip(self._fronts[::way], self._parts[::way], strict=True):
                if is_over():
                    return -math.inf
                self._crew.run(visit, [front[part] for part in parts])
        self._pass_seconds = time.monotonic() - began
        return math.fsum([*self.state.least, *self._least_of_clusters])

    @property
    def _values(self) -> tuple[Floats, Floats, Floats]:
        return (self.state.shares_first, self.state.shares_second, self.state.clusters.tables)

    def add_clusters(self, count: int, field: CrossField) -> None:
        """Add clusters, with zero tables, on the quads that hold most of the gap to the energy of the field.

        Before: a backward pass.
        """
        alpha, beta, _ = nearest_labels(field, self.lattice)
        quads = self.lattice.instance.grid.quads
        slack = quad_slacks(self.lattice, self.state, (alpha, beta))
        slack[np.isin(quads[:, 0], self.quads[:, 0])] = np.inf
        numbers = np.sort(np.argsort(-slack, kind="stable")[: len(self.quads) + count])
        self._adopt_clusters(copy_tables(self.state.clusters, zero_clusters(self.lattice, numbers)))

    def update_clusters(self, way: int = 1, step: float = 1.0) -> None:
        """Update all clusters; way: -1 for the reverse order. step: as of `visit_clusters`."""
        if not len(self.quads):
            return
        began = time.monotonic()
        self._least_of_clusters = np.zeros(len(self.quads))
        for front in self._cluster_fronts[::way]:
            self._crew.run(
                lambda numbers: visit_clusters(numbers, self.state, step, self._least_of_clusters),
                [front[k : k + 1] for k in range(len(front))],
            )
        self._table_seconds = time.monotonic() - began

    def _find_least_of_clusters(self) -> Floats:
        """The least of the negative tables of each cluster."""
        least, numbers = np.zeros(len(self.quads)), np.arange(len(self.quads))
        self._crew.run(
            lambda part: visit_clusters(numbers[part], self.state, 0.0, least),
            self._crew.equal_parts(len(least)),
        )
        return least

    def expected_seconds(self, lattice: Lattice) -> tuple[float, float]:
        """Expected seconds of a pass, and of an update of the clusters, estimated from the last ones here."""
        passes = lattice.pass_work / max(self.lattice.pass_work, 1.0)
        tables = table_work(lattice, self.quads) / max(table_work(self.lattice, self.quads), 1.0)
        return self._pass_seconds * passes, self._table_seconds * tables

    def quantise(self, gap: float = 0.0) -> tuple[float, float]:
        """Round shares and tables to whole multiples of two powers of two, and return these.

        Multiples of a greater power take less space in a certificate. gap: of the level's bound, of which
        the rounding costs a small part at most.
        """
        most = max(self._greatest_sizes()[0], 2.0**-16)
        least = 2.0 ** (math.ceil(math.log2(most)) - 30)
        # Shares and tables, wrong by half a quantum, enter the minima of pixels and pairs, or of clusters.
        wrong = np.array([2 * len(self.lattice.p), 4 * len(self.quads)])
        lost = _LOST * gap * np.array([1 - _LOST_TABLES, _LOST_TABLES]) / np.maximum(wrong, 1)
        of_shares, of_tables = (
            min(2.0 ** math.floor(math.log2(max(most_lost, least))), check_certificate.MOST_UNIT)
            for most_lost in lost
        )
        for values, quantum in zip(self._values, (of_shares, of_shares, of_tables), strict=True):
            np.multiply(values, 1 / quantum, out=values)
            np.round(values, out=values)
            np.multiply(values, quantum, out=values)
        return of_shares, of_tables

    def _greatest_sizes(self) -> tuple[float, float]:
        """The greatest size of a share or a number of a table, and of a finite cost of a pixel."""
        unary = self.state.unary
        return max(map(_greatest_size, self._values)), _greatest_size(unary[np.isfinite(unary)])

    def bound(self) -> float:
        """The bound that any shares prove, minus a bound of its rounding error.

        It is the sum over pixels of min (D + shares), over pairs of min (c + tables - shares), and over
        clusters of min (- tables), each over the allowed labels.
        """
        pairs, numbers = np.zeros(len(self.lattice.p)), np.arange(len(self.lattice.p))
        self._crew.run(
            lambda part: work_on(MINIMA, numbers[part], 0, self.state, pairs, pairs),
            self._crew.equal_parts(len(pairs)),
        )
        theta = reparametrised_costs(self.state, self._crew)
        pixels = np.minimum.reduceat(theta, self.lattice.start[:-1])
        return math.fsum([*pixels, *pairs, *self._find_least_of_clusters(), -self._rounding_margins()[0]])

    def _rounding_margins(self) -> tuple[float, float]:
        """Margin that the checker takes off the bound of a pass, and adds to the energy for combs.

        It is more than this process rounds. See `ForwardPass` in models/proof/checkers/check_certificate.py.
        """
        lattice, (shares, costs) = self.lattice, self._greatest_sizes()
        instance, n, m = lattice.instance, len(lattice.count), len(lattice.p)
        weight, skew = instance.point_weight, instance.skew_coefficient
        size = 2 + np.abs([lattice.alpha, lattice.beta]).sum(axis=0)
        size += lattice.h * np.abs(lattice.alpha_first) + lattice.h * lattice.alpha_count
        size += lattice.h * np.abs(lattice.beta_first) + lattice.h * lattice.beta_count
        pixels = float(np.sum((weight + skew) * size * size)) + 4 * n * shares
        pair = (3 + 4 * float(size.max())) ** 2 + costs + 4 * shares  # angles and jumps, tables, excesses
        unit = 2 * check_certificate.ROUNDING * check_certificate.PRECISION
        sides = check_certificate.sliver_slack(weight, skew, _LEVELS)
        return unit * (2 * pixels + m * pair) + sides, 4 * unit * m * pair

    def remaining_cells(self, bound: float, energy: float, *, combs: bool = True) -> RemainingCells:
        """The cells that the level leaves below an energy, by a forward pass and, if asked for, combs.

        See models/proof/bound/pruning.py.
        """
        self.forward()
        excess = self._excess(bound, energy)
        cells = self._cells_of_pass(excess)
        left = RemainingCells(self.lattice, cells)
        single = single_excesses(self.state, self._crew) if combs else None
        for columns in (True, False):
            if single is not None and not left.is_empty:
                state = self._state_at(corners_of(self.lattice, left.cells))
                survives = comb_excesses(state, single, self._crew, columns=columns) <= excess
                left = RemainingCells(self.lattice, left.cells & surviving_cells(self.lattice, survives))
                self._left_by_combs = int(left.cells.sum()) / int(cells.sum())
        return left

    def _state_at(self, labels: Bools) -> State:
        """The state with these labels alone."""
        _, begin, end = allowed_rows(self.lattice, labels)
        return self.state._replace(begin=begin, end=end, unary=np.where(labels, self.state.unary, np.inf))

    def count_left(self, bound: float, energy: float) -> int:
        """The number of cells that the last pass leaves, times the share that combs left the last time."""
        return round(self._left_by_combs * np.count_nonzero(self._cells_of_pass(self._excess(bound, energy))))

    def _cells_of_pass(self, excess: float) -> Bools:
        """The cells where a vertex's theta exceeds the least by at most `excess`, flat."""
        state = self.state
        return surviving_cells(
            self.lattice, state.theta <= np.repeat(state.least + excess, self.lattice.count)
        )

    def _excess(self, bound: float, energy: float) -> float:
        """The excess over a bound up to which labels survive."""
        return energy + _TOLERANCE * (1 + energy) + self._rounding_margins()[1] - bound

    def arrays(self, quanta: tuple[float, float]) -> Arrays:
        """The arrays of the level in a certificate, after `quantise`."""
        lattice, (of_shares, of_tables) = self.lattice, quanta
        ranges = (lattice.alpha_first, lattice.alpha_count, lattice.beta_first, lattice.beta_count)
        return {
            "h": np.array([lattice.h]),
            "ranges": np.stack(ranges, axis=1).astype(np.int32),
            "allowed": np.packbits(lattice.allowed),
            **share_arrays(lattice, (self.state.shares_first, self.state.shares_second), of_shares),
            **table_arrays(lattice, self.state.clusters, of_tables),
        }


def antidiagonals(grid: Grid) -> list[Indices]:
    """The pixels of each anti-diagonal. No two of one diagonal form a pair; earlier pixels come sooner."""
    diagonal = grid.rows + grid.columns
    order = np.argsort(diagonal, kind="stable")
    _, begin = np.unique(diagonal[order], return_index=True)
    return np.split(order, begin[1:])


def _greatest_size(values: Floats) -> float:
    """The greatest size, without an array of all sizes."""
    return float(max(values.max(initial=0.0), -values.min(initial=0.0)))
