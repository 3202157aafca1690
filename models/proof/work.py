"""The work of a proof: a field, and a bound of its distance from the minimum.

Lattice after lattice, each of half the spacing, or of the same spacing with fewer labels. On each level the
dual rises by passes (models/proof/dual.py), fields are rounded from it (rounding.py), and what cannot hold
a better field is dropped (pruning.py), until the jumps are forced (forced.py). A better field that is found
on a coarse lattice becomes the centre: the lattices begin anew round it. On a finer lattice little is lost
where the centre is another field.

The labels of a level are those that the gap of the level before leaves. While passes close that gap, most of
them can be dropped, and the work of a pass falls faster than the gap. A record of the level justifies that.

Where a field has a vortex, the local polytope mixes fields with the vortex in other places, and finer
lattices leave its gap. Then the quads that hold most of it become clusters (clusters.py): on the second
level if the best field has a vortex, and on every level where the gap shrinks slowly.

What is left may contain several fields of nearly the least energy. Once the gap is small and some jumps are
forced near the best field, what is left is cut into parts (parts.py). Each part has levels of its own until
its bound, or that of the convex problem on its boxes, reaches the energy.
"""

from __future__ import annotations

import math
import time
from copy import copy
from dataclasses import dataclass, field, replace
from typing import ClassVar, Final

import numpy as np

from ..field.field import CrossField, Norm, field_in_windows
from ..field.jumps import free_jumps
from ..instance.angles import QUARTER
from ..instance.grid import Floats
from ..instance.instance import Instance
from ..processes.compiled import Crew
from ..processes.deadline import Deadline, Over, Progress, never
from ..processes.limits import Limits
from ..search.improvement import improved_field
from ..search.search import search
from ..search.starts import best_start, polyvector_start
from .check_certificate import MOST_COUNT, MOST_LEVELS
from .clusters import table_sizes
from .dual import Dual
from .forced import Forced, forced
from .lattice import Lattice, labels_at
from .parts import Cut, across_seam, best_cut, island_of
from .pruning import RemainingCells, finer, narrowed
from .record import EXACT, Branch, LevelRecord, Proof
from .rounding import Rounding, improve

COARSEST: Final = 16  # steps in pi/2 of the first level
_FINEST: Final = 2**16  # of the last one: spacings of 2e-5 radians
_PASSES: Final = 3  # forwards and backwards between two roundings
_BEFORE: Final = 9  # forwards and backwards before the gap shows where the first clusters are needed
_SLOW: Final = 0.3  # share of the gap that passes must close for a level to go on, if labels do not grow
_SLOW_PART: Final = 0.5  # the same in a part, which is easily cut again
_SLOWEST: Final = 0.005  # the same on the last level
_HALVES: Final = 4  # labels at half the spacing for each one that is left
_NARROWED: Final = 0.5  # share of the labels that are left, at which passes go on over these only
_MANY_LABELS: Final = 600_000  # with fewer, passes take less time than one more level of the certificate
_MOST_ROUNDS: Final = 40  # a level
_CLUSTERS: Final = (24, 0.08)  # quads that become clusters first: a number, or a share of all if that is more
_MORE_CLUSTERS: Final = (12, 0.04)  # later
_QUADS: Final = 0.15  # share of all quads that may become clusters at once
_STALLED: Final = 0.25  # share of the gap, left by half the spacing, above which there are more
_MOST_WORK: Final = 2e11  # additions of a pass, some 20 s
MOST_LABELS: Final = 50_000_000  # each takes some 100 bytes
_TABLES: Final = 4  # numbers of tables that take as much as a label
_RECORDING: Final = 9  # passes: the bound of a record and the pruning, with combs, take as long
_PAIR: Final = 2  # passes that may follow when there is time to begin them
_WORTH: Final = 12  # passes with clusters; a level with time for fewer is not begun
_DECIMALS: Final = 7  # of centres, which need few: their last digits differ between processors
_BETTER: Final = 1e-6  # relative; below, a better field need not become the centre
_WIDE: Final = 0.01  # relative gap above which a search follows the first level
_MANY: Final = 4  # levels after which the field may cause the rest of the gap, but no longer be the centre
_NEAR: Final = 0.75  # of the greatest distance from the centre that an alpha can have
_ROUGH: Final = 1e-5  # gap relative to 1 + energy; a first smaller one is rounded like it: few digits may do
_LARGE: Final = 1_000_000  # labels of a level before which to search, for passes over it take as long
_SEARCH: Final = 0.03  # greatest share of the time for that search, no longer than the proof so far
_LATE: Final = 0.05  # share of the time for the search before a level that takes long
_LONGER: Final = 2  # duration of a search, relative to the one before, below which it is left out
_SLICE: Final = 0.3  # share of the remaining time for a search after the last lattice
_ROUNDS: Final = 5  # of a search without a limit of time
_SMALL: Final = 0.003  # relative gap up to which what is left is cut; finer lattices close wider ones sooner
_OPEN: Final = 0.5  # share of pairs that may be open near the best field when what is left is cut
_SMALL_IF_FEW: Final = 0.006  # both for a level with not many labels, if the next one would be large
_OPEN_IF_FEW: Final = 0.9
_CLOSED: Final = 0.5  # share of the gap that a lattice with not many labels leaves, if the next one follows


