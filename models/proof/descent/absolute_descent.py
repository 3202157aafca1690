"""The descent of a proof where pairs count with absolute values: in the 1-norm and in the mixed norm.

It is that of descent.py, on a lattice common to all pixels. Once the boxes of a level leave no
choice of jumps, a linear or quadratic program gives the energy on them, except for strokes at the edges of
their windows, where boxes are cut. Its multipliers prove its least value. Section 9 of docs/proofs.md states
and proves the lemmas.
"""

from __future__ import annotations

from typing import cast

from ...field.field import AbsoluteNorm, CrossField, Norm
from ...field.jumps import best_jumps
from ...instance.instance import Instance
from ...processes.deadline import IsOver, never
from ...search.angle_program import alternate_absolute, fit_absolute
from ..bound.dual import Dual
from ..bound.lattice import Lattice
from .descent import COARSEST, Descent


class AbsoluteDescent(Descent):
    """A descent where pairs count with absolute values."""

    norm: AbsoluteNorm

    @staticmethod
    def first_field(instance: Instance, norm: Norm, start: CrossField | None, is_over: IsOver) -> CrossField:
        """The better one of the 2-norm's first field and the user's field, both fitted."""
        fields = [Descent.first_field(instance, 2, None, is_over)] + ([] if start is None else [start])
        fitted = [alternate_absolute(field, cast("AbsoluteNorm", norm), is_over) for field in fields]
        return min(fitted, key=lambda field: field.energy(norm).total)

    def first_level(self, centre: CrossField) -> Lattice:
        """The first lattice round a field: its strokes have the slopes of the best angles for its jumps."""
        instance = centre.instance
        jumps = best_jumps(instance, centre.alpha, centre.beta, absolute=True)
        around, slopes = fit_absolute(CrossField(instance, centre.alpha, centre.beta, jumps), self.norm)
        return Lattice.common(around, self.norm, slopes, COARSEST)

    def better_field(self, rounded: CrossField, best: CrossField, is_over: IsOver) -> CrossField:
        """The better one of a best field and a new one, fitted."""
        return min(best, alternate_absolute(rounded, self.norm, is_over), key=self.energy)

    def improve_field(self, field: CrossField, is_over: IsOver = never) -> CrossField:
        """The field, fitted."""
        return alternate_absolute(field, self.norm, is_over)

    def _search(self, _seconds: float, /) -> bool:
        """Do nothing: rounding finds better fields than the search, which is for the 2-norm."""
        self.tired = True
        return False

    def _add_clusters(self, dual: Dual) -> None:
        """Add none: in the same time, passes without them close more."""
