"""The dual of the local polytope, by TRW-S.

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

The work is divided into strips of rows: one, or those on the workers of a cluster (models/proof/workers.py).
A pass takes one strip after the other, so the numbers are the same for any strips. Only clusters differ: a
quad of two strips gets none. The code for a strip is models/proof/strip.py, that for one pixel and one pair
models/proof/products.py.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any, Final, Protocol

import numpy as np

from ..array_archive import Arrays
from ..field.field import CrossField
from ..instance.angles import QUARTER
from ..instance.grid import Floats
from ..processes.compiled import Crew
from ..processes.deadline import Over, never
from ..smooth.systems import stroke_weight
from . import check_certificate
from .clusters import table_work
from .decoding import Crosses
from .lattice import Lattice, labels_at
from .pruning import RemainingCells, boxed
from .strip import Passed, Strip, part_of

_TOLERANCE: Final = 1e-7  # excess over the energy with which labels still survive, relative to 1 + it
_LOST: Final = 0.1  # share of the gap that rounding may cost at most; a fifth of it is usual
_TABLES: Final = 0.25  # of this, the part of the tables, which are few but large
_LEVELS: Final = 64  # more than usual; the checker allows for the sides of domains at each

_KEPT: Final = ("places", "_saved")  # attributes that stay the same when a dual returns to a former state

Answer = Callable[[], Any]
"""Waits for the result of a call, and returns it."""


class Place(Protocol):
    """A strip, here or elsewhere."""

    pixels: slice
    """The strip's pixels."""

    def ask(self, name: str, *arguments: Any, **named: Any) -> Answer:
        """Call a method of the strip."""

    def sweep(self, earlier: int, over: Over) -> Passed | None:
        """Do a pass, as `Strip.sweep`."""


Divide = Callable[[Lattice], list[Place]]
"""Divides a lattice into strips that begin with zero shares, from the top to the bottom."""


class Here:
    """A strip in this process."""

    def __init__(self, strip: Strip) -> None:
        self.strip, self.pixels = strip, strip.own

    def ask(self, name: str, *arguments: Any, **named: Any) -> Answer:
        """Call a method of the strip."""
        found = getattr(self.strip, name)(*arguments, **named)
        return lambda: found

    def sweep(self, earlier: int, over: Over) -> Passed | None:
        """Do a pass."""
        return self.strip.sweep(earlier, over)


