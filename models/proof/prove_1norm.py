"""The work of a proof in the 1-norm: that of models/proof/work.py, on the lattices of common_lattice.py.

Once a level's boxes leave no choice of jumps, a linear program gives the energy on them, except for strokes
at the edges of their windows. Its multipliers prove its least value.

Jumps. With s = (-1)^p, let g = min(|beta_i|, |beta_j|), negative where s beta_i beta_j >= 0: |B| grows by
-2 g with the other parity. One step further |A| is at least pi/2 - |A|. So p is a best jump where |A| + g
<= pi/4. Two steps further |A| is at least pi - |A|, which is no less where |A| <= pi/2, and B stays.

Strokes. Where |alpha - theta| <= pi/4, line u at this turn is the nearest one for every beta. At pi/4 +
e, 0 <= e <= pi/4, u is pi/4 + e + beta from the stroke and v is |pi/4 - e + beta|, which is nearer by 2 e
at most; other turns are no nearer than one of the two. The same holds below -pi/4.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ..field.field import CrossField, Norm
from ..field.jumps import best_jumps
from ..instance.grid import Bools, Floats
from ..instance.instance import HALF, QUARTER, Instance
from ..processes.deadline import Over, never
from ..search.box_lp import LinearFit, fitted_1norm, settled_1norm
from .common_lattice import CommonLattice
from .forced import Forced
from .pruning import RemainingCells
from .work import COARSEST, Work, first_of


class WorkIn1Norm(Work):
    """State of a proof of the 1-norm."""

    norm: ClassVar[Norm] = 1

    @staticmethod
    def first(instance: Instance, given: CrossField | None, over: Over) -> CrossField:
        """The better one of the 2-norm's first field and the user's field, both fitted."""
        fields = [first_of(instance, None, over)] + ([] if given is None else [given])
        return min((settled_1norm(each, over) for each in fields), key=lambda field: field.energy(1).total)

    def level(self, centre: CrossField) -> CommonLattice:
        """The first level round a field: its strokes have the slopes of the best angles for its jumps."""
        instance = centre.instance
        jumps = best_jumps(instance, centre.alpha, centre.beta, norm=1)
        fitted, slopes = fitted_1norm(CrossField(instance, centre.alpha, centre.beta, jumps))
        return CommonLattice.near(fitted, slopes, COARSEST)

    def improve(self, found: CrossField, best: CrossField, over: Over) -> CrossField:
        """The better one of a best field and a new one, fitted."""
        return min(best, settled_1norm(found, over), key=self.energy)

    def improved(self, field: CrossField, over: Over = never) -> CrossField:
        """The field, fitted."""
        return settled_1norm(field, over)

    def forced(self, left: RemainingCells) -> Forced1Norm:
        """Choices that are forced on the boxes that are left."""
        return forced_1norm(left)

    def _search(self, share: float) -> None:
        """Return None: the search is for the 2-norm, and rounding finds better fields than it does."""

    def _found_more(self) -> bool:
        """Return False: there is no search that could find more."""
        return False


class Forced1Norm(Forced):
    """Choices that the boxes force in the 1-norm, where a linear program gives the energy on them.

    pairs, strokes, above, below: as in `Forced`, in the 1-norm, with strokes up to pi/4 beyond their windows.
    """

    def least(self, energy: float, over: Over = never) -> tuple[CrossField, float]:  # noqa: ARG002
        """The field of least energy with u at all strokes, and a lower bound of the energy on the boxes."""
        left, instance = self.left, self.left.lattice.instance
        lower = np.concatenate([left.alpha_low, left.beta_low])
        upper = np.concatenate([left.alpha_high, left.beta_high])
        fit = LinearFit.of(instance, left.lattice.p, lower, upper)
        alpha, beta = np.split(fit.x, 2)
        beyond = 2 * instance.stroke_coefficient * float(instance.w @ (self.above + self.below))
        return CrossField(instance, alpha, beta, left.lattice.p), fit.bound - beyond


def forced_1norm(left: RemainingCells) -> Forced1Norm:
    """Choices that are forced on the boxes that are left, in the 1-norm."""
    lattice = left.lattice
    at, target = lattice.instance.stroke_index, lattice.instance.target
    low, high = left.alpha_low[at] - target, left.alpha_high[at] - target
    above, below = np.maximum(high - QUARTER, 0.0), np.maximum(-QUARTER - low, 0.0)
    return Forced1Norm(left, _best_jumps(left), np.maximum(above, below) <= QUARTER, above, below)


def _best_jumps(left: RemainingCells) -> Bools:
    """Whether the centre's jump is a best one on the boxes of each pair, shape (m,)."""
    lattice, (i, j) = left.lattice, (left.lattice.instance.grid.first, left.lattice.instance.grid.second)
    turn, sign = HALF * lattice.p, 1.0 - 2.0 * (lattice.p & 1)
    most = np.maximum(
        np.abs(left.alpha_low[i] - left.alpha_high[j] + turn),
        np.abs(left.alpha_high[i] - left.alpha_low[j] + turn),
    )
    ends = np.array(
        [sign * x[i] * y[j] for x in (left.beta_low, left.beta_high) for y in (left.beta_low, left.beta_high)]
    )
    sizes = np.abs([left.beta_low, left.beta_high])
    least = np.where((left.beta_low <= 0) & (left.beta_high >= 0), 0.0, sizes.min(axis=0))
    most_beta = sizes.max(axis=0)
    same = ends.min(axis=0) >= 0
    given: Floats = np.where(same, -np.minimum(least[i], least[j]), np.minimum(most_beta[i], most_beta[j]))
    forced: Bools = (most <= HALF) & (most + given <= QUARTER)
    return forced
