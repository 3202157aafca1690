"""Search for integers of low energy: perturb, descend over single integers, keep what is lower.

A perturbation changes what a field is made of: a singularity walks to another ring, a pair of opposite ones
appears, the crosses turn round a handle or a hole, or integers of neighbouring rows change. Where
perturbations fail for long, the search begins again: at the next start, after the last one at random angles.
"""

from __future__ import annotations

from collections import Counter
from typing import Final, NamedTuple

import numpy as np
from scipy.sparse.csgraph import breadth_first_order

from ..instance.angles import HALF
from ..instance.domain import Floats, Ints, Rings
from ..processes.deadline import Over
from .energy import MOST_DENSE, OrthogonalEnergy, lowered

_KICKS: Final = 500  # perturbations per round
_TIRED: Final = 1  # perturbations per point without success after which the search begins again
_PATCH: Final = 1500  # points; a change of one integer costs 30 microseconds
_ROWS: Final = 0.3  # share of the perturbations that change neighbouring rows
_NEIGHBOURS: Final = 5  # such rows, at most
_LOOPS: Final = 0.1  # share of the perturbations that follow a closed path of rings
_LONGEST: Final = 24  # rings of a walk
_SINGULAR: Final = 0.7  # share of the walks that begin at a singularity


class Point(NamedTuple):
    """Integers (r,), the residuals (r,) of their best angles, and the energy."""

    z: Ints
    residual: Floats
    total: float

    @classmethod
    def of(cls, energy: OrthogonalEnergy, z: Ints) -> Point:
        """The point of these integers."""
        residual = energy.residuals(energy.fit_angles(z), z)
        return cls(z, residual, energy.total(residual))


class IntegerSearch:
    """A search from several starts: `best` so far, number of complete rounds, and perturbations in vain."""

    def __init__(self, energy: OrthogonalEnergy, rings: Rings, starts: list[Ints], seed: int) -> None:
        """Begin at the lowest of the starts, which are integers (r,)."""
        self._energy, self._rings, self._seed = energy, rings, seed
        self._starts = sorted((Point.of(energy, z) for z in starts), key=lambda point: -point.total)
        self.best = self._present = self._starts.pop()
        self._moves = _Moves(energy, rings) if energy.size <= MOST_DENSE else None
        self.round = self.fruitless = self._tired = 0

    def explore(self, over: Over) -> None:
        """Try 500 perturbations, with more than 6,000 points within 1,500 of them; return early if over."""
        rng = np.random.default_rng((self._seed, self.round))
        if self._moves is None:
            point = self._explore_patch(rng, over) if len(self.best.z) else self.best
        else:
            if self._tired > _TIRED * self._energy.size:
                self._present, self._tired = self._begin_again(rng, over), 0
            point = self._moves.lower(self._present, rng, over)
        self._tired = 0 if point.total < lowered(self._present.total) else self._tired + _KICKS
        self.fruitless = 0 if point.total < lowered(self.best.total) else self.fruitless + _KICKS
        self._present = point
        self.best = self.best if self.fruitless else point
        self.round += not over()

    def _begin_again(self, rng: np.random.Generator, over: Over) -> Point:
        if self._starts:
            return self._starts.pop()
        z = self._energy.nearest(rng.uniform(0, HALF, self._energy.size))
        return Point.of(self._energy, self._energy.descend(z, over)[0])

    def _explore_patch(self, rng: np.random.Generator, over: Over) -> Point:
        """Explore the points nearest to a row, alternately a random one and one of high energy."""
        energy, (z, residual, total) = self._energy, self._present
        share = energy.weight * residual**2 / total if self.round % 2 and lowered(total) > 0 else None
        row = rng.choice(len(z), p=share)
        near = breadth_first_order(energy.links, energy.first[row], directed=False)[0][:_PATCH]
        patch, rows = energy.restrict(near, energy.fit_angles(z))
        inside = np.maximum(patch.first, patch.second) < patch.size
        local = np.full(len(z), -1, dtype=np.int32)
        local[rows[inside]] = np.nonzero(inside)[0]
        z = z.copy()
        z[rows] = _Moves(patch, self._rings.select(local)).lower(Point.of(patch, z[rows]), rng, over).z
        return Point.of(energy, z)


