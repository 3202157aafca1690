"""Iterated local search over jumps: perturb, descend, keep lower points.

After a perturbation the walk is a short tabu search (Glover, ORSA J. Computing 1, 1989). Every step makes the
best change of one jump, uphill too, but not of a jump that has just changed, unless that gives a new lowest
point. Some walks turn one stroke after the other instead: where strokes of two families lie close together,
only many turns at once lower the energy.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, NamedTuple, TypeVar

import numpy as np

from ..instance.domain import Bools, Floats, Ints
from ..instance.instance import Instance
from ..orthogonal.energy import lowered
from ..processes.blas_threads import one_thread
from ..processes.deadline import Deadline, IsOver
from .box_qp import field_at
from .landscape import FieldPoint, IntegerLandscape, Landscape, Patch
from .perturbations import Change, Perturbations

below: Final = partial(lowered, share=1e-7)
"""The energy below which a field of a walk counts as lower than one of the given energy."""


_FRUITLESS_TURNS: Final = 12  # turns of one stroke without a new lowest point that end a walk
_PLAIN: Final = 4  # perturbations before each walk of turns
_MOST_STEPS: Final = 1000  # of a walk; 5 to 60 are usual
_REST: Final = (4, 12)  # changes for which a jump stays fixed once it has changed
_WIDEST: Final = 12.0  # pixels, radius of a disc
_TURNS: Final = 0.6  # share of turns


Land = TypeVar("Land", Landscape, IntegerLandscape)


@dataclass(frozen=True, eq=False)
class PatchTask:
    """A patch to explore from a field."""

    instance: Instance
    x: Floats  # angles (alpha, beta) of the whole field, (2n,)
    p: Ints
    free: Bools  # pixels of the patch
    curve: Ints  # number of the curve of each pixel, -1 without a stroke
    perturbations: int  # how many to try
    seed: tuple[int, ...]  # of their choice
    deadline: Deadline


class PatchResult(NamedTuple):
    """The point of least energy, with the task's values outside the patch; None if none was lower.

    complete: whether all perturbations were tried; if not, the point depends on the clock.
    """

    better: FieldPoint | None
    complete: bool


def explore(task: PatchTask) -> PatchResult:
    """Explore a patch on one thread: the same task gives the same point unless its deadline cuts it off."""
    with one_thread(), suppress(np.linalg.LinAlgError):
        return _explore(task, task.deadline.passed)
    return PatchResult(None, complete=True)


def _explore(task: PatchTask, is_over: IsOver) -> PatchResult:
    patch = Patch.of(task.instance, task.free)
    land = Landscape(patch, task.x, task.p)
    if not len(patch.pairs):
        return PatchResult(None, complete=not is_over())
    # Solved in the patch alone, the angles may be lower already; jumps have to improve on that.
    least = min(field_at(task.instance, task.x, task.p).energy().total, land.point.energy)
    turning = np.random.default_rng((*task.seed, 1)) if len(patch.strokes) else None
    lower, complete = explore_from(
        land,
        StrokePerturbations(patch, task.curve),
        np.random.default_rng(task.seed),
        least=least,
        count=task.perturbations,
        is_over=is_over,
        turning=turning,
    )
    return PatchResult(None if lower is None else lower.point, complete)


def explore_from(
    land: Land,
    perturbations: Perturbations,
    rng: np.random.Generator,
    *,
    least: float,
    count: int,
    is_over: IsOver,
    turning: np.random.Generator | None = None,
) -> tuple[Land | None, bool]:
    """The landscape at the lowest point of walks from perturbations of the lowest one; None if none is lower.

    least: energy to improve on. count: perturbations. turning: choices of walks that turn strokes. Also
    returns whether all were made; if not, the point depends on the clock.
    """
    home, best = land.save_state(), None
    for number in range(count):
        walks: list[Callable[[Any, float, IsOver], Ints | None]]
        walks = [partial(_walk_from, perturbations.draw(rng, land.offsets), rng)]
        if turning is not None and number % _PLAIN == 0:
            walks.append(partial(_walk_of_turns, turning))
        for walk in walks:
            lower = _lower_landscape(land, walk, is_over)
            if lower is not None and lower.bounded_energy < below(least):
                land = best = lower
                home, least = lower.save_state(), lower.bounded_energy
            elif is_over():
                return best, False
            else:
                land.restore(home)
    return best, not is_over()


def _lower_landscape(
    land: Land, walk: Callable[[Land, float, IsOver], Ints | None], is_over: IsOver
) -> Land | None:
    """The landscape at the lowest point of a walk; None if it finds no lower one."""
    with suppress(np.linalg.LinAlgError):
        jumps = walk(land, below(land.energy), is_over)
        # Computed anew, because rounding of many updates must not accumulate.
        return None if jumps is None else land.at(jumps)
    return None


def _walk_from(
    perturbation: Change,
    rng: np.random.Generator,
    land: Landscape | IntegerLandscape,
    goal: float,
    is_over: IsOver,
) -> Ints | None:
    """A walk that changes jumps after a perturbation."""
    land.change(*perturbation)
    return _walk(land, _Moves(land.gains, land.step, land.patience), rng, goal, is_over)


def _walk_of_turns(rng: np.random.Generator, land: Landscape, goal: float, is_over: IsOver) -> Ints | None:
    """A walk that turns strokes, the first one at random."""
    land.turn(int(rng.integers(len(land.patch.strokes))))
    turns = _Moves(lambda: land.turn_gains()[None], lambda _, stroke: land.turn(stroke), _FRUITLESS_TURNS)
    return _walk(land, turns, rng, goal, is_over)


class _Moves(NamedTuple):
    """Moves of a walk, by row and place of their gains. most: moves in vain that end it."""

    gains: Callable[[], Floats]
    make: Callable[[int, int], None]
    most: int


def _walk(
    land: Landscape | IntegerLandscape, moves: _Moves, rng: np.random.Generator, goal: float, is_over: IsOver
) -> Ints | None:
    """The jumps of the lowest point below `goal` of a walk from the landscape's present state."""
    low, jumps, fruitless, rest_until = land.energy, None, 0, dict[int, int]()
    for now in range(1, _MOST_STEPS + 1):
        gains = moves.gains()
        best = int(np.argmin(gains))
        if not land.energy + gains.flat[best] < below(low):
            if fruitless + 1 == moves.most:
                break
            gains[:, [place for place, end in rest_until.items() if end >= now]] = np.inf
            best = int(np.argmin(gains))
        row, place = divmod(best, gains.shape[1])
        if np.isinf(gains[row, place]) or is_over():
            break
        moves.make(row, place)
        rest_until[place] = now + int(rng.integers(*_REST))
        fruitless += 1
        if land.energy < below(low):
            low, fruitless = land.energy, 0
        if land.energy < goal:
            goal, jumps = below(land.energy), land.p.copy()
        if fruitless == moves.most:
            break
    return jumps