@dataclass
class WorkLimits:
    """When to end: a deadline, a request to stop, a sufficient gap, enough work.

    work: greatest number of labels; labels: those so far.
    """

    deadline: Deadline
    stop: Over
    gap: float
    work: float
    labels: int = 0

    def met(self) -> str:
        """The limit that is met; empty when none is."""
        if self.stop():
            return "interrupted"
        if self.labels > self.work:
            return "work"
        return "time" if self.deadline.passed() else ""

    def over(self, ahead: float = 0.0) -> bool:
        """Whether work has to end now, or within `ahead` seconds."""
        return bool(self.met()) or self.deadline.left() <= ahead


def first_of(instance: Instance, given: CrossField | None, over: Over) -> CrossField:
    """The best of the first field, of the user's field and, in time, of the PolyVector start, improved."""
    return best_start(instance, given, over, polyvector_start)


@dataclass
class _Rest:
    """The cells that a level leaves, and what their boxes force."""

    left: RemainingCells
    what: Forced


@dataclass
class _Waiting:
    """A part of what a level leaves, for levels that are still to come, and the level's dual."""

    dual: Dual
    left: RemainingCells
    branch: Branch


@dataclass
class _Chain:
    """The levels round one centre, and what they prove together.

    branches: what each level covers; next: what the next one covers. last: bounds of the convex problems of
    levels that are followed by none. waiting: parts without a level.
    """

    levels: list[LevelRecord] = field(default_factory=list)
    branches: list[Branch] = field(default_factory=list)
    next: Branch = field(default_factory=lambda: Branch(-1))
    last: dict[int, float] = field(default_factory=dict)
    waiting: list[_Waiting] = field(default_factory=list)
    forced: int = 0
    multipliers: Floats | None = None
    cuts: tuple[int, ...] = (-1,)

    @property
    def bound(self) -> float:
        """The bound that all levels prove together."""
        return max(0.0, self.bound_of(0)) if self.levels else 0.0

    def bound_of(self, number: int) -> float:
        """The bound of the fields in the domain of a level."""
        parts = [part for part, branch in enumerate(self.branches) if branch.above == number]
        best = max(self.levels[number].bound, self.last.get(number, -math.inf))
        if parts and (len(parts) == 2 or self.branches[parts[0]].pixel < 0):
            best = max(best, min(map(self.bound_of, parts)))
        return best

    def add(self, level: LevelRecord) -> None:
        """Add a level, which covers `next`; the one that follows covers all that it leaves."""
        self.levels.append(level)
        self.branches.append(self.next)
        self.next = Branch(len(self.levels) - 1)

    @property
    def branched(self) -> bool:
        """Whether cells were cut into parts."""
        return self.next.pixel >= 0 or any(branch.pixel >= 0 for branch in self.branches)

    @property
    def ends(self) -> list[LevelRecord]:
        """The last level of each spacing among those that led to the last one."""
        path, number = list[LevelRecord](), len(self.levels) - 1
        while number >= 0:
            path.append(self.levels[number])
            number = self.branches[number].above
        return list({level.h: level for level in reversed(path)}.values())


