"""Search for integers of low energy where crosses are orthogonal.

Where perturbations fail for long, the search begins again: at the next start, after the last one at random
angles.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.sparse.csgraph import breadth_first_order

from ..instance.angles import HALF
from ..instance.domain import Ints, Rings
from ..orthogonal.energy import MOST_DENSE, OrthogonalEnergy, lowered
from ..processes.deadline import IsOver
from .landscape import IntegerLandscape
from .perturbations import Perturbations
from .walk import explore_from

_KICKS: Final = 500  # perturbations per round
_TIRED: Final = 1  # perturbations per point without success after which the search begins again
_PATCH: Final = 1500  # points; a change of one integer costs 30 microseconds


class IntegerSearch:
    """A search from several starts: `best` so far, number of complete rounds, and perturbations in vain."""

    def __init__(self, energy: OrthogonalEnergy, rings: Rings, starts: list[Ints], seed: int) -> None:
        """Begin at the lowest of the starts, which are integers (r,)."""
        self._energy, self._rings, self._seed = energy, rings, seed
        self._starts = sorted(
            (IntegerLandscape(energy, z) for z in starts), key=lambda land: -land.bounded_energy
        )
        self.best = self._present = self._starts.pop()
        self.round = self.fruitless = self._tired = 0

    def explore(self, is_over: IsOver) -> None:
        """Try 500 perturbations, with more than 6,000 points within 1,500 of them; return early if over."""
        rng = np.random.default_rng((self._seed, self.round))
        if self._energy.size > MOST_DENSE:
            land = self._explore_patch(rng, is_over)
        else:
            if self._tired > _TIRED * self._energy.size:
                self._present, self._tired = self._begin_again(rng, is_over), 0
            land = _explore(self._present, self._rings, rng, is_over)
        total = land.bounded_energy
        self._tired = 0 if total < lowered(self._present.bounded_energy) else self._tired + _KICKS
        self.fruitless = 0 if total < lowered(self.best.bounded_energy) else self.fruitless + _KICKS
        self._present = land
        self.best = self.best if self.fruitless else land
        self.round += not is_over()

    def _begin_again(self, rng: np.random.Generator, is_over: IsOver) -> IntegerLandscape:
        if self._starts:
            return self._starts.pop()
        z = self._energy.nearest(rng.uniform(0, HALF, self._energy.size))
        return IntegerLandscape(self._energy, self._energy.descend(z, is_over))

    def _explore_patch(self, rng: np.random.Generator, is_over: IsOver) -> IntegerLandscape:
        """Explore the points nearest to a row, alternately a random one and one of high energy."""
        energy, (z, residual, total) = self._energy, self._present.save_state()
        if not len(z):
            return self._present
        share = energy.weight * residual**2 / total if self.round % 2 and lowered(total) > 0 else None
        row = rng.choice(len(z), p=share)
        near = breadth_first_order(energy.links, energy.first[row], directed=False)[0][:_PATCH]
        patch, rows = energy.restrict(near, energy.fit_angles(z))
        inside = np.maximum(patch.first, patch.second) < patch.size
        local = np.full(len(z), -1, dtype=np.int32)
        local[rows[inside]] = np.nonzero(inside)[0]
        z[rows] = _explore(IntegerLandscape(patch, z[rows]), self._rings.select(local), rng, is_over).p
        return IntegerLandscape(energy, z)


def _explore(
    land: IntegerLandscape, rings: Rings, rng: np.random.Generator, is_over: IsOver
) -> IntegerLandscape:
    """The lowest landscape of 500 perturbations; rings: of the rows."""
    if not len(land.p):
        return land
    perturbations = Perturbations(rings, land.terms.size, land.terms.first, land.terms.second)
    least = land.bounded_energy
    return explore_from(land, perturbations, rng, least=least, count=_KICKS, is_over=is_over)[0] or land