class Dual:
    """A dual solution on a lattice: the shares of all pairs, and the bound of the last pass."""

    def __init__(self, lattice: Lattice, crew: Crew, divide: Divide | None = None) -> None:
        """Start from zero shares and without clusters. divide: None for one strip with the crew's threads."""
        self.lattice = lattice
        self._saved: dict[int, dict[str, Any]] = {}
        whole = slice(0, len(lattice.count))
        self.places = divide(lattice) if divide else [Here(Strip(part_of(lattice, whole), crew))]
        self.quads = np.zeros((0, 4), np.int64)  # those with clusters, as in `Grid.quads`
        self._pass_seconds = self._table_seconds = 0.0  # of the last pass that was not cut off
        self._least_of_clusters = np.zeros(0)
        self._times, self._reached = 0, -math.inf
        self._left_by_combs = 1.0

    def save(self, name: int) -> None:
        """Keep what the dual is now under a name, until `restore` asks for it the last time."""
        self._all("save", name)
        self._saved[name] = {key: value for key, value in vars(self).items() if key not in _KEPT}

    def restore(self, name: int, *, last: bool) -> None:
        """Return to what was kept under a name."""
        self._all("restore", name, last=last)
        vars(self).update(self._saved.pop(name) if last else self._saved[name])

    def _all(self, name: str, *arguments: Any, **named: Any) -> list[Any]:
        """The results of all strips."""
        return [answer() for answer in [place.ask(name, *arguments, **named) for place in self.places]]

    def move(self, lattice: Lattice) -> None:
        """Go on, with interpolated shares and tables, on a finer or smaller lattice with the same centres."""
        self._pass_seconds, self._table_seconds = self.seconds_on(lattice)
        self.lattice = lattice
        asked = [place.ask("move", part_of(lattice, place.pixels).lattice) for place in self.places]
        for answer in asked:
            answer()
        self._least_of_clusters = np.concatenate(self._all("least_of_clusters"))
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
        self._all("extrapolate", self._times / (self._times + 3))
        self._times += 1

    def add_clusters(self, count: int, field: CrossField) -> None:
        """Add clusters, with zero tables, on the quads that hold most of the gap to the energy of the field.

        Before: a backward pass.
        """
        alpha, beta, _ = labels_at(field, self.lattice)
        quads = self.lattice.instance.grid.quads
        slack = np.sum(self._all("slacks", alpha, beta), axis=0)
        slack[np.isin(quads[:, 0], self.quads[:, 0])] = np.inf
        numbers = np.sort(np.argsort(-slack, kind="stable")[: len(self.quads) + count])
        asked = [(place, place.ask("inside")) for place in self.places]
        of_strips = [(place, numbers[answer()[numbers]]) for place, answer in asked]
        answers = [place.ask("add_clusters", some) for place, some in of_strips]
        self._least_of_clusters = np.concatenate([answer() for answer in answers])
        self.quads = quads[np.concatenate([some for _, some in of_strips])].astype(np.int64)

    def update_clusters(self, way: int = 1) -> None:
        """Update all clusters; way: -1 for the reverse order."""
        if not len(self.quads):
            return
        began = time.monotonic()
        self._least_of_clusters[:] = 0.0
        self._all("update_clusters", way)
        self._table_seconds = time.monotonic() - began

    def _pass(self, earlier: int, over: Over) -> float:
        began, least = time.monotonic(), []
        numbers = range(len(self.places))[:: 1 if earlier == 0 else -1]
        for number in numbers:
            passed = self.places[number].sweep(earlier, over)
            if passed is None:
                return -math.inf
            least.append(passed.least)
            beside = ((number - 1, passed.above, False), (number + 1, passed.below, True))
            for answer in [
                self.places[each].ask("take", shares, above=above)
                for each, shares, above in beside
                if 0 <= each < len(self.places)
            ]:
                answer()
        self._pass_seconds = time.monotonic() - began
        return math.fsum([*np.concatenate(least), *self._least_of_clusters])

    def seconds_on(self, lattice: Lattice) -> tuple[float, float]:
        """Expected seconds of a pass, and of an update of the clusters, estimated from the last ones here."""
        passes = lattice.pass_work / max(self.lattice.pass_work, 1.0)
        tables = table_work(lattice, self.quads) / max(table_work(self.lattice, self.quads), 1.0)
        return self._pass_seconds * passes, self._table_seconds * tables

    def quantise(self, gap: float = 0.0) -> tuple[float, float]:
        """Round shares and tables to whole multiples of two powers of two, and return these.

        Multiples of a greater power take less space in a certificate. gap: of the level's bound, of which
        the rounding costs a small part at most.
        """
        most = max(self._greatest()[0], 2.0**-16)
        least = 2.0 ** (math.ceil(math.log2(most)) - (30 if self.lattice.norm == 2 else 48))
        # Shares and tables, wrong by half a quantum, enter the minima of pixels and pairs, or of clusters.
        wrong = np.array([2 * len(self.lattice.p), 4 * len(self._least_of_clusters)])
        lost = _LOST * gap * np.array([1 - _TABLES, _TABLES]) / np.maximum(wrong, 1)
        of_shares, of_tables = (
            min(2.0 ** math.floor(math.log2(max(each, least))), check_certificate.MOST_SCALE) for each in lost
        )
        self._all("quantise", of_shares, of_tables)
        return of_shares, of_tables

    def _greatest(self) -> tuple[float, float]:
        """The greatest size of a share or a number of a table, and of a cost of a pixel."""
        shares, costs = zip(*self._all("greatest"), strict=True)
        return max(shares), max(costs)

    def bound(self) -> float:
        """The bound that any shares prove, as `LevelRecord` defines it."""
        terms = np.concatenate([each for minima in self._all("minima") for each in minima])
        return math.fsum([*terms, -self._roundings()[0]])

    def _roundings(self) -> tuple[float, float]:
        """Margin that the checker takes off the bound of a pass, and adds to the energy for combs.

        It is more than this process rounds. See models/proof/check_certificate.py, 6 and `Pass`.
        """
        lattice, (shares, costs) = self.lattice, self._greatest()
        instance, n, m = lattice.instance, len(lattice.count), len(lattice.p)
        weight, skew = stroke_weight(instance), instance.skew_coefficient
        size = 2 + np.abs([lattice.alpha, lattice.beta]).sum(axis=0)
        size += lattice.h * np.abs(lattice.alpha_first) + lattice.h * lattice.alpha_count
        size += lattice.h * np.abs(lattice.beta_first) + lattice.h * lattice.beta_count
        pixels = float(np.sum((weight + skew) * size * size)) + 4 * n * shares
        pair = (
            (3 + 4 * float(size.max())) ** 2 + costs + 4 * shares
        )  # angles and jumps, squared; tables; excesses
        unit = 2 * check_certificate.ROUNDING * check_certificate.PRECISION
        sides = check_certificate.slack_of(weight, skew, _LEVELS)
        return unit * (2 * pixels + m * pair) + sides, 4 * unit * m * pair

    def remaining_cells(self, bound: float, energy: float) -> RemainingCells:
        """The cells that the level leaves below an energy, by a forward pass; see models/proof/pruning.py."""
        self.forward()
        excess = self._excess(bound, energy)
        cells = np.concatenate(self._all("cells", excess))
        before = max(int(np.count_nonzero(cells)), 1)
        self._all("begin_combs")
        for teeth_are_columns in (True, False):
            for first in (True, False):
                self._all("turn_comb", first=first)
                column = first == teeth_are_columns
                for back in (False, True):
                    self._follow_combs(column=column, back=back)
            cells &= np.concatenate(self._all("cells_by_comb", excess))
        self._all("forget_combs")
        self._left_by_combs = int(np.count_nonzero(cells)) / before
        return boxed(self.lattice, cells)

    def _follow_combs(self, *, column: bool, back: bool) -> None:
        edge = np.zeros(0)
        for place in self.places[:: -1 if back else 1]:
            edge = place.ask("follow_comb", edge, column=column, back=back)()

    def count_left(self, bound: float, energy: float) -> int:
        """The number of cells that the last pass leaves, times the share that combs left the last time."""
        left = sum(map(np.count_nonzero, self._all("cells", self._excess(bound, energy))))
        return round(self._left_by_combs * left)

    def _excess(self, bound: float, energy: float) -> float:
        """The excess over a bound up to which labels survive."""
        return energy + _TOLERANCE * (1 + energy) + self._roundings()[1] - bound

    def decoded(self, *, forwards: bool) -> tuple[Floats, Floats]:
        """Alpha and beta (n,) of the crosses that the shares suggest; forwards after a backward pass."""
        crosses = Crosses.none(len(self.lattice.count))
        for place in self.places[:: 1 if forwards else -1]:
            crosses = place.ask("decoded", crosses, forwards=forwards)()
        return crosses.alpha, np.clip(crosses.beta, -QUARTER, QUARTER)

    def arrays(self, quanta: tuple[float, float]) -> tuple[Arrays, Arrays]:
        """Messages and tables as whole numbers of their scales, after `quantise`."""
        messages, tables = zip(*self._all("arrays", *quanta), strict=True)
        return _joined(messages), _joined(tables)


def _joined(parts: tuple[Arrays, ...]) -> Arrays:
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
