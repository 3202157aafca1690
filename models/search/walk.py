"""Iterated local search over the jumps of a patch: perturb, descend, keep lower points.

After a perturbation the walk is a short tabu search (Glover, ORSA J. Computing 1, 1989). Every step makes the
best change of one jump, uphill too, but not of a jump that has just changed, unless that gives a new lowest
point. Some walks turn one stroke after the other instead: where strokes of two families lie close together,
only many turns at once lower the energy.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Final, NamedTuple

import numpy as np

from ..instance.domain import Bools, Floats, Ints
from ..instance.instance import Instance
from ..orthogonal.energy import lowered
from ..processes.blas_threads import one_thread
from ..processes.deadline import Deadline, Over
from .box_qp import field_at
from .landscape import STEPS, FieldPoint, Landscape, Patch

Change = tuple[Ints, Ints]
"""Local numbers of pairs of a patch, each at most once, and the steps that are added to their jumps."""

below: Final = partial(lowered, share=1e-7)
"""The energy below which a field of a walk counts as lower than one of the given energy."""


_FRUITLESS: Final = 4  # changes of one jump without a new lowest point that end a walk
_FRUITLESS_TURNS: Final = 12  # turns of one stroke
_PLAIN: Final = 4  # perturbations before each walk of turns
_MOST_STEPS: Final = 1000  # of a walk; 5 to 60 are usual
_REST: Final = (4, 12)  # changes for which a jump stays fixed once it has changed
_LONGEST: Final = 16  # quads of a path
_WIDEST: Final = 12.0  # pixels, radius of a disc
_TURNS: Final = 0.6  # share of turns
_SIDES: Final = (1, 1, -1, -1)  # signs of the pairs of a quad on its counter-clockwise walk


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


def _explore(task: PatchTask, over: Over) -> PatchResult:
    rng, turning = np.random.default_rng(task.seed), np.random.default_rng((*task.seed, 1))
    patch = Patch.of(task.instance, task.free)
    land = Landscape(patch, task.x, task.p)
    home, perturbations = land.save_state(), Perturbations(patch, task.curve)
    energy_before = field_at(task.instance, task.x, task.p).energy().total
    # Solved in the patch alone, the angles may be lower already; jumps have to improve on that.
    least = min(energy_before, land.point.energy)
    best: FieldPoint | None = None
    for number in range(task.perturbations if len(patch.pairs) else 0):
        trials = [partial(_walk_from_perturbation, perturbations.draw(rng, land.p), rng)]
        if number % _PLAIN == 0 and len(patch.strokes):
            trials.append(partial(_walk_of_turns, turning))
        for trial in trials:
            lower = _lower_landscape(land, trial, below(home.energy), over)
            if lower is not None and lower.point.energy < below(least):
                land, home, best = lower, lower.save_state(), lower.point
                least = best.energy
            elif over():
                return PatchResult(best, complete=False)
            else:
                land.restore(home)
    return PatchResult(best, complete=not over())


Trial = Callable[[Landscape, float, Over], Ints | None]
"""A walk from a landscape: the jumps (m,) of its lowest point below a goal; None without one."""


def _lower_landscape(land: Landscape, trial: Trial, goal: float, over: Over) -> Landscape | None:
    """The landscape at the lowest point below `goal` that a trial finds; None without one."""
    with suppress(np.linalg.LinAlgError):
        jumps = trial(land, goal, over)
        # Computed anew, because rounding of many updates must not accumulate.
        return None if jumps is None else Landscape(land.patch, land.angles, jumps)
    return None


def _walk_from_perturbation(
    perturbation: Change, rng: np.random.Generator, land: Landscape, goal: float, over: Over
) -> Ints | None:
    """A walk that changes jumps after a perturbation."""
    land.change(*perturbation)
    return _walk(land, rng, goal, over)


def _walk_of_turns(rng: np.random.Generator, land: Landscape, goal: float, over: Over) -> Ints | None:
    """A walk that turns strokes, the first one at random."""
    land.turn(int(rng.integers(len(land.patch.strokes))))
    return _walk(land, rng, goal, over, turning=True)


def _walk(
    land: Landscape, rng: np.random.Generator, goal: float, over: Over, *, turning: bool = False
) -> Ints | None:
    """The jumps (m,) of the lowest point below `goal` of a walk from the landscape's present state."""
    resting = np.zeros(len(land.patch.strokes if turning else land.patch.pairs), dtype=np.int64)
    low, jumps = land.energy, None
    fruitless = 0
    for now in range(1, _MOST_STEPS + 1):
        gains = land.turn_gains()[None] if turning else land.gains()
        barred = (resting >= now) & (land.energy + gains >= below(low))
        gains[barred] = np.inf
        row, place = np.unravel_index(np.argmin(gains), gains.shape)
        if np.isinf(gains[row, place]) or over():
            break
        if turning:
            land.turn(int(place))
        else:
            land.change(np.array([place]), STEPS[[row]])
        resting[place] = now + rng.integers(*_REST)
        fruitless += 1
        if land.energy < below(low):
            low, fruitless = land.energy, 0
        if land.energy < goal:
            goal, jumps = below(land.energy), land.p.copy()
        if fruitless == (_FRUITLESS_TURNS if turning else _FRUITLESS):
            break
    return jumps


