"""Fields from a dual solution: pixel by pixel the label of least estimated cost, then improved.

models/proof/decoding.py estimates the costs.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from ..field.field import CrossField, field_in_windows
from ..field.jumps import free_jumps
from ..processes.deadline import Over, never
from ..search.box_qp import FreeField
from ..search.energy import LinearSolver
from ..search.improvement import improved_field, settle
from .dual import Dual

_BETTER: Final = 1e-9  # relative: rounding is no improvement

Improve = Callable[[CrossField, CrossField, Over], CrossField]
"""Returns the better of a rounded field and the best one so far, improved."""


class Rounding:
    """Rounds fields from a dual, each set of jumps once."""

    def __init__(self, dual: Dual, improve: Improve) -> None:
        self._dual, self._improve = dual, improve
        self._tried: set[bytes] = set()

    def lower(self, best: CrossField, over: Over = never) -> CrossField:
        """`best`, or a lower field that the shares suggest; before and after it the last pass is backward."""
        best = self._rounded(best, over, forwards=True)
        if over():
            return best
        self._dual.forward()
        best = self._rounded(best, over, forwards=False)
        self._dual.backward()
        return best

    def _rounded(self, best: CrossField, over: Over, *, forwards: bool) -> CrossField:
        instance = best.instance
        alpha, beta = self._dual.decoded(forwards=forwards)
        found = field_in_windows(instance, alpha, beta, free_jumps(instance, alpha, beta)[0])
        known = found.p.tobytes()
        if known in self._tried:
            return best
        self._tried.add(known)
        return self._improve(found, best, over)


def improve(found: CrossField, best: CrossField, over: Over) -> CrossField:
    """The field of lower 2-norm energy: the best field, or the new one, improved where that may pay."""
    state = FreeField.of(found)
    settle(state, LinearSolver(), over)
    if state.energy >= best.energy().total * (1 - _BETTER):
        return best
    return min(
        best, improved_field(state.fit_in_bounds(over), stop=over), key=lambda field: field.energy().total
    )
