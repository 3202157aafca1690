"""The descent of a proof: lattice after lattice, until no better field is left round the best one.

Each refinement level has half the spacing of the one before, or the same spacing with fewer labels. On a
level the dual rises by passes (bound/dual.py), fields are rounded from it (bound/rounding.py), and cells that
cannot hold a better field are dropped (bound/pruning.py), until so few jumps are open that branching among
them proves the optimum (last_step.py). A better field that is found on a coarse lattice becomes the centre:
the levels begin anew round it. On a finer lattice little is lost where the centre is another field.

The labels of a level are those that the gap of the level before leaves. While passes close that gap, most of
them can be dropped, and the work of a pass falls faster than the gap. A record of the level justifies that.

Where a field has a vortex, the local polytope mixes fields with the vortex in other places, and finer
lattices leave its gap. Then the quads that hold most of it become clusters (clusters.py): on the second
level if the best field has a vortex, and on every level where the gap shrinks slowly.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from ...array_archive import Arrays
from ...field.field import CrossField, Norm, field_in_windows
from ...field.jumps import free_jumps
from ...instance.instance import Instance
from ...processes.compilation import Crew
from ...processes.deadline import Deadline, IsOver, Progress, never
from ...processes.limits import Limits
from ...search.improvement import improved_field
from ...search.search import search
from ...search.starts import polyvector_start, start_fields
from ..bound.clusters import table_sizes
from ..bound.dual import Dual
from ..bound.lattice import Lattice
from ..bound.pruning import RemainingCells, finer_lattice, smaller_lattice
from ..bound.rounding import Rounding, better_field
from ..checkers.check_certificate import MOST_COUNT, has_forced_jump, level_memory, memory_for
from .last_step import energy_terms, has_few_open, last_step_on, minimise_on_boxes
from .record import EXACT, Chain, LevelFacts, Proof

# Levels
COARSEST: Final = 16  # steps in pi/2 of the first level, whose passes cost least
_FINEST: Final = 2**16  # steps in pi/2 of the last one: finer ones come near the digits of centres
MOST_LABELS: Final = 50_000_000  # labels of a level, for memory: each takes some 100 bytes
_OF_SHARE: Final = 32  # bytes of memory that the checker grants for each share, beside those for the share
_TABLE_NUMBERS: Final = 4  # numbers of tables that take as much memory as a label
_DECIMALS: Final = 7  # digits of centres in rad: their last digits differ between processors
_SETTLED: Final = 4  # spacings after which little is lost where the centre is another field

# Passes
_PASSES: Final = 3  # passes forwards and backwards between two roundings, which do another one
_MOST_ROUNDS: Final = 40  # roundings of a level, in case that the bound creeps
_SLOW: Final = 0.3  # share of the gap that passes must close for a level to go on, if labels do not grow
_FEW_LABELS: Final = 600_000  # labels of which passes take less time than one more level of the certificate
_FEW_LEFT: Final = 0.5  # share of more labels that are left, at which passes go on over these only
_RECORD: Final = 11  # passes that take as long as a record with combs, and two before it
_COMBS: Final = 5  # of these, the combs
_NEAR: Final = 100  # jumps left open by a level after which the combs of the next may leave few enough
_NEAR_SHARE: Final = 0.25  # of all jumps, the same on small grids

# Clusters
_CLUSTERS: Final = 24  # quads that become clusters, later half of them: a vortex' gap lies in few pixels
_CLUSTERS_OF_ALL: Final = 0.08  # the same as a share of all quads, if that is more
_STALLED: Final = 0.25  # share of the gap, left by half the spacing, above which there are more

# Fields
_MUCH_BETTER: Final = 1e-6  # share of the energy by which a better field becomes the centre
_CLOSED: Final = 0.95  # share of the time left for a search, whose last solve takes a little more
_ROUNDS: Final = 5  # rounds of the search without a limit of time

_ROUGH: Final = 1e-5  # gap, of 1 + energy, as if of which a first smaller one is rounded: few digits may do


@dataclass
class Termination:
    """When to end: a deadline, a request to stop, a sufficient gap, enough work.

    work: greatest number of labels; labels: those so far.
    """

    deadline: Deadline
    stop: IsOver
    gap: float
    work: float
    labels: int = 0

    def reason(self) -> str:
        """The limit that is met; empty when none is."""
        if self.stop():
            return "interrupted"
        if self.labels > self.work:
            return "work"
        return "time" if self.deadline.passed() else ""

    def reason_at(self, energy: float, bound: float) -> str:
        """As `reason`, with a sufficient gap. None is sufficient at a bound of 0, which proves nothing."""
        return "gap" if energy - bound <= self.gap * energy and bound > 0 else self.reason()

    def is_over(self, ahead: float = 0.0) -> bool:
        """Whether work has to end now, or within `ahead` seconds."""
        return bool(self.reason()) or self.deadline.left() <= ahead


@dataclass
class Descent:
    """A descent in the 2-norm, and its state: the best field, and the chain of levels that proves most."""

    better_field = staticmethod(better_field)

    norm: Norm
    instance: Instance
    best: CrossField
    ends: Termination
    crew: Crew
    seed: int
    jobs: int
    progress: Progress
    chain: Chain = field(default_factory=Chain)
    proven: Chain = field(default_factory=Chain)
    searches: int = 0
    took: float = 0.0  # seconds of the last chain
    tired: bool = False  # whether the last search ended because it found nothing for long

    @staticmethod
    def first_field(instance: Instance, _norm: Norm, start: CrossField | None, is_over: IsOver) -> CrossField:
        """The best of the first field, the user's field and, in time, the PolyVector start, each improved."""
        return start_fields(instance, start, is_over, polyvector_start)[0]

    def improve_field(self, field: CrossField, is_over: IsOver = never) -> CrossField:
        """The field, with jumps and angles improved."""
        return improved_field(field, stop=is_over)

    def first_level(self, centre: CrossField) -> Lattice:
        """The lattice of the first level round a field."""
        return Lattice.whole(centre, COARSEST)

    def energy(self, field: CrossField) -> float:
        """The energy that the proof is of."""
        return field.energy(self.norm).total

    @property
    def gap(self) -> float:
        """The difference between the least energy and the bound of the present chain."""
        return self.energy(self.best) - self.chain.bound

    def proof(self, seconds: float, ended: str) -> Proof:
        """The proof so far, with the levels that prove it; not checked."""
        bound, energy = min(self.proven.bound, self.energy(self.best)), self.energy(self.best)
        return Proof(
            field=self.best, energy=energy, bound=bound, forced=self.proven.forced, norm=self.norm,
            levels=tuple(self.proven.levels), seconds=seconds, ended=ended, arrays=self.proven.arrays,
        )  # fmt: skip

    def run(self) -> str:
        """Go through chains of levels until a limit is met or nothing helps; return the reason."""
        ended = ""
        try:
            while not ended or (ended == "labels" and self._search_on()):
                begin = time.monotonic()
                ended = self._go_through_levels()
                self.took = time.monotonic() - begin
        except MemoryError:
            ended = "memory"
        return self.ends.reason() or ended

    def _go_through_levels(self) -> str:
        """Go through the levels round the best field; the reason of the end, empty for a better field."""
        if reason := self.ends.reason():
            return reason
        centre = self.best
        dual = Dual(self.first_level(_centre_at(centre)), self.crew)
        self.chain = Chain(arrays=dual.lattice.centre_arrays())
        while True:
            self._add_clusters(dual)
            rising = self._raise_bound(dual)
            left = self._record_level(dual)
            if (reason := self._reason_to_end()) or left is None:
                return reason or "time"
            lattice = smaller_lattice(left) if rising else finer_lattice(left)
            better = self.energy(self.best) < self.energy(centre) * (1 - _MUCH_BETTER)
            if better and len(self.chain.last_of_spacings) <= _SETTLED:
                return self.ends.reason()
            if _is_too_large(dual, lattice) or not self._has_time_for(dual, lattice):
                return self.ends.reason() if better else "labels"
            dual.move(lattice)

    def _raise_bound(self, dual: Dual) -> bool:
        """Raise the dual of a level, and round fields from it, until the bound rises slowly.

        Returns whether it does not, but the gap has become so small that passes over fewer labels are worth a
        record.
        """
        rounding, reached, rises = Rounding(dual, self.better_field), -math.inf, [math.inf] * 2
        for _ in range(_MOST_ROUNDS):
            bound = dual.ascend(_PASSES, self.ends.is_over, lambda: self._is_closing(dual))
            self.best = rounding.lower(self.best, lambda: self._is_closing(dual))
            energy = self.energy(self.best)
            labels = int(dual.lattice.allowed.sum())
            self._report(max(self.proven.bound, min(bound, energy)), labels)
            rises = [rises[1], (bound - reached) / max(energy - bound, 1e-300)]
            if self._is_closing(dual) or self._is_exact(bound):
                break
            left = dual.count_left(bound, energy) / labels
            if max(rises) <= _slow_rise(left) and bound >= reached:
                break
            if labels > _FEW_LABELS and left <= _FEW_LEFT and self._has_time_for(dual, dual.lattice):
                return True  # passes over the labels that are left are worth a record of the level
            reached = bound
        return False

    def _record_level(self, dual: Dual) -> RemainingCells | None:
        """Record the level and, in time, prune it; return the cells that are left, None if there are none."""
        chain, energy = self.chain, self.energy(self.best)
        rough, left = _ROUGH * (1 + energy), None
        level, arrays = record_of(dual, energy, rough if self.gap > rough else 0.0)
        if level.bound > chain.bound or not self.ends.is_over():
            chain.add(level, arrays)
        if not self.ends.is_over():
            one, _ = dual.expected_seconds(dual.lattice)
            left = dual.remaining_cells(level.bound, energy, combs=not self.ends.is_over(_COMBS * one))
            if left.is_empty:
                chain.convex, left = energy, None
            else:
                self._try_last_step(left)
        if chain.levels and chain.bound >= self.proven.bound:  # without levels there is nothing to check
            self.proven = chain
        return left

    def _try_last_step(self, left: RemainingCells) -> None:
        """Count the jumps that are forced, and if nearly all are, try the last step."""
        chain, terms = self.chain, energy_terms(self.instance, self.norm)
        step = last_step_on(left, terms, self.best)
        chain.forced = int(has_forced_jump(terms, step.p, step.boxes).sum())
        if has_few_open(terms, step):
            energy = self.energy(self.best)
            minimum = minimise_on_boxes(self.instance, terms, step, energy, self.ends.is_over)
            convex = min(minimum.bound, energy)
            if convex > chain.bound:
                chain.convex = convex
                chain.arrays |= minimum.pieces
            if minimum.bound < energy:
                field = minimum.field
                better = field_in_windows(self.instance, field.alpha, field.beta, field.p)
                self.best = min(self.best, self.improve_field(better, self.ends.is_over), key=self.energy)

    def _add_clusters(self, dual: Dual) -> None:
        """Add clusters at the beginning of a spacing, if vortices cause the gap."""
        if self._needs_clusters(dual.lattice):
            dual.ascend(_PASSES, self.ends.is_over, lambda: self._is_closing(dual))
            count = max(_CLUSTERS, _CLUSTERS_OF_ALL * len(self.instance.grid.quads))
            dual.add_clusters(math.ceil(count / 2 if len(dual.quads) else count), self.best)

    def _needs_clusters(self, lattice: Lattice) -> bool:
        """Whether quads should become clusters on a lattice, which is the next one."""
        if not self.chain.levels or self.chain.levels[-1].h == lattice.h:
            return False
        gaps = [self.energy(self.best) - level.bound for level in self.chain.last_of_spacings[-2:]]
        vortex = len(gaps) == 1 and len(self.best.singularities.index) > 0
        stalled = len(gaps) == 2 and gaps[1] > _STALLED * gaps[0]
        return vortex or stalled

    def _search_on(self) -> bool:
        """Search for the time that no level uses; whether a better field is found in time for a chain."""
        while not self.ends.is_over():
            left = _CLOSED * self.ends.deadline.left()
            chain = left > 2 * self.took
            if self._search(left / 2 if chain else left) and chain:
                return True
            if self.tired or not chain or left == math.inf:
                break
        return False

    def _search(self, seconds: float, /) -> bool:
        """Whether a search of so many seconds, or for inf of some rounds, finds a better field."""
        timed, least = math.isfinite(seconds), self.energy(self.best)
        result = search(
            self.instance,
            limits=Limits().until(self.ends.deadline.within(seconds)) if timed else None,
            rounds=None if timed else _ROUNDS,
            seed=self.seed + self.searches,
            jobs=self.jobs,
            start=self.best,
            progress=lambda line: self.progress(f"search: {line}"),
            stop=self.ends.stop,
        )
        self.searches, self.tired = self.searches + 1, result.ended == "patience"
        self.best = min(self.best, result.field, key=self.energy)
        return self.energy(self.best) < least * (1 - _MUCH_BETTER)

    def _has_time_for(self, dual: Dual, lattice: Lattice) -> bool:
        """Whether there is time for a level on the next lattice: its record, and passes that take as long."""
        one, tables = dual.expected_seconds(lattice)
        return not self.ends.is_over(_RECORD * (2 * one + tables))

    def _is_closing(self, dual: Dual) -> bool:
        """Whether only the time to record the level is left."""
        one, tables = dual.expected_seconds(dual.lattice)
        passes = _RECORD if self._is_near_end(dual) else _RECORD - _COMBS
        return self.ends.is_over(passes * one + 2 * tables)

    def _is_near_end(self, dual: Dual) -> bool:
        """Whether the level before left so few jumps open that this one may be the last."""
        jumps = len(dual.lattice.p)
        return jumps - self.chain.forced <= min(_NEAR, _NEAR_SHARE * jumps)

    def _reason_to_end(self) -> str:
        """The reason why the work ends; empty if it goes on."""
        bound = self.proven.bound
        return "optimal" if self._is_exact(bound) else self.ends.reason_at(self.energy(self.best), bound)

    def _is_exact(self, bound: float) -> bool:
        energy = self.energy(self.best)
        return energy - bound <= EXACT * (1 + energy)

    def _report(self, bound: float, labels: int) -> None:
        """Report bound, least energy and remaining labels, and count the labels as work."""
        self.ends.labels += labels
        self.progress(f"energy {self.energy(self.best):.5g}, bound {bound:.5g}, {labels} labels")


