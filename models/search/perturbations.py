"""Random perturbations of several jumps at once, to leave a valley that single changes do not leave.

- `shift`: along a path of quads, which moves the turn at its start to its end: a singularity moves,
  two opposite ones meet, or a pair of them is created;
- `turn`: round a piece of a curve, or a disc: the strokes inside change to the other family of lines.

A change is (pairs, steps): local numbers of pairs of a patch, each at most once, and the steps that are
added to their jumps.
"""

from __future__ import annotations

from collections import Counter
from typing import Final

import numpy as np

from ..instance.grid import Ints
from .landscape import Patch

Change = tuple[Ints, Ints]

_LONGEST: Final = 16  # quads of a path
_WIDEST: Final = 12.0  # pixels, radius of a disc
_TURNS: Final = 0.6  # share of turns
_SIDES: Final = (1, 1, -1, -1)  # signs of the pairs of a quad on its counter-clockwise walk


class Perturbations:
    """Random perturbations inside one patch."""

    def __init__(self, patch: Patch, curve: Ints) -> None:
        """Prepare the patch; curve: number of the curve of each pixel, -1 without a stroke; shape (n,)."""
        instance = patch.instance
        self._patch = patch
        local = np.full(len(instance.grid.first), -1)
        local[patch.pairs] = np.arange(len(patch.pairs))
        quads = local[instance.grid.quads]
        self._quads = quads[(quads >= 0).all(axis=1)]
        self._beside = _quads_of_pairs(self._quads, len(patch.pairs))
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
        kept = {pair: step for pair, step in steps.items() if step}
        return np.array(list(kept), dtype=np.int32), np.array(list(kept.values()), dtype=np.int32)

    def turn(self, rng: np.random.Generator) -> Change:
        """The jumps round the strokes of a disc, of one curve or of all."""
        centre = int(rng.choice(self._strokes))
        radius = 0.5 * (2 * _WIDEST) ** rng.random()
        away = np.hypot(self._row - self._row[centre], self._column - self._column[centre])
        inside = (away <= radius) & (self._curve >= 0)
        if rng.random() < 0.7:
            inside &= self._curve == self._curve[centre]
        own: Ints = inside.astype(np.int32) * np.int32(rng.choice([-1, 1]))
        steps = own[self._patch.first] - own[self._patch.second]
        pairs = np.nonzero(steps)[0].astype(np.int32)
        return pairs, steps[pairs]


def _quads_of_pairs(quads: Ints, pairs: int) -> Ints:
    """The quads with each pair at bottom or right [0], and at top or left [1], or -1; (pairs, 2)."""
    beside = np.full((pairs, 2), -1)
    for side in range(4):
        beside[quads[:, side], 0 if side < 2 else 1] = np.arange(len(quads))
    return beside
