"""Iterated local search over jumps: perturb, descend, keep lower points.

After a perturbation the walk is a short tabu search (Glover, ORSA J. Computing 1, 1989). Every step makes the
best change of one jump, uphill too, but not of a jump that has just changed, unless that gives a new lowest
point.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Final, NamedTuple, TypeVar

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


_MOST_STEPS: Final = 1000  # of a walk; 5 to 60 are usual
_REST: Final = (4, 12)  # changes for which a jump stays fixed once it has changed


Land = TypeVar("Land", Landscape, IntegerLandscape)


@dataclass(frozen=True, eq=False)
class PatchTask:
    """A patch to explore from a field."""

    instance: Instance
    x: Floats  # angles (alpha, beta) of the whole field, (2n,)
    p: Ints
    free: Bools  # pixels of the patch
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
    perturbations, rng, count = perturbations_of(patch), np.random.default_rng(task.seed), task.perturbations
    lower, complete = explore_from(land, perturbations, rng, least=least, count=count, is_over=is_over)
    return PatchResult(None if lower is None else lower.point, complete)


def perturbations_of(patch: Patch) -> Perturbations:
    """The random changes of the jumps of a patch."""
    grid = patch.instance.grid
    number = np.full(len(grid.first), -1, dtype=np.int32)
    number[patch.pairs] = np.arange(len(patch.pairs), dtype=np.int32)
    return Perturbations(grid.rings.select(number), len(patch.pixels), patch.terms.first, patch.terms.second)


def explore_from(
    land: Land,
    perturbations: Perturbations,
    rng: np.random.Generator,
    *,
    least: float,
    count: int,
    is_over: IsOver,
) -> tuple[Land | None, bool]:
    """The landscape at the lowest point of walks from perturbations of the lowest one; None if none is lower.

    least: energy to improve on. count: perturbations. Also returns whether all were made; if not, the point
    depends on the clock.
    """
    home, best = land.save_state(), None
    for _ in range(count):
        lower = _lower_landscape(land, perturbations.draw(rng, land.offsets), rng, is_over)
        if lower is not None and lower.bounded_energy < below(least):
            land = best = lower
            home, least = lower.save_state(), lower.bounded_energy
        else:
            land.restore(home)
            if is_over():
                return best, False
    return best, not is_over()


def _lower_landscape(land: Land, change: Change, rng: np.random.Generator, is_over: IsOver) -> Land | None:
    """The landscape at the lowest point of a walk after a change; None if it finds no lower one."""
    with suppress(np.linalg.LinAlgError):
        goal = below(land.energy)
        land.change(*change)
        jumps = _walk(land, rng, goal, is_over)
        # Computed anew, because rounding of many updates must not accumulate.
        return None if jumps is None else land.at(jumps)
    return None


def _walk(
    land: Landscape | IntegerLandscape, rng: np.random.Generator, goal: float, is_over: IsOver
) -> Ints | None:
    """The jumps of the lowest point below `goal` of a walk from the landscape's present state."""
    low, jumps, fruitless, rest_until = land.energy, None, 0, dict[int, int]()
    for now in range(1, _MOST_STEPS + 1):
        gains = land.gains()
        best = int(np.argmin(gains))
        if not land.energy + gains.flat[best] < below(low):
            if fruitless + 1 == land.patience:
                break
            gains[:, [place for place, end in rest_until.items() if end >= now]] = np.inf
            best = int(np.argmin(gains))
        row, place = divmod(best, gains.shape[1])
        if np.isinf(gains[row, place]) or is_over():
            break
        land.step(row, place)
        rest_until[place] = now + int(rng.integers(*_REST))
        fruitless += 1
        if land.energy < below(low):
            low, fruitless = land.energy, 0
        if land.energy < goal:
            goal, jumps = below(land.energy), land.p.copy()
        if fruitless == land.patience:
            break
    return jumps