@dataclass
class Work:
    """State of a proof of the 2-norm.

    searched: seconds of the last search between levels.
    """

    norm: ClassVar[Norm] = 2
    first = staticmethod(first_of)
    improve = staticmethod(improve)
    forced = staticmethod(forced)

    instance: Instance
    best: CrossField
    limits: WorkLimits
    hands: Crew
    seed_and_jobs: tuple[int, int]
    progress: Progress
    chain: _Chain = field(default_factory=_Chain)
    proven: _Chain = field(default_factory=_Chain)
    searches: int = 0
    searched: float = 0.0
    began: float = 0.0

    def improved(self, field: CrossField, over: Over = never) -> CrossField:
        """The field, with jumps and angles improved."""
        return improved_field(field, stop=over)

    def energy(self, field: CrossField) -> float:
        """The energy that the proof is of."""
        return field.energy(self.norm).total

    def level(self, centre: CrossField) -> Lattice:
        """The first level round a field."""
        return Lattice.whole(centre, COARSEST)

    def proof(self, seconds: float, ended: str) -> Proof:
        """The proof so far, with the levels that prove it; not checked."""
        bound, energy = min(self.proven.bound, self.energy(self.best)), self.energy(self.best)
        return Proof(
            self.best, energy, bound, self.proven.forced, tuple(self.proven.levels), seconds, ended,
            self.norm, self.proven.multipliers, self.proven.cuts, tuple(self.proven.branches),
        )  # fmt: skip

    def run(self) -> str:
        """Go through chains of levels until a limit is met or nothing helps; return the reason."""
        ended = self._descend()
        while not ended or (ended == "labels" and self._found_more()):
            ended = self._descend()
        return self.limits.met() or ended

    def _found_more(self) -> bool:
        """Whether a search finds a better field, with as much time left as the last chain took."""
        before, spent = self.energy(self.best), time.monotonic() - self.began
        while not self.limits.over():
            left = self.limits.deadline.left()
            self._search(_SLICE if left > 2 * spent else 1.0)
            if not np.isfinite(left) or self.limits.deadline.left() > spent:
                better = self.energy(self.best) < before * (1 - _BETTER)
                if better or not np.isfinite(left):
                    return better
        return False

    def _descend(self) -> str:
        """Go through the levels round the best field; the reason of the end, empty for a better field."""
        if met := self.limits.met():
            return met
        self.chain, before, self.began = _Chain(), self.best, time.monotonic()
        dual = Dual(self.level(_centre(before)), self.hands)
        patient = False
        while True:
            self._add_clusters(dual)
            rising = self._ascend(dual, patient=patient)
            rest = self._record(dual)
            if (ended := self._ended()) or rest is None:
                return ended or "time"
            if not rising and (cut := self._cut(rest)) is not None:
                return self._go_through_parts(dual, rest, cut)
            left = rest.left
            lattice = narrowed(left) if rising and not patient else finer(left)
            self._search_between(lattice)
            better = self.energy(self.best) < self.energy(before) * (1 - _BETTER)
            if better and (len(self.chain.ends) <= _MANY or _at_seam(self.best, lattice)):
                return self.limits.met()
            if _too_large(dual, lattice) or not self._in_time(dual, lattice):
                if patient and not rising:
                    return self.limits.met() if better else "labels"
                if self._closing(dual)():
                    return self.limits.met() or "time"
                lattice = narrowed(left)
            patient = lattice.h == dual.lattice.h and (patient or not rising)
            dual.move(lattice)

    def _cut(self, rest: _Rest) -> Cut | None:
        """Where to cut what is left, if the gap is small and some jumps are forced near the best field."""
        energy, few = self.energy(self.best), rest.left.lattice.allowed.sum() <= _MANY_LABELS
        few = few and _next_labels(rest.left) > _LARGE
        small, open_ = (_SMALL_IF_FEW, _OPEN_IF_FEW) if few else (_SMALL, _OPEN)
        if self.norm != 2 or energy - self.chain.bound > small * energy or self._finer_pays(rest.left):
            return None
        alpha, beta, jumps = labels_at(self.best, rest.left.lattice)
        left = replace(rest.left, lattice=replace(rest.left.lattice, p=jumps))
        island = island_of(left, alpha, beta)
        what = None if island is None else self.forced(island)
        if what is None or not what.strokes.all() or np.mean(~what.pairs) > open_:
            return None
        return best_cut(rest.left, rest.what.open_pixels)

    def _go_through_parts(self, dual: Dual, rest: _Rest, cut: Cut) -> str:
        """Cut what is left into parts, and go through the levels of each; the reason of the end.

        A search comes first: with a field that is not the best, the part that holds a better one stays open.
        """
        self._search(_SEARCH)
        self._wait(dual, rest, cut)
        while self.chain.waiting:
            part = self.chain.waiting.pop()
            self.chain.next = part.branch
            if ended := self._go_through_part(part.dual, narrowed(part.left)):
                return ended
        return "labels"

    def _go_through_part(self, dual: Dual, lattice: Lattice) -> str:
        """Go through the levels of a part, up to another cut; the reason of the end of the whole work."""
        while True:
            if _too_large(dual, lattice) or len(self.chain.levels) >= MOST_LEVELS:
                return "labels"
            if not self._in_time(dual, lattice, 2 * _PASSES):
                return self.limits.met() or "time"
            dual.move(lattice)
            rising = self._ascend(dual, patient=False, reached=self.chain.bound_of(self.chain.next.above))
            rest = self._record(dual)
            if ended := self._ended():
                return ended
            if self._exact(self.chain.bound_of(len(self.chain.levels) - 1)):
                return ""
            if rest is None:
                return self.limits.met() or "time"
            pays = self._finer_pays(rest.left)
            cut = None if pays else best_cut(rest.left, rest.what.open_pixels)
            if cut is not None:
                self._wait(dual, rest, cut)
                return ""
            lattice = narrowed(rest.left) if rising else finer(rest.left)

    def _finer_pays(self, left: RemainingCells) -> bool:
        """Whether the next lattice has not many labels and the last one, if no cells were cut, helped."""
        branch, energy = self.chain.branches[-1], self.energy(self.best)
        if _next_labels(left) > _MANY_LABELS:
            return False
        gap, before = (energy - self.chain.levels[number].bound for number in (-1, branch.above))
        return branch.above < 0 or branch.pixel >= 0 or gap <= _CLOSED * before

    def _wait(self, dual: Dual, rest: _Rest, cut: Cut) -> None:
        """Let both parts of what is left wait; the one with fewer cells comes first."""
        number = len(self.chain.levels) - 1
        parts = [
            _Waiting(copy(dual), part, Branch(number, cut.pixel, 2 * cut.axis + side, cut.step))
            for side, part in enumerate(cut.parts(rest.left))
        ]
        self.chain.waiting += sorted(parts, key=lambda part: -np.count_nonzero(part.left.cells))

    def _search_between(self, lattice: Lattice) -> None:
        """Search after the first level if the gap is wide, after some levels, and before one that takes long.

        After some levels the field may cause the rest of the gap. A search that would not be much longer
        than the last one is left out.
        """
        energy, began = self.energy(self.best), time.monotonic()
        wide, large = energy - self.chain.bound > _WIDE * energy, lattice.start[-1] > _LARGE
        late = large or len(self.chain.ends) == _MANY
        if not (self.searches == 0 and wide) and not (self.searches <= 2 and late):
            return
        spent, left = began - self.began, self.limits.deadline.left()
        seconds = _LATE * left if large else min(_SEARCH * left, spent)
        if np.isinf(left) or seconds >= _LONGER * self.searched:
            self._search(seconds / left if 0 < left < np.inf else 1.0)
            self.searched = time.monotonic() - began

    def _in_time(self, dual: Dual, lattice: Lattice, passes: int = _WORTH) -> bool:
        """Whether there is time for some passes over the lattice that follows."""
        return not self.limits.over(_seconds_of(passes, dual, lattice))

    def _closing(self, dual: Dual) -> Over:
        """A function that returns whether only the time to record the level is left."""
        return lambda: self.limits.over(_seconds_of(_PAIR, dual, dual.lattice))

    def _add_clusters(self, dual: Dual) -> None:
        """Add clusters at the beginning of a spacing, if vortices cause the gap."""
        count = self._wanted_clusters(dual.lattice)
        if count:
            times = 1 if len(dual.quads) else _BEFORE
            dual.ascend(times, self.limits.over, self._closing(dual))
            dual.add_clusters(count, self.best)

    def _wanted_clusters(self, lattice: Lattice) -> int:
        """The number of quads to become clusters on a lattice, which is the next one."""
        if self.chain.levels and self.chain.levels[-1].h == lattice.h:
            return 0
        gaps = [self.energy(self.best) - level.bound for level in self.chain.ends[-2:]]
        vortex = len(gaps) == 1 and len(self.best.singularities.index) > 0
        if not vortex and not (len(gaps) == 2 and gaps[1] > _STALLED * gaps[0]):
            return 0
        quads = len(self.instance.grid.quads)
        least, share = _MORE_CLUSTERS if len(self.chain.levels[-1].tables["quads"]) else _CLUSTERS
        return min(max(least, math.ceil(share * quads)), math.ceil(_QUADS * quads))

    def _ended(self) -> str:
        """The reason why the work ends; empty if it goes on."""
        energy, bound = self.energy(self.best), self.proven.bound
        if self._exact(bound):
            return "optimal"
        return "gap" if energy - bound <= self.limits.gap * energy else self.limits.met()

    def _exact(self, bound: float) -> bool:
        energy = self.energy(self.best)
        return energy - bound <= EXACT * (1 + energy)

    def _search(self, share: float) -> None:
        """Search for a better field from the best one, for a share of the time, or some rounds."""
        if self.limits.over():
            return
        seed, jobs = self.seed_and_jobs
        timed = np.isfinite(self.limits.deadline.left())
        self._offer(
            search(
                self.instance,
                limits=Limits().until(self.limits.deadline.share(share)) if timed else None,
                rounds=None if timed else _ROUNDS,
                seed=seed + self.searches,
                jobs=jobs,
                start=self.best,
                progress=lambda line: self.progress(f"search: {line}"),
                stop=self.limits.stop,
            ).field
        )
        self.searches += 1

    def _offer(self, found: CrossField) -> None:
        self.best = min(self.best, found, key=self.energy)

    def _ascend(self, dual: Dual, *, patient: bool, reached: float = -math.inf) -> bool:
        """Raise the dual of a level, and round fields from it, until the bound's rise is slow.

        Returns whether it is not, but the gap has become so small that passes over fewer labels are worth a
        record. patient: whether there is no finer level. reached: a bound from which the rise counts.
        """
        rounding, closing = Rounding(dual, self.improve), self._closing(dual)
        part = reached > -math.inf
        rises = [0.0 if part else math.inf] * 2
        for _ in range(_MOST_ROUNDS):
            bound = dual.ascend(_PASSES, self.limits.over, closing)
            if not part or self.chain.next.pixel < 0:
                self.best = rounding.lower(self.best, closing)
            energy = self.energy(self.best)
            self._report(max(self.proven.bound, min(bound, energy)), int(dual.lattice.allowed.sum()))
            rises = [rises[1], (bound - reached) / max(energy - bound, 1e-300)]
            slow = _SLOWEST if patient else _SLOW_PART if part else self._slow(dual, bound)
            if closing() or self._exact(bound) or (max(rises) <= slow and bound >= reached):
                break
            if self._may_narrow(dual, bound):
                return True
            reached = bound
        return False

    def _slow(self, dual: Dual, bound: float) -> float:
        """The share of the gap below which a rise is slow: passes pay if the next level has many labels."""
        left = dual.count_left(bound, self.energy(self.best))
        growth = _HALVES * left / int(dual.lattice.allowed.sum())
        return _SLOW / max(1.0, growth) ** 2

    def _may_narrow(self, dual: Dual, bound: float) -> bool:
        """Whether passes over the labels that are left are worth a record of the level."""
        labels, energy = dual.lattice.allowed.sum(), self.energy(self.best)
        few = labels > _MANY_LABELS and dual.count_left(bound, energy) <= _NARROWED * labels
        return few and self._in_time(dual, dual.lattice)

    def _report(self, bound: float, labels: int) -> None:
        """Report bound, least energy and remaining labels, and count the labels as work."""
        self.limits.labels += labels
        self.progress(f"energy {self.energy(self.best):.5g}, bound {bound:.5g}, {labels} labels")

    def _record(self, dual: Dual) -> _Rest | None:
        """Record the level and, in time, prune it; what is left, if that does not end the level."""
        chain, energy = self.chain, self.energy(self.best)
        rough = _ROUGH * (1 + energy)
        level, rest = LevelRecord.of(dual, energy, rough if energy - chain.bound > rough else 0.0), None
        if level.bound > chain.bound or not self.limits.over():
            chain.add(level)
        if not self.limits.over() and not (chain.branched and self._exact(level.bound)):
            left = dual.remaining_cells(level.bound, energy)
            if left.nothing:
                chain.last[len(chain.levels) - 1] = energy
            else:
                rest = _Rest(left, self._fit(left))
        if chain.bound >= self.proven.bound:
            self.proven = chain
        return rest

    def _fit(self, left: RemainingCells) -> Forced:
        """Find what is forced, and if all is, solve the convex problem that is left."""
        chain, (_, _, jumps) = self.chain, labels_at(self.best, left.lattice)
        what = self.forced(replace(left, lattice=replace(left.lattice, p=jumps)))
        if what.everything or not chain.branched:
            chain.forced = int(what.pairs.sum())
        if not what.everything and self.norm == 2:
            what = forced(*across_seam(left))
        if what.everything:
            energy = self.energy(self.best)
            found, bound, chain.multipliers, chain.cuts = what.least(energy, self.limits.over)
            chain.last[len(chain.levels) - 1] = min(bound, chain.levels[-1].energy)
            if bound < energy:
                better = field_in_windows(self.instance, found.alpha, found.beta, found.p)
                self._offer(self.improved(better, self.limits.over))
        return what


