"""Proofs for orthogonal crosses on any domain: level after level of labels round the best field.

docs/orthogonal-proofs.md has the lemmas. On every level a dual rises (orthogonal_dual.py), a field is rounded
from it, and the checker (check_orthogonal.py) computes the bound and what is left. The next level has a third
of the spacing, or the same with fewer labels. Rings that hold part of the gap become clusters. Where many
points have no stroke, charges (charges.py), their products (products.py) and branches (branches.py) give a
first bound.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from ...array_archive import Arrays
from ...field.field import CrossField
from ...instance.angles import HALF
from ...instance.cycles import grow_forest
from ...instance.domain import Bools, Domain, Floats, Ints
from ...instance.file import instance_arrays
from ...instance.instance import Instance
from ...instance.sparse_systems import factor_matrix
from ...orthogonal.energy import OrthogonalEnergy, field_of
from ...processes.deadline import Progress, never
from ...search.integer_fields import starting_integers
from ...search.integer_search import IntegerSearch
from ..bound.branches import branch_arrays
from ..bound.charges import charge_arrays
from ..bound.orthogonal_dual import RingDual, update_rings
from ..bound.products import products_arrays
from ..checkers import check_orthogonal as checker
from ..checkers.check_certificate import OPTIMAL
from ..checkers.check_orthogonal import CellLevel, CentredRows
from .record import INSTANCE, Chain, LevelFacts, Proof

if TYPE_CHECKING:
    from .descent import Termination

_COARSEST: Final = 15  # cells of a quarter turn
_FINEST: Final = 3645
_MOST_COSTS: Final = 12_000_000  # pairs of labels of a level: 1.4 GB
_SECONDS: Final = 2e-6  # for each of them on the coarsest level: a forecast
_SWEEPS: Final = 20  # over all points, in which colours change
_NARROW: Final = 0.7  # share of the cells left below which the same spacing is worth another level
_MOST_PASSES: Final = 200
_PASSES: Final = 5  # between looks at the bound, and updates of rings if there are any
_SLOW: Final = (0.08, 0.02)  # part of the gap: a smaller rise is slow; the latter for rings and wide gaps
_BETWEEN: Final = 4  # passes between two updates of rings, which take longer
_FEW_LEFT: Final = 0.4  # share of labels left below which a record of the level pays
_CLOSER: Final = 0.3  # part of the gap of the last record, from which another one makes rings cheaper
_ENOUGH: Final = 0.1  # the same for a tiny gap
_TINY: Final = 1e-3  # relative gap below which finer labels follow
_MOST_OF: Final = 0.9  # of what rings cost: those with the rest come into use later, unless the gap is loose
_MANY: Final = 0.1  # share of new rings above which they may come into use at the same spacing
_LOOSE: Final = 0.2  # relative gap above which they do, no chain follows a search, and products end in time
_STARTS: Final = 0.3  # of the time, after which no start is rounded with care
_CHARGES: Final = 0.5  # of the time, which charges leave
_MANY_FREE: Final = 400  # points without strokes above which levels exclude little, and charges are tried
_CLOSED: Final = 0.05  # relative gap of charges below which branches take the time of levels
_WORTH: Final = 0.5  # of the energy: what clouds prove where products pay, unless all loops are closed
_LOOK: Final = 1e-4  # seconds per point of a first look at charges, and of its check, where points are many
_PULL: Final = 1e-9  # relative: makes the matrix of prescribed rings of a closed part definite
_TUNING: Final = 0.1  # of the time, in which the multipliers of prescribed sums rise
_STEPS: Final = 8  # of these
_SOFT: Final = 0.1  # of the gap: excess of labels that count less, and what sums lack that needs no step
_WIDE: Final = 0.01  # relative gap after which a search follows, from the second spacing on
_SEARCH: Final = 0.25  # share of the time left that it takes at most
_ROUNDS: Final = 10  # of a search without a limit of time
_PATIENCE: Final = 200  # perturbations per point without success that end all searches
_BETTER: Final = 1e-9  # relative: a better field; also what a level keeps more than the checker asks for


def prove_orthogonal(
    instance: Instance, start: CrossField | None, ends: Termination, progress: Progress, seed: int = 0
) -> tuple[Proof, Floats | None]:
    """Find a field of orthogonal crosses, and prove a lower bound of the energy of all.

    The instance has the gauge `strokes`. The time limit includes the check, whose seconds are forecast.
    Returns the proof, not checked, and the limits of Lemma 1, which its check can use.
    """
    began = time.monotonic()
    energy = OrthogonalEnergy.of(instance)
    soon = ends.deadline.share(_STARTS)
    starts = starting_integers(instance, energy, start, lambda: soon.passed() or ends.is_over())
    prover = _Prover(instance, energy, starts, ends, progress, seed)
    return prover.proof(prover.run(), began), prover.limit


@dataclass
class _TimedChain(Chain):
    """A chain for which the time of its check is forecast. threshold: as of `Proof`."""

    threshold: float = math.inf
    gap: float = math.inf  # at the last level
    seconds: float = 0.0  # that the checker took
    pace: float = 0.0  # seconds per unit of work at the last level


def two_colours(domain: Domain, fixed: Bools) -> NDArray[np.uint8]:
    """0 or 1 of each point, such that most pairs have both, and 0 where it is fixed; (n,)."""
    near = list[list[int]]([] for _ in range(domain.size))
    for i, j in zip(domain.first.tolist(), domain.second.tolist(), strict=True):
        near[i].append(j)
        near[j].append(i)
    side = 1 - 2 * (grow_forest(domain.size, domain.first, domain.second, []).depth % 2)
    for i in np.tile(np.nonzero(~fixed)[0], _SWEEPS).tolist():
        if side[i] * sum(side[j] for j in near[i]) > 0:
            side[i] = -side[i]
    return np.array(side < 0, dtype=np.uint8)


@dataclass
class _Prover:
    """The best field, and the chain that proves most. z: integers of the field; least: its energy.

    starts: integers to begin with. arrays: of all certificates. rows: without a centre. charges, of_charges:
    their bound, and their arrays; charged: the energy of the field for which they were found. look: seconds
    of the last ones. limit: of Lemma 1. hunt: the search for better integers. searched: its seconds. took:
    seconds of the last chain. reason: what is left out.
    """

    instance: Instance
    energy: OrthogonalEnergy
    starts: list[Ints]
    ends: Termination
    progress: Progress
    seed: int = 0
    proven: _TimedChain = field(default_factory=_TimedChain)
    arrays: Arrays = field(default_factory=dict)
    rows: CentredRows | None = None
    charges: float = 0.0
    of_charges: Arrays = field(default_factory=dict)
    charged: float = math.inf
    look: float = 0.0
    limit: Floats | None = None
    hunt: IntegerSearch | None = None
    searched: float = 0.0
    took: float = 0.0
    reason: str = ""

    def __post_init__(self) -> None:
        self.z = min(self.starts, key=self.energy.least_total)
        self.least, self.began = self.energy.least_total(self.z), self.ends.deadline.clock()

    def _prepare(self) -> CentredRows:
        """Compute what all levels share; the rows without a centre."""
        domain, arrays = self.instance.domain, instance_arrays(self.instance).items()
        length, fits = np.diff(domain.rings.start), self._coarsest_costs() <= _MOST_COSTS
        rings = domain.rings.keep((length >= 3) & (length <= checker.MOST_RING) & fits)
        self.arrays = {INSTANCE + name: array for name, array in arrays}
        self.arrays |= {"kappa": domain.kappa} if domain.kappa is not None else {}
        self.arrays |= {"ring_start": rings.start, "ring_pair": rings.pair}
        self.arrays |= {"ring_sign": rings.sign.astype(np.int8), "centre": np.zeros(domain.size)}
        self.arrays["half"] = np.zeros(domain.size, np.uint8)
        if (sums := self.energy.sums) is not None:  # multipliers as if all other sums were free
            around = sums @ self.energy.constant + HALF * self.energy.turns_along
            matrix = (sums / self.energy.weight) @ sums.T
            self.arrays[checker.POTENTIAL] = factor_matrix(matrix, pull=_PULL * matrix.max())(around)
        rows, links = checker.CentredRows(self.arrays), self.energy.links
        self.order = reverse_cuthill_mckee(links + links.T, symmetric_mode=True).astype(np.int64)
        if fits:  # otherwise no level follows, and this takes long
            self.arrays["half"] = two_colours(domain, rows.fixed[:-1])
        self.limit = rows.limit
        if fits and self.energy.sums is not None:
            self._raise_potential()
        return rows

    def _raise_potential(self) -> None:
        """Raise the bound of the coarsest level by steps of the multipliers of prescribed sums (Polyak 1969).

        The slope is what integers lack of the sums, in the mean over labels, those of least excess first.
        """
        soon, given = self.ends.deadline.share(_TUNING), self.arrays[checker.POTENTIAL]
        best, step = -math.inf, np.zeros_like(given)
        for _ in range(_STEPS):
            arrays = self.arrays | {checker.POTENTIAL: given + step}
            chain, rows = self._begin_chain(arrays)
            level = checker.first_level(rows, _COARSEST)
            costs, most, pairs = checker.costs_of(level), chain.threshold, level.pairs
            dual = RingDual(level, costs, self.order, [])
            for number in range(2 * _PASSES):
                dual.pass_over(most, forward=number % 2 == 0)
            excess = checker.Excess(level, costs, 1.0, dual.state.shares[: pairs.first_line[rows.pairs]], [])
            if excess.bound <= best:
                step /= 2
                continue
            best, given, self.arrays = excess.bound, given + step, arrays
            first, second = pairs.at_ends(level.label + rows.half[level.point] / 2)
            residual = rows.residual[pairs.row] + HALF / level.divisions * (first - second)
            spare = np.add(*pairs.at_ends(excess.points)) + excess.pairs
            share = np.exp(-spare / (_SOFT * max(most - best, 1e-9 * (1 + most))))
            turns = np.bincount(pairs.row, -np.round(residual / HALF) * share) / np.bincount(pairs.row, share)
            lacking = self.energy.turns_along - self.energy.sums @ (rows.nearest + turns)
            if lacking @ lacking < _SOFT or soon.passed() or self.ends.is_over():
                break
            step = (most - best) / np.pi * lacking / max(lacking @ lacking, 1.0)

    def _bound_by_charges(self) -> str:
        """Bound the energy by charges where strokes are few; the reason why no level follows.

        It is due at the beginning and, while levels prove less, for better fields, which exclude more.
        """
        ends, quick, many = self.ends, self.rows is None, self.instance.domain.size > checker.MOST_DENSE
        free, expected = len(self.energy.pins) > 0, _LOOK * self.instance.domain.size
        free |= not many and self.instance.domain.size - len(self.instance.theta) > _MANY_FREE
        if quick and many and free and ends.is_over(expected):
            self._leave_out(f"charges take about {expected:.0f} s, which needs a longer time limit")
            free = False
        if quick and not free and self._reason_against_levels():
            return ""
        self.rows, clock = self.rows or self._prepare(), ends.deadline.clock
        free &= self.charges >= self.proven.bound
        while free and self.least < self.charged:
            begin, left = clock(), ends.deadline.left()
            later = _CHARGES * left if math.isfinite(left) else 0.0
            if not quick and ends.is_over(later + self.look):
                break
            chain, rows = self._begin_chain()
            took, least = clock() - begin, self.least
            ahead = took if quick else max(later, self.proven.seconds)
            is_over = (lambda: ends.is_over(ahead)) if many or not quick else never  # noqa: B023
            # One look shows whether a search pays first.
            arrays = charge_arrays(self.instance.domain, rows, chain.threshold, is_over, quick=quick)
            if arrays and not quick:
                arrays |= self._branch(arrays, rows, chain.threshold, ahead)
            self._keep_charges(chain, arrays, rows, took)
            self.charged, self.look = math.inf if quick and arrays else least, clock() - begin
            if self.charges > 0 and (reason := self._reason_to_end(self.proven)):
                return reason
            if self.least - self.charges < _LOOSE * self.least:
                self._search_if_due()
            if arrays and not quick and self.least == least:
                self._keep_charges(chain, self._multiply(arrays, rows, chain.threshold, ahead), rows, took)
                if self.charges > 0 and (reason := self._reason_to_end(self.proven)):
                    return reason
            quick = False
        return ""

    def _keep_charges(self, chain: _TimedChain, arrays: Arrays, rows: CentredRows, took: float) -> None:
        """Take a bound by charges into a chain without levels, if it is the best one.

        took: seconds that the rows took.
        """
        checking = self.ends.deadline.clock()
        bound = checker.charges_bound(arrays, rows, chain.threshold)
        if bound > self.charges:
            before = chain.arrays.keys() - self.of_charges.keys()
            chain.arrays = {name: chain.arrays[name] for name in sorted(before)} | arrays
            self.charges, self.of_charges, chain.convex = bound, arrays, bound
            chain.seconds = took + self.ends.deadline.clock() - checking
            self.proven = max(chain, self.proven, key=lambda chain: chain.bound)
            self.progress(f"energy {self.least:.5g}, bound {bound:.5g}, charges")

    def _is_over(self, bound: float, ahead: float, part: float) -> bool:
        """Whether only seconds for what follows are left, or for the check if less than a part lacks."""
        close = self.least - bound < part * self.least
        return self.ends.is_over(self.proven.seconds if close else ahead)

    def _branch(self, arrays: Arrays, rows: CentredRows, threshold: float, ahead: float) -> Arrays:
        """The arrays of branches, and a better field if they show one. ahead: seconds for what follows."""
        bound, charges, clouds, count = checker.stages_bound(arrays, rows, threshold)
        if self.least - bound <= OPTIMAL / 2 * max(1.0, self.least):
            return {}
        branches, better = branch_arrays(
            charges, clouds, count, threshold, lambda seconds: self._is_over(bound, ahead + seconds, _CLOSED)
        )
        self._offer_charges(arrays, better)
        return branches

    def _multiply(self, arrays: Arrays, rows: CentredRows, threshold: float, ahead: float) -> Arrays:
        """The arrays of charges with products of particles, and branches on those that are left.

        They may show a better field, too. ahead: as of `_branch`.
        """
        stages = {name: array for name, array in arrays.items() if name not in checker.BRANCHES}
        bound, charges, clouds, count = checker.stages_bound(stages, rows, threshold)
        if not charges.closed.all() and bound < _WORTH * self.least:
            return arrays
        walks = arrays["loop_sign"] * (rows.residual - rows.shift)[arrays["loop_row"]] / HALF
        products, count, better = products_arrays(
            charges, clouds, count, np.add.reduceat(walks, arrays["loop_start"][:-1]),
            threshold=threshold, is_over=lambda bound: self._is_over(max(bound, self.charges), ahead, _LOOSE),
        )  # fmt: skip
        stages |= products
        bound = checker.charges_bound(stages, rows, threshold)
        self._offer_charges(arrays, better)
        if bound > self.charges:
            branches, better = branch_arrays(
                charges, clouds, count, threshold, lambda more: self._is_over(bound, ahead + more, _CLOSED)
            )
            self._offer_charges(arrays, better)
            stages |= branches
        return stages

    def _offer_charges(self, arrays: Arrays, charges: Floats | None) -> None:
        """Offer a field with these charges of loops, if there are any."""
        if charges is not None and self.energy.sums is None:
            parts = arrays["loop_sign"], arrays["loop_row"], arrays["loop_start"]
            walks = csr_array(parts, shape=(len(charges), len(self.z)))
            z = self.energy.with_charges(self.z, walks, charges)
            self._offer(self.energy.descend(z, is_over=self.ends.is_over))

    def _leave_out(self, what: str) -> None:
        """Add to the reason what is left out."""
        self.reason = "; ".join(dict.fromkeys(filter(None, [*self.reason.split("; "), what])))

    def proof(self, ended: str, began: float) -> Proof:
        """The proof so far, not checked."""
        best, chain = field_of(self.instance, self.z, self.energy), self.proven
        energy, levels = best.energy().total, tuple(chain.levels)
        return Proof(
            field=best, energy=energy, bound=min(chain.bound, energy), forced=chain.forced, levels=levels,
            seconds=time.monotonic() - began, ended=ended, arrays=chain.arrays, threshold=chain.threshold,
            reason=self.reason,
        )  # fmt: skip

    def run(self) -> str:
        """Go through chains of levels until a limit is met or nothing helps; return the reason.

        Where no level helps, fits or has time, the rest of the time goes to the search.
        """
        try:
            if self.least == math.inf:  # no start keeps within the limits of prescribed indices
                self._search(_SEARCH * self.ends.deadline.left())
            while True:
                if reason := self._bound_by_charges():
                    if reason == "time":
                        self._reason_against_levels()  # names what is left out
                    return reason
                begin = self.ends.deadline.clock() - self.searched
                reason = self._go_through_levels()
                self.took = self.ends.deadline.clock() - self.searched - begin
                if reason and not (reason in ("labels", "time") and self._search_on()):
                    return self.ends.reason() or reason
        except MemoryError:
            return "memory"

    def _coarsest_costs(self) -> int:
        """How many pairs of labels the coarsest level has."""
        return len(self.instance.domain.first) * (_COARSEST + 1) ** 2

    def _reason_against_levels(self) -> str:
        """The reason why no level is begun; empty if one is: on few points, a first one whatever the time."""
        reason, small = self.ends.reason(), self.instance.domain.size <= checker.MOST_DENSE
        costs = self._coarsest_costs()
        if costs > _MOST_COSTS:
            self._leave_out(
                f"the coarsest level has {costs} pairs of labels, and at most {_MOST_COSTS} fit in memory"
            )
            return reason or "labels"
        needed = small and not self.proven.bound
        if not needed and reason in ("", "time") and self.ends.is_over(_SECONDS * costs):
            if not self.proven.levels:
                seconds = f"{_SECONDS * costs:.0f} s"
                self._leave_out(f"the coarsest level takes about {seconds}, which needs a longer time limit")
            return "time"
        return "" if reason == "time" and needed else reason

    def _go_through_levels(self) -> str:
        """Go through the levels round the best field; the reason of the end, empty for a better field."""
        if reason := self._reason_against_levels():
            return reason
        chain, rows = self._begin_chain()
        rings, level, before = list[int](), checker.first_level(rows, _COARSEST), None
        while True:
            costs = checker.costs_of(level)
            dual = RingDual(level, costs, self.order, rings)
            ahead = max(chain.seconds + 2 * dual.work * chain.pace, self.proven.seconds)
            if chain.levels and self.ends.is_over(ahead):
                return self.ends.reason() or "time"
            if before is not None:
                dual.interpolate(before)
            closing = self._ascend(dual, chain, ahead)
            if self._find_better_field(dual) and not self.ends.is_over():
                return ""
            least = self.least
            squares = self._record(chain, dual, costs)
            adds = chain.bound > self.charges or not self.charges or chain.forced
            if adds and chain.bound >= self.proven.bound:  # a certificate of charges alone is small
                self.proven = chain
            reason = self._reason_to_end(chain)
            search = level.divisions > _COARSEST and chain.gap > _WIDE * self.least
            if reason or self.least < least or (search and self._search_if_due()):
                return reason
            loose = self.least - dual.bound > _LOOSE * self.least  # whatever charges prove
            more = self._more_rings(dual, 1.0 if loose else _MOST_OF)
            many = len(more) > _MANY * len(rings)
            closing |= many and loose and level.divisions == _COARSEST
            factor = 1 if closing else self._next_factor(level, squares, more=many)
            if not factor:
                return "labels"
            rings = rings + more
            level, before = checker.next_level(level, squares, factor), dual

    def _begin_chain(self, shared: Arrays | None = None) -> tuple[_TimedChain, CentredRows]:
        """A chain round the best field, without levels, and its rows. shared: by default `arrays`."""
        best = field_of(self.instance, self.z, self.energy)
        arrays = (shared or self.arrays) | self.of_charges | {"centre": self.energy.fit_angles(self.z)}
        arrays["divisions"] = np.zeros(0, np.int32)
        arrays["cases"] = np.zeros((0, self.instance.domain.size))
        rows = checker.CentredRows(arrays, self.limit)
        energy, error, _ = checker.energy_of({"alpha": best.alpha, "p": best.p}, rows)
        most = energy * (1 + _BETTER) + 2 * error
        return _TimedChain(arrays=arrays, threshold=most, convex=self.charges), rows

    def _ascend(self, dual: RingDual, chain: _TimedChain, ahead: float) -> bool:
        """Passes until the bound rises slowly, or few labels or seconds are left; whether rings close it."""
        reached, rings, closing, most = -math.inf, bool(dual.ring_numbers), False, chain.threshold
        for number in range(_MOST_PASSES):
            for _ in range(_BETWEEN if rings else 1):
                dual.pass_over(most, forward=True)
                bound, left = dual.pass_over(most, forward=False)
            if rings:
                update_rings(dual.state, dual.rings, max(most - bound, 0.0))
            gap = most - bound
            closing = rings and number > 1 and _TINY * most < gap < _CLOSER * chain.gap
            if self.ends.is_over(ahead) or closing or (rings and gap < _ENOUGH * chain.gap):
                break
            if number % _PASSES == _PASSES - 1:
                if bound - reached < _SLOW[rings and gap > _WIDE * most] * gap or left < _FEW_LEFT:
                    break
                reached = bound
        dual.pass_over(most, forward=True)
        bound, _ = dual.pass_over(most, forward=False)
        labels = len(dual.state.unary)
        self.ends.labels += labels
        self.progress(f"energy {self.least:.5g}, bound {max(bound, self.proven.bound):.5g}, {labels} labels")
        return closing

    def _find_better_field(self, dual: RingDual) -> bool:
        """Whether the shares suggest a better field, which then is the best one."""
        z = self.energy.nearest(dual.decode())
        return self._offer(self.energy.descend(z, is_over=self.ends.is_over))

    def _search_if_due(self) -> bool:
        """Whether a search finds a better field. All of them may take as long as the levels."""
        left, spent = self.ends.deadline.left(), self.ends.deadline.clock() - self.began
        if left == math.inf:
            return self.hunt is None and self._search(left)
        return self._search(min(_SEARCH * left, spent - 2 * self.searched))

    def _search_on(self) -> bool:
        """Search for the rest of the time, or for half of it and whether a better field is worth a chain."""
        while (left := self.ends.deadline.left() - self.proven.seconds) > 0 and not self.ends.is_over():
            close = self.least - self.proven.bound <= _LOOSE * self.least
            chain = left == math.inf or (close and left > 2 * self.took)
            if self._search(left / 2 if chain else left) and chain:
                return True
            if left == math.inf or not chain or self._is_tired():
                return False
        return False

    def _is_tired(self) -> bool:
        """Whether the search has found nothing for long."""
        return self.hunt is not None and self.hunt.fruitless > _PATIENCE * self.energy.size

    def _search(self, seconds: float) -> bool:
        """Whether a search finds a better field: whole rounds, so that it goes on where it ended."""
        clock, least = self.ends.deadline.clock, self.least
        if self.hunt is None or self.least < self.hunt.best.energy * (1 - _BETTER) - 1e-12:
            starts = [*self.starts, self.z]
            self.hunt = IntegerSearch(self.energy, self.instance.domain.rings, starts, self.seed)
        begin, last = clock(), self.hunt.round + _ROUNDS if seconds == math.inf else math.inf

        def is_over() -> bool:
            return self.ends.is_over(self.proven.seconds)

        while clock() < begin + seconds and self.hunt.round < last and not is_over() and not self._is_tired():
            self.hunt.explore(is_over)
            self._offer(self.hunt.best.p)
            self.progress(f"search: energy {self.least:.5g} after {self.hunt.round} rounds")
        self.searched += clock() - begin
        return self.least < least

    def _offer(self, z: Ints) -> bool:
        """Whether integers with the prescribed sums are better than the best ones, which they then are."""
        z = self.energy.with_sums(z)
        total = self.energy.least_total(z)
        if better := bool(total < self.least * (1 - _BETTER) - 1e-12):
            self.z, self.least = z, total
        return better

    def _record(self, chain: _TimedChain, dual: RingDual, costs: Floats) -> Bools:
        """Add a level to its chain; the squares that the checker finds that it leaves, and a little more.

        Other processors round differently, and must not find more.
        """
        prefix, level, rows = f"level_{len(chain.levels)}_", dual.level, dual.level.rows
        began = self.ends.deadline.clock()
        chain.gap, most = chain.threshold - dual.bound, chain.threshold * (1 + _BETTER) + 1e-12
        numbers = dual.arrays(max(chain.gap, 1e-6 * (1 + chain.threshold)))
        chain.arrays |= {prefix + name: array for name, array in numbers.items()}
        excess = checker.Excess(level, costs, *checker.stored_shares(chain.arrays, len(chain.levels), level))
        squares: Bools = checker.kept_of(level, excess, most)
        chain.arrays[f"{prefix}squares"] = np.packbits(squares[: level.squares.begin[rows.pairs]])
        chain.arrays["divisions"] = np.append(chain.arrays["divisions"], np.int32(level.divisions))
        chain.levels.append(LevelFacts(np.pi / 2 / level.divisions, len(dual.state.unary), excess.bound))
        turns = checker.possible_turns(level, squares)
        chain.forced = int((turns[: rows.pairs] == checker.CENTRAL).all(axis=1).sum())
        cases = [(rows.nearest + np.array(case)).astype(np.int32) for case in checker.cases_of(turns)]
        fitted = (self.energy.fit_in_limits(z) for z in cases)
        of_cases = [rows.centre[:-1] if angle is None else angle for angle in fitted]
        angles = np.array(of_cases).reshape(-1, rows.size)
        chain.arrays["cases"] = angles
        chain.convex = max(self.charges, checker.cases_bound(rows, turns, angles))
        for z in cases:
            self._offer(z)
        seconds = self.ends.deadline.clock() - began
        chain.seconds, chain.pace = chain.seconds + seconds, seconds / dual.work
        return squares

    def _reason_to_end(self, chain: _TimedChain) -> str:
        """The reason why the work ends; empty if it goes on."""
        if self.least - chain.bound <= OPTIMAL / 2 * max(1.0, self.least):
            return "optimal"
        return self.ends.reason_at(self.least, self.proven.bound)

    def _more_rings(self, dual: RingDual, share: float) -> list[int]:
        """Rings with that share of what pairs cost at the centre beyond their shares, and not in use."""
        gaps = dual.ring_gaps()
        gaps[dual.ring_numbers] = 0.0
        order = np.argsort(-gaps, kind="stable")
        gaps, before = gaps[order], np.cumsum(gaps[order]) - gaps[order]
        return list(map(int, order[(gaps > 1e-6 * max(self.least, 1.0)) & (before < share * gaps.sum())]))

    def _next_factor(self, level: CellLevel, squares: Bools, *, more: bool) -> int:
        """How many parts each cell has on the next level; 0 if no level helps."""
        left = level.owner[level.squares.have_partners(squares)]
        counts, rows = 3.0 * np.bincount(left, minlength=level.rows.size + 1) + 1, level.rows
        finer = counts[rows.first[: rows.pairs]] @ counts[rows.second[: rows.pairs]]
        narrow = counts.sum() < _NARROW * 3 * len(level.cells)
        if level.divisions < _FINEST and finer <= (_MOST_COSTS / 20 if narrow else _MOST_COSTS):
            return 3
        return 1 if narrow or more else 0
