"""The work of a proof in the 1-norm: as in models/proof/work.py, on a `CommonLattice`.

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
from ..instance.grid import Floats
from ..instance.instance import HALF, QUARTER, Instance
from ..processes.deadline import Over, never
from ..search.box_lp import fitted_1norm, linear_fit, settled_1norm
from ..search.box_qp import field_at
from .forced import Forced, at_pairs
from .lattice import CommonLattice
from .pruning import RemainingCells
from .work import COARSEST, Work, first_of


class Forced1Norm(Forced):
    """Choices that the boxes force in the 1-norm, where a linear program gives the energy on them."""

    def least(self, energy: float, over: Over = never) -> tuple[CrossField, float]:  # noqa: ARG002
        """The field of least energy with u at all strokes, and a lower bound of the energy on the boxes."""
        instance, p = self.left.lattice.instance, self.left.lattice.p
        x, _, bound = linear_fit(instance, p, *self.left.bounds)
        above, below = _beyond(self.left)
        lost = 2 * instance.stroke_coefficient * float(instance.w @ (above + below))
        return field_at(instance, x, p), bound - lost


def forced_1norm(left: RemainingCells) -> Forced1Norm:
    """Choices that are forced on the boxes that are left, in the 1-norm."""
    i, j = left.lattice.instance.grid.first, left.lattice.instance.grid.second
    (most, products), sizes = at_pairs(left), np.abs([left.beta_low, left.beta_high])
    least = np.where((left.beta_low <= 0) & (left.beta_high >= 0), 0.0, sizes.min(axis=0))
    greatest, same = sizes.max(axis=0), products.min(axis=0) >= 0
    given = np.where(same, -np.minimum(least[i], least[j]), np.minimum(greatest[i], greatest[j]))
    pairs = (most <= HALF) & (most + given <= QUARTER)
    return Forced1Norm(left, pairs, np.maximum(*_beyond(left)) <= QUARTER)


def _beyond(left: RemainingCells) -> tuple[Floats, Floats]:
    """Distances by which the boxes exceed the windows of the strokes, shapes (s,)."""
    at, target = left.lattice.instance.stroke_index, left.lattice.instance.target
    low, high = left.alpha_low[at] - target, left.alpha_high[at] - target
    return np.maximum(high - QUARTER, 0.0), np.maximum(-QUARTER - low, 0.0)


class WorkIn1Norm(Work):
    """State of a proof of the 1-norm."""

    norm: ClassVar[Norm] = 1
    forced = staticmethod(forced_1norm)

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

    def _search(self, share: float) -> None:
        """Do nothing: rounding finds better fields than the search, which is for the 2-norm."""

    def _found_more(self) -> bool:
        return False