def _next_labels(left: RemainingCells) -> int:
    """The number of labels at half the spacing, about."""
    return _HALVES * int(np.count_nonzero(left.cells))


def _seconds_of(passes: int, dual: Dual, lattice: Lattice) -> float:
    """Expected seconds of some passes with updates of the clusters on a lattice, and of its record."""
    one, tables = dual.seconds_on(lattice)
    return passes * (one + tables) + _RECORDING * one


def _too_large(dual: Dual, lattice: Lattice) -> bool:
    """Whether the next level of a dual is beyond what memory, time, checker or digits of an angle allow."""
    tables = int(table_sizes(lattice, dual.quads).sum())
    many = int(lattice.start[-1]) + tables // _TABLES > MOST_LABELS
    many = many or max(lattice.alpha_count.max(), lattice.beta_count.max()) > MOST_COUNT
    return lattice.h < np.pi / 2 / _FINEST or many or lattice.pass_work > _MOST_WORK


def _at_seam(field: CrossField, lattice: Lattice) -> bool:
    """Whether a cross of the field is near both ends of the labels, where no box is small."""
    return bool(np.abs(labels_at(field, lattice)[0] - lattice.alpha).max() > _NEAR * QUARTER)


def _centre(field: CrossField) -> CrossField:
    """The crosses of a field in the gauge `strokes`, each pair with its best jump."""
    instance = field.instance.with_gauge("strokes")
    alpha, beta = (np.round(angle, _DECIMALS) for angle in (field.alpha, field.beta))
    return field_in_windows(instance, alpha, beta, free_jumps(instance, alpha, beta)[0])
