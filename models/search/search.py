"""A search for a field of low 2-norm energy: from the best start downwards, patch by patch, on all cores.

Every round explores some patches of the grid (models/search/walk.py) with all else fixed and adopts lower
points; angles and jumps of the whole grid follow from time to time. A small grid is one patch. On one kind of
processor the field at the end of a round depends only on instance and seed, unless a time limit runs out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ..arguments import check_count
from ..field.field import CrossField
from ..instance.domain import Bools
from ..instance.instance import Instance
from ..instance.sparse_systems import SimilarSystems
from ..orthogonal.energy import OrthogonalEnergy, lowered, takes_integers
from ..processes.blas_threads import one_thread
from ..processes.deadline import Deadline, IsOver, Progress, Stop, never, silent, stop_function
from ..processes.job_counts import check_jobs
from ..processes.limits import Limits
from ..processes.process_groups import catch_interrupts
from ..processes.process_pool import parallel_map
from ..smooth.polyvector import power_field
from .box_qp import FreeField, stroke_bounds
from .improvement import settle
from .integer_fields import finish_field, have_energies_of_fields, starting_integers
from .integer_search import IntegerSearch
from .landscape import FieldPoint
from .starts import polyvector_start, rounded_energy, start_fields
from .stroked_parts import extended, restricted, stroked_parts
from .walk import PatchResult, PatchTask, below, explore

Explorers = Callable[[list[PatchTask]], list[PatchResult]]
"""Explores patches in parallel and returns the results in the order of the tasks."""

_PATCH: Final = 320  # pixels; its matrix has 640 rows, and a change of one jump costs 0.3 ms
_PATCHES: Final = 4  # per round
_KICKS: Final = 40  # per patch
_APART: Final = 3  # rounds on a small grid in which each patch is explored from a start of its own
_SETTLE: Final = 8  # rounds between two improvements of the whole grid
_PATIENCE: Final = 200  # perturbations per pixel without success that end a search
_ALONE: Final = 64  # pixels up to which starting processes would take longer than the search
_HURRY: Final = 5.0  # seconds; with less, starting processes would take a good part of them
_CLOSING: Final = (0.05, 0.5)  # share of the seconds, and seconds, for the last solve after the deadline


@dataclass(frozen=True)
class Search:
    """Result of a search.

    Parameters
    ----------
    field
        The field of lowest energy.
    rounds
        Number of complete rounds.
    energies
        Round and energy of every improvement; of the first and the best field alone where integers are
        searched and beta is free or windows may bind, because integers then have energies of their own.
    ended
        `time`, `rounds`, `patience` (no improvement for long) or `interrupted`.

    """

    field: CrossField
    rounds: int
    energies: tuple[tuple[int, float], ...]
    ended: str


@one_thread()
def search(
    instance: Instance,
    *,
    limits: Limits | None = None,
    rounds: int | None = None,
    seed: int = 0,
    jobs: int = 2,
    start: CrossField | None = None,
    progress: Progress = silent,
    stop: Stop | None = None,
) -> Search:
    """Search for a field of low 2-norm energy, from the greedy field and other starts.

    The result has at most the energy of `start` and, if time allows, of the first field. On up to 400 pixels,
    the first three rounds explore from all starts, and the later ones from the best field.

    Orthogonal crosses, and all crosses on meshes, are searched as integers, in one process: 500 perturbations
    per round, each followed by a descent over single jumps. A search with beta free then fits it once.

    Without a time limit the same instance, seed and rounds give the same field on the same kind of processor,
    for any number of jobs. Ctrl-C ends the search with the best field so far.

    Parameters
    ----------
    instance
        The instance.
    limits
        Time limit. All work keeps to it, the start too. One step of it may exceed the limit (on a grid of
        100 x 100 one second), and the last solve by 5 % and half a second. None: no time limit.
    rounds
        Number of rounds after which to end. With neither rounds nor a time limit the search ends after 200
        perturbations per pixel without success.
    seed
        Seed of all random choices.
    jobs
        Number of processes.
    start
        A field to begin with where, improved, it is lower than the other starts.
    progress
        Receives a line of text after every round.
    stop
        A function that returns whether to stop, or an event. The best field so far is then returned.

    Returns
    -------
    Search
        The field, the number of rounds, the improvements, and why the search ended.

    Raises
    ------
    InputError
        For a negative number of rounds, and for too few or too many jobs.
    InstanceError
        For a start on another instance, and where no field is found that has the prescribed indices.

    """
    asked = stop_function(stop)
    if rounds is not None:
        check_count("rounds", rounds)
    check_count("seed", seed)
    check_jobs(jobs)
    start = None if start is None else start.on_instance(instance)
    with catch_interrupts() as pressed:
        deadline = (limits or Limits(math.inf)).deadline()
        ends = _Ends(deadline, rounds, lambda: pressed() or asked())
        closing = _closing_limit(deadline)
        if takes_integers(instance):
            return _search_integers(instance, seed, start, ends, progress)
        part = stroked_parts(instance)  # the others are constant and cost nothing
        starts = start_fields(
            instance, start, ends.is_over, polyvector_start, lambda one, _: power_field(one)
        )
        hunt = _Hunt(part, seed, [restricted(field, part) for field in starts])
        alone = part.grid.size <= _ALONE or deadline.left() < _HURRY
        try:
            with parallel_map(explore, 1 if alone else jobs) as explorers:
                ended = hunt.run(explorers, ends, progress)
        except KeyboardInterrupt:
            ended = "interrupted"
        return _result(extended(hunt.best(closing()), instance), hunt.round, hunt.energies, ended)


def _search_integers(
    instance: Instance, seed: int, start: CrossField | None, ends: _Ends, progress: Progress
) -> Search:
    """Search over the integers of orthogonal crosses, from the power field, the greedy field and `start`."""
    closing, energy, sooner = (
        _closing_limit(ends.deadline),
        OrthogonalEnergy.of(instance),
        ends.sooner().is_over,
    )
    starts = starting_integers(instance, energy, start, sooner)
    hunt = IntegerSearch(energy, instance.domain.rings, starts, seed)
    fields, is_exact = [start] if start else [], have_energies_of_fields(instance)
    kind = "energy" if is_exact else "energy with right angles"
    if not is_exact:
        fields.append(finish_field(instance, energy, hunt.best.p, sooner))
    energies = [(0, hunt.best.bounded_energy if is_exact else min(field.energy().total for field in fields))]
    while not (ended := ends.reason_to_end(hunt.round)):
        if hunt.fruitless > _PATIENCE * energy.size:
            ended = "patience"
            break
        hunt.explore(ends.is_over)
        if is_exact and hunt.best.bounded_energy < energies[-1][1]:
            energies.append((hunt.round, hunt.best.bounded_energy))
        progress(f"{kind} {hunt.best.bounded_energy:.5g} after {hunt.round} rounds")
    fields.append(finish_field(instance, energy, hunt.best.p, closing()))
    return _result(min(fields, key=rounded_energy), hunt.round, energies, ended)


def _result(field: CrossField, rounds: int, energies: list[tuple[int, float]], ended: str) -> Search:
    """The result of a search, whose last solve may lower the energy once more."""
    if (total := field.energy().total) < lowered(energies[-1][1]):
        energies = [*energies, (rounds, total)]
    return Search(field, rounds, tuple(energies), ended)


def _closing_limit(deadline: Deadline) -> Callable[[], IsOver]:
    """End of the last solve, counted from the end of the search, or from a deadline before that."""
    share, more = _CLOSING
    seconds = share * deadline.left() + more
    return lambda: deadline.within(0.0).later(seconds).passed if np.isfinite(seconds) else never


@dataclass(frozen=True)
class _Ends:
    """When to end: a deadline, rounds, and whether user or caller ask for it."""

    deadline: Deadline
    rounds: int | None
    interrupted: Callable[[], bool]

    def reason_to_end(self, rounds: int) -> str:
        """The limit that is met after that many rounds; empty when none is."""
        if self.interrupted():
            return "interrupted"
        if rounds == self.rounds:
            return "rounds"
        return "time" if self.deadline.passed() else ""

    def sooner(self) -> _Ends:
        """The limits of starts, which leave half of the time."""
        return replace(self, deadline=self.deadline.share(0.5))

    def is_over(self) -> bool:
        """Whether work has to end now, even in the middle of a round."""
        return self.interrupted() or self.deadline.passed()


class _Hunt:
    """The present field of a search, and its next trials."""

    def __init__(self, instance: Instance, seed: int, starts: list[CrossField]) -> None:
        """Begin at the first and lowest of the starts; on a small grid, explore from the others, too."""
        start, self._apart = starts[0], [FreeField.of(field) for field in starts]
        self.round = 0
        self.fruitless = 0
        self.energies = [(0, start.energy().total)]
        self._instance = instance
        self._seed = seed
        self._start = start
        self._state = FreeField.of(start)
        self._bounds = stroke_bounds(instance)
        self._solver = SimilarSystems()
        self._unsettled = False

    def best(self, is_over: IsOver) -> CrossField:
        """The field of least energy so far."""
        self._settle(is_over)
        return min(self._state.fit_in_bounds(is_over), self._start, key=rounded_energy)

    @property
    def is_large(self) -> bool:
        """Whether the grid is more than one patch."""
        return self._instance.grid.size > _PATCH * 5 // 4

    @property
    def _explores_starts(self) -> bool:
        """Whether this round explores from several starts."""
        return not self.is_large and self.round < _APART

    def run(self, explorers: Explorers, ends: _Ends, progress: Progress) -> str:
        """Explore until a limit is met; return which one."""
        while not (ended := ends.reason_to_end(self.round)):
            if self.fruitless > _PATIENCE * self._instance.grid.size:
                return "patience"
            tasks = self.tasks(ends.deadline)
            results = explorers(tasks)
            self._adopt_results(tasks, [result.better for result in results], ends.is_over)
            if all(result.complete for result in results) and not ends.is_over():
                self.round += 1
            progress(f"energy {self.energies[-1][1]:.5g} after {self.round} rounds")
        return ended

    def tasks(self, deadline: Deadline) -> list[PatchTask]:
        """The tasks of this round, with their deadline."""
        rng = np.random.default_rng((self._seed, self.round))
        patches = zip(self._states_to_explore(), self._patches(rng), strict=True)
        return [
            PatchTask(self._instance, at.x, at.p, free, _KICKS, (self._seed, self.round, number), deadline)
            for number, (at, free) in enumerate(patches)
        ]

    def _states_to_explore(self) -> list[FreeField]:
        """The fields from which the patches of this round are explored."""
        if not self._explores_starts:
            return [self._state] * _PATCHES
        first = self.round * _PATCHES
        return [self._apart[number % len(self._apart)] for number in range(first, first + _PATCHES)]

    def _patches(self, rng: np.random.Generator) -> Iterator[Bools]:
        """The patches of a round, alternately around pixels of high energy and others."""
        grid = self._instance.grid
        if not self.is_large:
            yield from [np.ones(grid.size, dtype=bool)] * _PATCHES
            return
        high = self._state.field.pixel_energy + 1e-12
        for number in range(_PATCHES):
            centre = rng.choice(grid.size, p=high / high.sum() if number % 2 else None)
            away = (grid.rows - grid.rows[centre]) ** 2 + (grid.columns - grid.columns[centre]) ** 2
            yield away <= np.partition(away, _PATCH)[_PATCH]

    def _adopt_results(
        self, tasks: list[PatchTask], points: list[FieldPoint | None], is_over: IsOver
    ) -> None:
        """Adopt lower points, the lowest first, and update the whole grid now and then."""
        self.fruitless += _KICKS * len(tasks)
        if self._explores_starts:
            self._adopt_in_starts(points)
        else:
            lower = [(task, better) for task, better in zip(tasks, points, strict=True) if better is not None]
            for task, better in sorted(lower, key=lambda pair: pair[1].energy):
                self._adopt(task, better, is_over)
        if self._unsettled and ((self.round + 1) % _SETTLE == 0 or not self.is_large):
            self._settle(is_over)

    def _adopt_in_starts(self, points: list[FieldPoint | None]) -> None:
        """Adopt lower points in the fields that were explored, and the lowest of these."""
        for at, better in zip(self._states_to_explore(), points, strict=True):
            if better is not None and better.energy < at.energy:
                at.x, at.p = np.clip(better.x, *self._bounds), better.p
        best = min(self._apart, key=lambda at: at.energy)
        if best.energy < below(self._state.energy):
            self._state = FreeField(self._instance, best.alpha, best.beta, best.p)
            self._unsettled, self.fruitless = True, 0
            self.energies.append((self.round, best.energy))

    def _adopt(self, task: PatchTask, better: FieldPoint, is_over: IsOver) -> None:
        """Adopt a patch's angles and jumps if they lower the energy together with other adopted patches."""
        state = self._state
        trial = FreeField(
            self._instance, state.alpha, state.beta, np.where(better.p != task.p, better.p, state.p)
        )
        inside = np.concatenate([task.free, task.free])
        trial.x = np.clip(np.where(inside, better.x, state.x), *self._bounds)
        if not self.is_large and trial.energy >= below(state.energy):
            # Other patches were adopted in the same place: the angles for all new jumps are neither's.
            trial.x = state.x
            settle(trial, self._solver, is_over)
        if trial.energy < below(state.energy):
            self._state, self._unsettled, self.fruitless = trial, True, 0
            self.energies.append((self.round, trial.energy))

    def _settle(self, is_over: IsOver) -> None:
        """Update angles and jumps of the whole grid."""
        if self._unsettled:
            settle(self._state, self._solver, is_over)
            self._unsettled = False
            self.energies.append((self.round, self._state.energy))