class StrokePerturbations(Perturbations):
    """Random changes of the jumps of a patch: also `turn`, which goes round a piece of a curve, or a disc.

    The strokes inside change to the other family of lines.
    """

    def __init__(self, patch: Patch, curve: Ints) -> None:
        """Prepare the patch; curve: number of the curve of each pixel, -1 without a stroke; shape (n,)."""
        grid = patch.instance.grid
        number = np.full(len(grid.first), -1, dtype=np.int32)
        number[patch.pairs] = np.arange(len(patch.pairs), dtype=np.int32)
        super().__init__(grid.rings.select(number), len(patch.pixels), patch.terms.first, patch.terms.second)
        self._patch, self._curve = patch, curve[patch.pixels]
        self._strokes = np.nonzero(self._curve >= 0)[0]
        self._row = grid.rows[patch.pixels].astype(np.float64)
        self._column = grid.columns[patch.pixels].astype(np.float64)

    def draw(self, rng: np.random.Generator, offsets: Floats) -> Change:
        """A random change at the present turns of labels, (e,)."""
        if rng.random() < _TURNS and len(self._strokes):
            change = self.turn(rng)
            if len(change[0]):
                return change
        return self.walk(rng, offsets) if len(self._rings.defect) else self.change_neighbours(rng)

    def turn(self, rng: np.random.Generator) -> Change:
        """The jumps round the strokes of a disc, of one curve or of all."""
        centre = int(rng.choice(self._strokes))
        radius = 0.5 * (2 * _WIDEST) ** rng.random()
        away = np.hypot(self._row - self._row[centre], self._column - self._column[centre])
        inside = (away <= radius) & (self._curve >= 0)
        if rng.random() < 0.7:
            inside &= self._curve == self._curve[centre]
        return self._patch.turn_steps(inside.astype(np.int32) * np.int32(rng.choice([-1, 1])))
