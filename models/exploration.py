"""A walk over the jumps of one window of the grid: kick, follow the valley down, keep what is lower (iterated local search).

After a kick the walk is a short tabu search (Glover, ORSA J. Computing 1, 1989): the best change of one jump at every step, uphill too, but
none of a jump that has just changed, unless that is the lowest point so far.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from .grid import Bools, Floats, Ints
from .instance import Instance
from .kicks import Kicks
from .landscape import STEPS, Landscape, Window

LOWER: Final = 1e-7
"""Energy by which a field has to be lower to count as better: less may be rounding."""

_FRUITLESS: Final = 4  # changes of one jump without a new lowest point that end a walk
_REST: Final = (4, 12)  # changes for which a jump stays as it is once it has changed


@dataclass(frozen=True, eq=False)
class Task:
    """A window to explore, from a field on.

    x: angles (alpha, beta) of the whole field, shape (2n,); p: jumps, shape (m,); free: pixels of the window, shape (n,);
    curve: number of the curve of each pixel, -1 without a stroke, shape (n,); kicks: how many to try; seed: of their choice.
    """

    instance: Instance
    x: Floats
    p: Ints
    free: Bools
    curve: Ints
    kicks: int
    seed: tuple[int, ...]


class Better(NamedTuple):
    """Angles (2n,) and jumps (m,) of lower energy; outside the window they are those of the task."""

    energy: float
    x: Floats
    p: Ints


def explore(task: Task) -> Better | None:
    """The field of least energy that was met, or None when none was lower than the given one by more than 1e-7.

    The same task gives the same field: on one thread, for the sums of several threads end in other digits.
    """
    with threadpool_limits(1, user_api="blas"):
        return _explore(task)


def _explore(task: Task) -> Better | None:
    rng = np.random.default_rng(task.seed)
    window = Window.of(task.instance, task.free)
    land = Landscape(window, task.x, task.p)
    given = home = land.saved()
    kicks = Kicks(window, task.curve)
    for _ in range(task.kicks if len(window.pairs) else 0):
        land.change(*kicks.draw(rng, land.p))
        lower = _walk(land, rng, home.energy - LOWER)
        if lower is None:
            land.restore(home)
        else:
            # Anew, so that the rounding of thousands of updates does not add up.
            land = Landscape(window, lower.x, lower.p)
            home = land.saved()
    return Better(home.energy, land.angles, home.p) if home.energy < given.energy - LOWER else None


def _walk(land: Landscape, rng: np.random.Generator, goal: float) -> Better | None:
    """The lowest point below `goal` of a walk from where the landscape stands."""
    resting = np.zeros(len(land.window.pairs), dtype=np.int64)
    low, found = land.energy, None
    fruitless = now = 0
    while fruitless < _FRUITLESS:
        gains = land.gains()
        barred = (resting > now) & (land.energy + gains >= low - LOWER)
        gains[barred] = np.inf
        row, pair = np.unravel_index(np.argmin(gains), gains.shape)
        land.change(np.array([pair]), STEPS[[row]])
        now += 1
        fruitless += 1
        resting[pair] = now + rng.integers(*_REST)
        if land.energy < low - LOWER:
            low, fruitless = land.energy, 0
        if land.energy < goal:
            goal, found = land.energy - LOWER, Better(land.energy, land.angles, land.p.copy())
    return found
