"""Fields to start from: the greedy one, PolyVector fields, and what grows out of the best on a coarse grid.

Which jumps a strategy finds is a matter of luck, and on a coarse grid luck is cheap: there several are tried,
curves of the best, or of two that are close, change their family, and what is found grows to the fine grid,
where angles and jumps only settle.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from ..field.field import CrossField
from ..instance.instance import Instance
from ..processes.deadline import Over, never
from ..smooth.polyvector import HOLDS, polyvector_field
from .box_qp import fitted
from .coarse import CREEP, grown, halved, prolonged
from .greedy import greedy, rough_greedy
from .improvement import improved

_COARSE: Final = 4096  # pixels up to which the greedy strategy costs little
_HELD: Final = (1.0, 0.3, 0.1, 0.03)  # factors of the stroke weights for the greedy strategy
_IMPROVED: Final = 2  # of the starts: improving one takes as long as finding three
_CLOSE: Final = 0.03  # relative energy above the lowest start up to which another one is improved too


def first_field(instance: Instance, over: Over = never) -> CrossField:
    """A field of low 2-norm energy, as time allows: where searches start, and `qp-fixed`'s jumps.

    Up to 4096 pixels the improved greedy field. On larger grids what the best of several starts, on a grid of
    at most 4096 pixels, grows to from grid to grid, each of twice the resolution: improved on all but the
    last, where angles and jumps settle. Deterministic where time does not cut it off.
    """
    coarse = _coarser(instance)
    if coarse is None:
        return improved(greedy(instance, over=over), over)
    return grown(_from_coarsest(coarse, over), instance, over)


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
        best = min(best, tried, key=_energy)
    return best


def _coarser(instance: Instance) -> Instance | None:
    """The instance on half the resolution; None where it is coarse already, or no stroke would be left."""
    return halved(instance) if instance.grid.size > _COARSE else None


def _from_coarsest(instance: Instance, over: Over) -> CrossField:
    """The best start of the coarsest grid, grown and improved from grid to grid up to this one."""
    coarse = _coarser(instance)
    if coarse is None:
        return _best_start(instance, over)
    return prolonged(_from_coarsest(coarse, over), instance, over, enough=CREEP)


def _best_start(instance: Instance, over: Over) -> CrossField:
    """The best of the PolyVector start and, in time, of greedy fields; the lowest of them improved."""
    starts = [polyvector_start(instance, over)]
    starts += [_held(instance, factor, over) for factor in _HELD if not over()]
    lowest = sorted(starts, key=_energy)[:_IMPROVED]
    close = [start for start in lowest if _energy(start) <= (1 + _CLOSE) * _energy(lowest[0])]
    return min((improved(start, over) for start in close), key=_energy)


def _held(instance: Instance, factor: float, over: Over) -> CrossField:
    """The greedy field of strokes held that much, with the best angles for its jumps under the own weights.

    Held less, strokes that contradict each other leave fewer vortices.
    """
    light = rough_greedy(replace(instance, w_strokes=factor * instance.w_strokes), over)
    return fitted(CrossField(instance, light.alpha, light.beta, light.p).with_best_jumps(), over)


def _energy(field: CrossField) -> float:
    return round(field.energy().total, 9)
