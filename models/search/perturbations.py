"""Random changes of several jumps at once, to leave a valley that single changes do not leave.

`walk` follows a path of rings and moves the turn at its start to its end: a singularity moves, two opposite
ones meet, or a pair of them appears. `turn_inside` changes the rows that a closed path of rings crosses, for
example around a handle. `change_neighbours` changes neighbouring rows.
"""

from __future__ import annotations

from collections import Counter
from typing import Final

import numpy as np

from ..instance.domain import Floats, Ints, Rings
from ..instance.least_squares import two_entry_matrix
from ..instance.terms import quarter_turns

Change = tuple[Ints, Ints]
"""Numbers of rows, each at most once, and the steps that are added to their jumps."""

_LONGEST: Final = 20  # rings of a walk
_SINGULAR: Final = 0.6  # share of the walks that begin at a singularity
_BEND: Final = 0.3  # share of the rings in which a walk does not go straight on
_ROWS: Final = 0.3  # share of the perturbations that change neighbouring rows
_LOOPS: Final = 0.1  # share of those that follow a closed path
_NEIGHBOURS: Final = 5  # rows that change together, at most


class Perturbations:
    """Changes of the jumps of rows between points; offsets are the turns of labels along the rows."""

    def __init__(self, rings: Rings, size: int, first: Ints, second: Ints) -> None:
        """Prepare rows with these ends, (r,), and their rings; ends from `size` on are the ground."""
        self._rings, self._size, self._ends = rings, size, (first, second)
        # The ring that goes along a row from its first point to its second one [0], and back [1], or -1; and
        # the step of that ring.
        self._beside, self._step = np.full((2, len(first), 2), -1)
        back = (rings.sign < 0).astype(np.intp)
        self._beside[rings.pair, back] = np.repeat(np.arange(len(rings.defect)), np.diff(rings.start))
        self._step[rings.pair, back] = np.arange(len(rings.pair))
        by_point = two_entry_matrix(first, second, size + 1).tocsc()
        self._start, self._at_point = by_point.indptr, by_point.indices

    def draw(self, rng: np.random.Generator, offsets: Floats) -> Change:
        """A random change at the present turns of labels, (r,)."""
        kind = rng.random()
        if kind < _ROWS or not len(self._rings.defect):
            return self.change_neighbours(rng)
        return self.turn_inside(rng) if kind < _ROWS + _LOOPS else self.walk(rng, offsets)

    def change_neighbours(self, rng: np.random.Generator) -> Change:
        """Change up to five rows by 1, each one at a point of the last one."""
        steps, row = Counter[int](), int(rng.integers(len(self._ends[0])))
        for _ in range(int(rng.integers(1, _NEIGHBOURS + 1))):
            steps[row] += int(rng.choice((-1, 1)))
            point = int(rng.choice([end[row] for end in self._ends if end[row] < self._size]))
            row = int(self._at_point[rng.integers(self._start[point], self._start[point + 1])])
        return _change(steps)

    def turn_inside(self, rng: np.random.Generator) -> Change:
        """Change the rows that a random closed path of rings crosses."""
        rings, path, row = self._rings, dict[int, tuple[int, int]](), -1
        ring, quarter = int(rng.integers(len(rings.defect))), int(rng.choice((-1, 1)))
        while ring >= 0 and ring not in path:
            around = slice(rings.start[ring], rings.start[ring + 1])
            at = int(rng.choice(np.nonzero(rings.pair[around] != row)[0])) + around.start
            row, sign = int(rings.pair[at]), int(rings.sign[at])
            path[ring] = row, quarter * sign
            ring = int(self._beside[row, int(sign > 0)])
        steps, changes = Counter[int](), list(path.values())
        for row, change in changes[list(path).index(ring) if ring >= 0 else 0 :]:
            steps[row] += change
        return _change(steps)

    def walk(self, rng: np.random.Generator, offsets: Floats) -> Change:
        """Move a quarter of a turn from a ring, a singular one or any, along a random path of rings."""
        rings, steps = self._rings, Counter[int]()
        ring, quarter = int(rng.integers(len(rings.defect))), int(rng.choice((-1, 1)))
        turns = quarter_turns(rings, offsets)
        if len(singular := np.nonzero(turns)[0]) and rng.random() < _SINGULAR:
            ring = int(rng.choice(singular))
            quarter = int(np.sign(turns[ring]))
        at = int(rng.integers(rings.start[ring], rings.start[ring + 1]))
        for _ in range(int(_LONGEST ** rng.random())):
            row, sign = int(rings.pair[at]), int(rings.sign[at])
            steps[row] += quarter * sign
            beyond = row, int(sign > 0)
            ring, entry = int(self._beside[beyond]), int(self._step[beyond])
            if ring < 0:
                break
            start, length = int(rings.start[ring]), int(rings.start[ring + 1] - rings.start[ring])
            turn = int(rng.integers(length)) if rng.random() < _BEND else length // 2
            at = start + (entry - start + turn) % length
        return _change(steps)


def _change(steps: Counter[int]) -> Change:
    """The rows that change, and their steps."""
    changed = {row: step for row, step in steps.items() if step}
    return np.array(list(changed), dtype=np.int32), np.array(list(changed.values()), dtype=np.int32)