class _Moves:
    """Descents, and random changes of several integers to leave a valley that single steps do not leave."""

    def __init__(self, energy: OrthogonalEnergy, rings: Rings) -> None:
        """Prepare an energy; rings: of its rows."""
        self._energy, self._rings = energy, rings
        # The ring that goes along a row from its first point to its second one [0], and back [1], or -1.
        self._beside = np.full((len(energy.first), 2), -1)
        ring = np.repeat(np.arange(len(rings.defect)), np.diff(rings.start))
        self._beside[rings.pair, (rings.sign < 0).astype(int)] = ring
        by_point = abs(energy.matrix).tocsc()
        self._start, self._at_point = by_point.indptr, by_point.indices

    def lower(self, point: Point, rng: np.random.Generator, over: Over) -> Point:
        """The lowest point of a descent from this one, and of descents from the perturbed lowest one."""
        for kick in range(_KICKS + 1):
            if over():
                break
            start = self.perturb(rng, point.z, point.residual) if kick else point[:2]
            z, residual = self._energy.descend(start[0], over, start[1])
            total = self._energy.total(residual)
            if total < lowered(point.total):
                point = Point(z, residual, total)
        return Point.of(self._energy, point.z)  # rounding of many steps must not accumulate

    def perturb(self, rng: np.random.Generator, z: Ints, residual: Floats) -> tuple[Ints, Floats]:
        """Integers after a random change, and the residuals of their best angles."""
        steps: Counter[int] = Counter()
        if not len(z):
            return z, residual
        kind = rng.random()
        if not len(self._rings.defect) or kind < _ROWS:
            self._change_neighbours(rng, steps)
        elif kind < _ROWS + _LOOPS:
            self._turn_inside(rng, steps)
        else:
            self._walk(rng, z, steps)
        rows, change = np.array(list(steps), dtype=np.int32), np.array(list(steps.values()), dtype=np.int32)
        z = z.copy()
        z[rows] += change
        return z, self._energy.step_residuals(residual, rows, change)

    def _change_neighbours(self, rng: np.random.Generator, steps: Counter[int]) -> None:
        """Change up to five rows by 1, each one at a point of the last one."""
        ends, row = (self._energy.first, self._energy.second), int(rng.integers(len(self._energy.first)))
        for _ in range(int(rng.integers(1, _NEIGHBOURS + 1))):
            steps[row] += int(rng.choice((-1, 1)))
            point = rng.choice([end[row] for end in ends if end[row] < self._energy.size])
            row = int(self._at_point[rng.integers(self._start[point], self._start[point + 1])])

    def _turn_inside(self, rng: np.random.Generator, steps: Counter[int]) -> None:
        """Change the rows that a random closed path of rings crosses, for example around a handle."""
        rings, path, row = self._rings, dict[int, tuple[int, int]](), -1
        ring, quarter = int(rng.integers(len(rings.defect))), int(rng.choice((-1, 1)))
        while ring >= 0 and ring not in path:
            around = slice(rings.start[ring], rings.start[ring + 1])
            at = int(rng.choice(np.nonzero(rings.pair[around] != row)[0])) + around.start
            row, sign = int(rings.pair[at]), int(rings.sign[at])
            path[ring] = row, quarter * sign
            ring = int(self._beside[row, int(sign > 0)])
        changes = list(path.values())
        for row, change in changes[list(path).index(ring) if ring >= 0 else 0 :]:
            steps[row] += change

    def _walk(self, rng: np.random.Generator, z: Ints, steps: Counter[int]) -> None:
        """Move a quarter of a turn from a ring, a singular one or any, along a random path of rings."""
        rings = self._rings
        ring, quarter = int(rng.integers(len(rings.defect))), int(rng.choice((-1, 1)))
        turn = np.round((rings.defect - rings.sums(self._energy.constant + HALF * z)) / HALF)
        if len(singular := np.nonzero(turn)[0]) and rng.random() < _SINGULAR:
            ring = int(rng.choice(singular))
            quarter = int(np.sign(turn[ring]))
        for _ in range(int(_LONGEST ** rng.random())):
            at = int(rng.integers(rings.start[ring], rings.start[ring + 1]))
            row, sign = int(rings.pair[at]), int(rings.sign[at])
            steps[row] += quarter * sign
            ring = int(self._beside[row, int(sign > 0)])
            if ring < 0:
                break
