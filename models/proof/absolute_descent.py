"""The descent of a proof where pairs count with absolute values: in the 1-norm and in the mixed norm.

It is that of models/proof/descent.py, on a lattice common to all pixels. Once the boxes of a level leave no
choice of jumps, a linear or quadratic program gives the energy on them, except for strokes at the edges of
their windows, where boxes are cut. Its multipliers prove its least value. Section 9 of docs/proofs.md states
and proves the lemmas.
"""

from __future__ import annotations

from typing import cast

import numpy as np

from ..field.field import AbsoluteNorm, CrossField, Norm
from ..field.jumps import best_jumps
from ..instance.angles import HALF, QUARTER
from ..instance.grid import Floats
from ..instance.instance import Instance
from ..instance.terms import parity_sign
from ..processes.deadline import Over, never
from ..search.absolute_fit import alternate_absolute, fit_absolute
from .descent import COARSEST, Descent
from .forced import MARGIN, Forced, at_pairs
from .lattice import Lattice
from .pruning import RemainingCells


def forced_absolute(left: RemainingCells, target: Floats | None = None) -> Forced:
    """Choices that are forced on the boxes that are left, as `forced`."""
    reach = QUARTER if left.lattice.norm == 1 else HALF
    i, j = left.lattice.instance.grid.first, left.lattice.instance.grid.second
    most, even = at_pairs(left)[0], parity_sign(left.lattice.p) > 0
    above, below = np.maximum(left.beta_high, 0.0), np.maximum(-left.beta_low, 0.0)
    same, opposite = np.where(even, above[j], below[j]), np.where(even, below[j], above[j])
    unlike = np.maximum(np.minimum(above[i], opposite), np.minimum(below[i], same))
    least = np.maximum(np.maximum(left.beta_low, -left.beta_high), 0.0)
    growth = np.where(unlike > 0, unlike, -np.minimum(least[i], least[j]))
    pairs = (most <= HALF - MARGIN) & (most + growth <= QUARTER - MARGIN)
    instance = left.lattice.instance
    at, target = instance.stroke_index, instance.target if target is None else target
    away = np.maximum(left.alpha_high[at] - target, target - left.alpha_low[at])
    return Forced(left, pairs, away - QUARTER <= reach - MARGIN, target)


class AbsoluteDescent(Descent):
    """A descent where pairs count with absolute values."""

    norm: AbsoluteNorm
    forced = staticmethod(forced_absolute)

    @staticmethod
    def first_field(instance: Instance, norm: Norm, start: CrossField | None, over: Over) -> CrossField:
        """The better one of the 2-norm's first field and the user's field, both fitted."""
        fields = [Descent.first_field(instance, 2, None, over)] + ([] if start is None else [start])
        fitted = [alternate_absolute(field, cast("AbsoluteNorm", norm), over) for field in fields]
        return min(fitted, key=lambda field: field.energy(norm).total)

    def first_level(self, centre: CrossField) -> Lattice:
        """The first lattice round a field: its strokes have the slopes of the best angles for its jumps."""
        instance = centre.instance
        jumps = best_jumps(instance, centre.alpha, centre.beta, absolute=True)
        around, slopes = fit_absolute(CrossField(instance, centre.alpha, centre.beta, jumps), self.norm)
        return Lattice.common(around, self.norm, slopes, COARSEST)

    def better_field(self, rounded: CrossField, best: CrossField, over: Over) -> CrossField:
        """The better one of a best field and a new one, fitted."""
        return min(best, alternate_absolute(rounded, self.norm, over), key=self.energy)

    def improve_field(self, field: CrossField, over: Over = never) -> CrossField:
        """The field, fitted."""
        return alternate_absolute(field, self.norm, over)

    def _search(self, seconds: float) -> None:
        """Do nothing: rounding finds better fields than the search, which is for the 2-norm."""

    def _find_better_field(self) -> bool:
        return False