class Perturbations:
    """Random changes of several jumps at once, to leave a valley that single changes do not leave.

    `shift` follows a path of quads and moves the turn at its start to its end: a singularity moves, two
    opposite ones meet, or a pair of them is created. `turn` goes round a piece of a curve, or a disc: the
    strokes inside change to the other family of lines.
    """

    def __init__(self, patch: Patch, curve: Ints) -> None:
        """Prepare the patch; curve: number of the curve of each pixel, -1 without a stroke; shape (n,)."""
        instance = patch.instance
        self._patch = patch
        local = np.full(len(instance.grid.first), -1)
        local[patch.pairs] = np.arange(len(patch.pairs))
        quads = local[instance.grid.quads]
        self._quads = quads[(quads >= 0).all(axis=1)]
        # The quads with each pair at bottom or right [0], and at top or left [1], or -1.
        self._beside = np.full((len(patch.pairs), 2), -1)
        for side in range(4):
            self._beside[self._quads[:, side], int(side >= 2)] = np.arange(len(self._quads))
        self._curve = curve[patch.pixels]
        self._strokes = np.nonzero(self._curve >= 0)[0]
        self._row = instance.grid.rows[patch.pixels].astype(np.float64)
        self._column = instance.grid.columns[patch.pixels].astype(np.float64)

    def draw(self, rng: np.random.Generator, p: Ints) -> Change:
        """A random change for the present jumps p (m,); never an empty one if the patch has a quad."""
        kind = rng.random()
        change = self.turn(rng) if kind < _TURNS and len(self._strokes) else self.shift(rng, p)
        return change if len(change[0]) else self.shift(rng, p)

    def shift(self, rng: np.random.Generator, p: Ints) -> Change:
        """The jumps along a random path of quads, which starts at a singularity every other time."""
        if not len(self._quads):
            pair = rng.integers(len(self._patch.pairs), size=1, dtype=np.int32)
            return pair, rng.choice(np.array([-1, 1], dtype=np.int32), size=1)
        turns = p[self._patch.pairs[self._quads]] @ np.array(_SIDES)
        singular = np.nonzero(turns)[0]
        if len(singular) and rng.random() < 0.5:
            quad = int(rng.choice(singular))
            direction = -int(np.sign(turns[quad]))
        else:
            quad = int(rng.integers(len(self._quads)))
            direction = int(rng.choice([-1, 1]))
        return self._path(rng, quad, direction)

    def _path(self, rng: np.random.Generator, quad: int, direction: int) -> Change:
        """The jumps of a path from a quad that change its turn by `direction`."""
        steps: Counter[int] = Counter()
        side = int(rng.integers(4))
        for _ in range(int(_LONGEST ** rng.random())):
            pair = int(self._quads[quad, side])
            steps[pair] += direction * _SIDES[side]
            quad = int(self._beside[pair, int(side < 2)])
            if quad < 0:  # the border of the patch: the turn has left
                break
            if rng.random() < 0.3:
                side = int(rng.integers(4))
        nonzero = {pair: step for pair, step in steps.items() if step}
        return np.array(list(nonzero), dtype=np.int32), np.array(list(nonzero.values()), dtype=np.int32)

    def turn(self, rng: np.random.Generator) -> Change:
        """The jumps round the strokes of a disc, of one curve or of all."""
        centre = int(rng.choice(self._strokes))
        radius = 0.5 * (2 * _WIDEST) ** rng.random()
        away = np.hypot(self._row - self._row[centre], self._column - self._column[centre])
        inside = (away <= radius) & (self._curve >= 0)
        if rng.random() < 0.7:
            inside &= self._curve == self._curve[centre]
        return self._patch.turn_steps(inside.astype(np.int32) * np.int32(rng.choice([-1, 1])))
