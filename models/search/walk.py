"""Iterated local search over the jumps of a patch: perturb, descend, keep lower points.

After a perturbation the walk is a short tabu search (Glover, ORSA J. Computing 1, 1989). Every step makes the
best change of one jump, uphill too, but not of a jump that has just changed, unless that gives a new lowest
point.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from ..field.field import CrossField
from ..instance.grid import Bools, Floats, Ints
from ..instance.instance import Instance
from ..processes.deadline import Deadline, Over
from ..smooth.systems import one_thread
from .landscape import STEPS, Landscape, Patch, Point
from .perturbations import Change, Perturbations

LOWER: Final = 1e-7
"""Energy by which a field has to be lower to count as better: less may be rounding."""

_FRUITLESS: Final = 4  # changes of one jump without a new lowest point that end a walk
_MOST_STEPS: Final = 1000  # of a walk; 5 to 60 are usual
_REST: Final = (4, 12)  # changes for which a jump stays fixed once it has changed


@dataclass(frozen=True, eq=False)
class Task:
    """A patch to explore from a field.

    x: angles (alpha, beta) of the whole field, shape (2n,); p: jumps, shape (m,); free: pixels of the patch,
    shape (n,); curve: number of the curve of each pixel, -1 without a stroke, shape (n,); perturbations:
    how many to try; seed: of their choice; deadline: when to end.
    """

    instance: Instance
    x: Floats
    p: Ints
    free: Bools
    curve: Ints
    perturbations: int
    seed: tuple[int, ...]
    deadline: Deadline


class Explored(NamedTuple):
    """The point of least energy, with the task's values outside the patch; None if none was 1e-7 lower.

    whole: whether all perturbations were tried; if not, the point depends on the clock.
    """

    better: Point | None
    whole: bool


def explore(task: Task) -> Explored:
    """Explore a patch; energies follow their definition, within all bounds of the angles.

    The same task gives the same field unless its deadline cuts it off. It runs on one thread, because sums
    over several threads end in other digits.
    """
    with one_thread(), suppress(np.linalg.LinAlgError):
        return _explore(task, task.deadline.passed)
    return Explored(None, whole=True)


def _explore(task: Task, over: Over) -> Explored:
    rng = np.random.default_rng(task.seed)
    patch = Patch.of(task.instance, task.free)
    land = Landscape(patch, task.x, task.p)
    home, perturbations = land.saved(), Perturbations(patch, task.curve)
    alpha, beta = np.split(task.x, 2)
    given = CrossField(task.instance, alpha, beta, task.p).energy().total
    # Solved in the patch alone, the angles may be lower already; jumps have to improve on that.
    least = min(given, land.point.energy)
    best: Point | None = None
    for _ in range(task.perturbations if len(patch.pairs) else 0):
        lower = _perturbed(land, perturbations.draw(rng, land.p), rng, home.energy - LOWER, over)
        if lower is not None and lower.point.energy < least - LOWER:
            land, home, best = lower, lower.saved(), lower.point
            least = best.energy
        elif over():
            break
        else:
            land.restore(home)
    return Explored(best, whole=not over())


def _perturbed(
    land: Landscape, perturbation: Change, rng: np.random.Generator, goal: float, over: Over
) -> Landscape | None:
    """The landscape at the lowest point below `goal` of the walk after a perturbation, computed anew.

    Rounding of many updates must not accumulate. None when there is no such point, or none that can be
    computed.
    """
    with suppress(np.linalg.LinAlgError):
        land.change(*perturbation)
        jumps = _walk(land, rng, goal, over)
        return None if jumps is None else Landscape(land.patch, land.angles, jumps)
    return None


def _walk(land: Landscape, rng: np.random.Generator, goal: float, over: Over) -> Ints | None:
    """The jumps (m,) of the lowest point below `goal` of a walk from the landscape's present state."""
    resting = np.zeros(len(land.patch.pairs), dtype=np.int64)
    low, found = land.energy, None
    fruitless = 0
    for now in range(1, _MOST_STEPS + 1):
        gains = land.gains()
        barred = (resting >= now) & (land.energy + gains >= low - LOWER)
        gains[barred] = np.inf
        row, pair = np.unravel_index(np.argmin(gains), gains.shape)
        if np.isinf(gains[row, pair]) or over():
            break
        land.change(np.array([pair]), STEPS[[row]])
        resting[pair] = now + rng.integers(*_REST)
        fruitless += 1
        if land.energy < low - LOWER:
            low, fruitless = land.energy, 0
        if land.energy < goal:
            goal, found = land.energy - LOWER, land.p.copy()
        if fruitless == _FRUITLESS:
            break
    return found
