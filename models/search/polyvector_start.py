"""The PolyVector field as a start: with the best angles, of the best of a few stroke weights."""

from __future__ import annotations

from ..field.field import CrossField
from ..instance.instance import Instance
from ..processes.deadline import Over, never
from ..smooth.polyvector import HOLDS, polyvector_field
from .box_qp import fitted


def polyvector_start(instance: Instance, over: Over = never) -> CrossField:
    """The field of least 2-norm energy among the PolyVector fields of all `HOLDS`, with their best angles.

    Which hold has the best jumps depends on how much strokes contradict each other, and a fit costs little.
    Where the time is over, the best of those that were tried.
    """
    best = fitted(polyvector_field(instance, hold=HOLDS[0]), over)
    for hold in HOLDS[1:]:
        if over():
            break
        tried = fitted(polyvector_field(instance, hold=hold), over)
        best = min(best, tried, key=lambda field: round(field.energy().total, 9))
    return best
