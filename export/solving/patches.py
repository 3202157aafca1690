"""Large-neighbourhood search: patches of the grid are set free, all else fixed, and solved exactly.

A patch is what it is in models/search: pixels whose angles and jumps may change. Here the jumps to the pixels
round it may too, and where `search` walks over the jumps of some hundred pixels, this proves what is best on
some ten. Patches lie at random, round singularities and where the energy is high; once all of a size are
solved, they grow.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from ...models.errors import InputError
from ...models.field.field import CrossField
from ...models.formulations.problem import formulate, with_rest_fixed
from ...models.instance.grid import Bools, Ints
from ...models.processes.deadline import Deadline, Over, never
from ...models.processes.interruption import interruptible
from ...models.processes.side_by_side import side_by_side
from ...models.search.energy import LinearSolver
from ...models.search.excerpt import Excerpt, excerpt
from ...models.search.free_field import FreeField
from ...models.search.improvement import settle
from ...models.search.walk import LOWER
from ..solvers_table import DRIVEN
from .child import GRACE
from .job import Limits
from .local import solve

PATCH_SOLVERS: Final = {name: solver.patch for name, solver in DRIVEN.items() if solver.patch is not None}
"""For each solver of patches what it solves, and the side of the first patches."""

_WIDEST: Final = 8  # side at which a search ends: no solver here closes such a patch
_PATCHES: Final = 4  # a round
_SECONDS: Final = 5.0  # a patch
_SHORTEST: Final = 0.5  # seconds: with less no solver is started
_HAND_OVER: Final = 2 * GRACE  # seconds before the end at which solvers end: they may be late by their grace

PatchProgress = Callable[[int, float], object]
"""Is told how many patches are solved, and the least energy so far."""


@dataclass(frozen=True)
class PatchSearch:
    """The field; how many patches were solved, to the end, and to a lower energy; how the search ended.

    side: of the patches that were solved last, in pixels. ended: `time`, `interrupted`, or `patches`: all
    were solved, up to 8 x 8.
    """

    field: CrossField
    patches: int
    closed: int
    lower: int
    side: int
    ended: str


class _Task(NamedTuple):
    """A patch: the field round it, its free pixels (n,), solver, end of the search, folder for files."""

    field: CrossField
    free: Bools
    solver: str
    deadline: Deadline
    folder: Path


class _Found(NamedTuple):
    """What a solver made of a patch: where it lies, the field, and whether it was solved to the end."""

    piece: Excerpt
    field: CrossField | None
    closed: bool


def search_patches(
    field: CrossField,
    *,
    seconds: float | Deadline,
    solver: str = "bonmin",
    seed: int = 0,
    jobs: int = 2,
    progress: PatchProgress = lambda *_: None,
) -> PatchSearch:
    """A field of no more 2-norm energy than the given one, each step down found by a solver in one patch.

    solver: `bonmin` solves `miqp-exact`; `highs` solves `milp-mccormick`, whose jumps the QP then follows.
    seconds: when to end; jobs: processes. The seed decides on the first patches; how far each is solved, and
    so what follows, depends on time. Ctrl-C ends the search after the patches at hand, a second one at once.
    Raises InputError for limits that are not positive and for another solver.
    """
    if solver not in PATCH_SOLVERS:
        raise InputError(f"{solver!r} solves no patches; choose one of {', '.join(PATCH_SOLVERS)}")
    if (isinstance(seconds, int | float) and not seconds > 0) or jobs < 1:
        raise InputError("a search needs a positive number of seconds and of jobs")
    whole = Deadline.of(seconds)
    deadline = whole.later(-min(_HAND_OVER, whole.left() / 4))
    state = _State(field, PATCH_SOLVERS[solver].side, np.random.default_rng(seed))
    with tempfile.TemporaryDirectory(prefix="crossfield-", ignore_cleanup_errors=True) as folder:
        try:
            with interruptible() as interrupted, side_by_side(_solved, jobs) as explore:
                while not (ended := _ended(state, deadline, interrupted())):
                    tasks = [
                        _Task(state.field, free, solver, deadline, Path(folder)) for free in state.patches()
                    ]
                    state.take(tasks, explore(tasks), whole.passed)
                    progress(state.solved, state.energy)
        except KeyboardInterrupt:
            ended = "interrupted"
    return PatchSearch(state.field, state.solved, state.closed, state.lower, state.side, ended)


def _ended(state: _State, deadline: Deadline, interrupted: bool) -> str:
    """Why a search is over; empty when it goes on."""
    late = deadline.later(-_SHORTEST).passed()
    over = {"interrupted": interrupted, "patches": state.done, "time": late}
    return next((why for why, holds in over.items() if holds), "")


def _solved(task: _Task) -> _Found | None:
    """A patch, solved from the file that is written for it; None where there was no time for it."""
    deadline = task.deadline.within(_SECONDS)
    if deadline.later(-_SHORTEST).passed():
        return None
    piece = excerpt(task.field, task.free)
    formulation = PATCH_SOLVERS[task.solver].formulation
    problem = with_rest_fixed(formulate(piece.field.instance, formulation), piece.field, piece.free)
    limits = Limits(threads=1).until(deadline)
    with tempfile.TemporaryDirectory(dir=task.folder) as folder:
        found = solve(problem, task.solver, folder, limits=limits, start=piece.field)
    answer = None if found.point is None else found.field
    return _Found(piece, answer, found.status.startswith("optimal"))


class _State:
    """The field reached, and which patches of the present size are still to be solved."""

    def __init__(self, field: CrossField, side: int, rng: np.random.Generator) -> None:
        self.field = field
        self.energy = field.energy().total
        self.side = side
        self.solved = self.closed = self.lower = 0
        self.done = False
        self._rng = rng
        self._open = np.ones(field.instance.grid.size, bool)
        self._chosen: list[int] = []

    def patches(self) -> list[Bools]:
        """The free pixels (n,) of the next patches, apart from each other where there is room."""
        self._chosen = list(self._centres())
        return [self._within(centre, self.side) for centre in self._chosen]

    def _centres(self) -> Iterator[int]:
        """Pixels in the middle of patches: by energy, round singularities, at random, in turn."""
        open_ = self._open.copy()
        kinds = [self.field.pixel_energy, self._round_singularities(), np.ones(len(open_))]
        for number in range(_PATCHES):
            weight = np.where(open_, kinds[number % len(kinds)], 0.0)
            if not weight.any():
                weight = open_.astype(float)
            if not weight.any():
                return
            centre = int(self._rng.choice(len(open_), p=weight / weight.sum()))
            yield centre
            open_ &= ~self._within(centre, 2 * self.side + 2)

    def _round_singularities(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """1.0 at pixels whose patch holds a singularity, 0.0 at others."""
        found, grid = self.field.singularities, self.field.instance.grid
        near = np.zeros(grid.size)
        for row, column in zip(found.row, found.column, strict=True):
            near[self._square(row, column, self.side)] = 1.0
        return near

    def _within(self, centre: int, side: int) -> Bools:
        grid = self.field.instance.grid
        return self._square(grid.rows[centre], grid.columns[centre], side)

    def _square(self, row: int, column: int, side: int) -> Bools:
        """Pixels in a square of that side, its middle at or just before (row, column); shape (n,)."""
        grid, first = self.field.instance.grid, (side - 1) // 2
        off = np.stack([grid.rows - row, grid.columns - column])
        inside: Bools = np.all((off >= -first) & (off < side - first), axis=0)
        return inside

    def take(self, tasks: list[_Task], found: list[_Found | None], over: Over = never) -> None:
        """Take over what lowers the energy of the whole field, and note which patches are done with."""
        for centre, task, each in zip(self._chosen, tasks, found, strict=True):
            if each is None:
                continue
            self.solved += 1
            self.closed += each.closed
            self._open[centre] = False
            if each.field is not None and (each.field.p != each.piece.field.p).any():
                lower = self._try(each.piece.put_back(each.field, self.field), task.free, over)
                # Labels may have changed with another patch's answer: then this one is solved once more.
                self._open[centre] |= not lower and task.field is not self.field
        if not self._open.any():
            self._grow()

    def _grow(self) -> None:
        grid = self.field.instance.grid
        self.done = self.side >= min(_WIDEST, max(grid.height, grid.width))
        self.side += not self.done
        self._open[:] = True

    def _try(self, field: CrossField, free: Bools, over: Over) -> bool:
        """Whether a field, brought up to date, is lower: then go on from it, patches near by open again."""
        state = FreeField.of(field)
        settle(state, LinearSolver(), over)
        better = state.bounded(over)
        if better.energy().total < self.energy - LOWER:
            self.field, self.energy = better, better.energy().total
            self.lower += 1
            self._open |= self._reached(free)
            return True
        return False

    def _reached(self, free: Bools) -> Bools:
        """Pixels whose patch meets those that have changed."""
        grid = self.field.instance.grid
        rows, columns = grid.rows[free], grid.columns[free]
        off = np.stack([_outside(grid.rows, rows), _outside(grid.columns, columns)])
        near: Bools = np.all(off <= self.side, axis=0)
        return near


def _outside(places: Ints, of: Ints) -> Ints:
    """How far each place lies outside the range of the others."""
    outside: Ints = np.maximum(np.maximum(of.min() - places, places - of.max()), 0)
    return outside