def record_of(dual: Dual, energy: float, least_gap: float = 0.0) -> tuple[LevelFacts, Arrays]:
    """The level of a dual with its arrays; shares and tables are first rounded, as for that gap at least.

    Where the bound exceeds the energy, rounding costs a small part of the excess.
    """
    quanta = dual.quantise(max(abs(energy - dual.bound()), least_gap))
    return LevelFacts(dual.lattice.h, int(dual.lattice.allowed.sum()), dual.bound()), dual.arrays(quanta)


def _slow_rise(left: float) -> float:
    """The share of the gap below which a rise is slow: passes pay if the next level has many labels.

    left: share of the labels that is left.
    """
    return _SLOW / max(1.0, 4 * left) ** 2  # four labels at half the spacing for each one


def _is_too_large(dual: Dual, lattice: Lattice) -> bool:
    """Whether the next level of a dual is beyond what memory, checker or digits of an angle allow."""
    tables = int(table_sizes(lattice, dual.quads).sum())
    counts, grid = np.stack([lattice.alpha_count, lattice.beta_count], axis=1), lattice.instance.grid
    stored = int(lattice.allowed_count[np.minimum(grid.first, grid.second)].sum())
    return bool(
        int(lattice.start[-1]) + tables // _TABLE_NUMBERS > MOST_LABELS
        or counts.max() > MOST_COUNT
        or level_memory(counts, 0, 0) > memory_for(stored, _OF_SHARE)
        or lattice.h < np.pi / 2 / _FINEST
    )


def _centre_at(field: CrossField) -> CrossField:
    """The crosses of a field in the gauge `strokes`, with few digits and the best jump of each pair."""
    instance = field.instance.with_gauge("strokes")
    alpha, beta = (np.round(angle, _DECIMALS) for angle in (field.alpha, field.beta))
    return field_in_windows(instance, alpha, beta, free_jumps(instance, alpha, beta)[0])
