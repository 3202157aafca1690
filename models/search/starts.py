"""Fields to start from: the greedy field, PolyVector fields, and a fusion of many approximate fields.

Which strategy finds the better jumps is random, and differs between regions. So on larger grids fast
approximate fields of several strategies are fused, region by region (models/field/fusion.py), first on a
coarse grid, where they cost little. The result grows to the fine grid and is one of several fields again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from ..field.field import CrossField
from ..field.fusion import fuse_fields
from ..field.jumps import free_jumps
from ..instance.instance import Instance
from ..instance.least_squares import residuals_at
from ..instance.sparse_systems import SimilarSystems, solve_by_gradients
from ..orthogonal.energy import takes_integers
from ..processes.blas_threads import one_thread
from ..processes.deadline import IsOver, never
from ..smooth.polyvector import HOLDS, polyvector_field
from .box_qp import FreeField, fit_in_box, stroke_bounds
from .coarse_grid import copy_to_fine_grid, halve_resolution
from .greedy import greedy_field, rough_greedy
from .improvement import improved_field, settle
from .integer_fields import first_integer_field

_Strategy = Callable[[Instance, IsOver], FreeField]

_SMALL: Final = 1024  # pixels up to which the greedy strategy costs little
_EFFORT: Final = 32768  # pixels of all approximate fields of one grid
_LIFTED: Final = 4  # fields of a coarse grid that grow to the next one: their fusion, and the lowest
_HASTE: Final = 2  # steps of angles, and of jumps, of an approximate field
_HASTY: Final = 0.1  # relative residual of such a step
_CREEP: Final = 1e-3  # relative fall of the energy in a round: a smaller one does not justify another round
_FAINT: Final = 1e-2  # of the polynomials of an approximate field, whose values fade away from strokes


@one_thread()
def first_field(instance: Instance, is_over: IsOver = never) -> CrossField:
    """A field of low 2-norm energy within the time.

    Up to 1024 pixels it is the improved greedy field. On larger grids it fuses fast approximate fields of up
    to ten strategies, fewer on larger grids, and a field grown from the grid of half the resolution.
    Orthogonal crosses and meshes: see `first_integer_field`.
    """
    if takes_integers(instance):
        return first_integer_field(instance, is_over)
    if instance.grid.size <= _SMALL:
        return improved_field(greedy_field(instance, stop=is_over), stop=is_over)
    return _fuse_many(instance, is_over)[0].fit_in_bounds(is_over)


def start_fields(
    instance: Instance,
    start: CrossField | None,
    is_over: IsOver,
    *strategies: Callable[[Instance, IsOver], CrossField],
) -> list[CrossField]:
    """The first field, the given one and, in time, the others, each improved.

    The lowest comes first, and of fields of equal energy only the first one is returned.
    """
    fields = [first_field(instance, is_over)]
    if start is not None:
        fields.append(improved_field(start, stop=is_over))
    fields.extend(
        improved_field(strategy(instance, is_over), stop=is_over) for strategy in strategies if not is_over()
    )
    by_energy = {rounded_energy(field): field for field in reversed(fields)}
    return [by_energy[energy] for energy in sorted(by_energy)]


@one_thread()
def polyvector_start(instance: Instance, is_over: IsOver = never) -> CrossField:
    """The field of least 2-norm energy among the PolyVector fields of all `HOLDS`, with their best angles."""
    best = fit_in_box(polyvector_field(instance, hold=HOLDS[0]), is_over)
    for hold in HOLDS[1:]:
        if is_over():
            break
        tried = fit_in_box(polyvector_field(instance, hold=hold), is_over)
        best = min(best, tried, key=rounded_energy)
    return best


def _polyvector_state(hold: float, instance: Instance, _: IsOver) -> FreeField:
    return FreeField.of(polyvector_field(instance, hold=hold, tolerance=_FAINT))


def _greedy_state(hold: float, instance: Instance, is_over: IsOver) -> FreeField:
    """The greedy field of a hold: with a smaller hold, contradictory strokes make fewer vortices."""
    light = rough_greedy(replace(instance, stroke_coefficient=hold * instance.stroke_coefficient), is_over)
    return FreeField(instance, light.alpha, light.beta, light.p)


_STRATEGIES: Final[tuple[_Strategy, ...]] = (
    partial(_polyvector_state, 0.1),
    partial(_greedy_state, 0.3),
    partial(_polyvector_state, 1.0),
    partial(_polyvector_state, 0.03),
    partial(_greedy_state, 1.0),
    partial(_polyvector_state, 0.3),
    partial(_greedy_state, 0.1),
    partial(_polyvector_state, 0.01),
    partial(_polyvector_state, 100.0),
    partial(_greedy_state, 0.03),
)
"""Pairs of a strategy and a factor of the stroke weights, in the order of their additional benefit."""


def _fuse_many(instance: Instance, is_over: IsOver) -> list[FreeField]:
    """The fusion of approximate fields, then these fields: from strategies here and on coarser grids."""
    starts: list[FreeField] = []
    coarse = halve_resolution(instance) if instance.grid.size > _SMALL else None
    if coarse is not None:
        for state in _fuse_many(coarse, is_over)[:_LIFTED]:
            if starts and is_over():
                break
            starts.append(copy_to_fine_grid(state.field, instance))
            _settle_roughly(starts[-1])
    for strategy in _STRATEGIES[: max(1, _EFFORT // instance.grid.size)]:
        if starts and is_over():
            break
        starts.append(strategy(instance, is_over))
        _settle_roughly(starts[-1])
    starts.sort(key=_state_energy)
    return [_fuse_states(starts, is_over), *starts]


def _settle_roughly(state: FreeField) -> None:
    """Update angles and jumps, accurately enough to compare regions; the smooth part needs no comparison."""
    bounds = stroke_bounds(state.instance)
    for _ in range(_HASTE):
        energy = residuals_at(state.instance, state.p)
        step, _ = solve_by_gradients(energy.normal_matrix, -energy.slope(state.x), _HASTY)
        state.x = np.clip(state.x + step, *bounds)
        state.p = free_jumps(state.instance, state.alpha, state.beta)[0]


def _fuse_states(states: list[FreeField], is_over: IsOver) -> FreeField:
    """The first and lowest field, settled, with the regions of others that lower it."""
    best = states[0].field
    for candidate in states[1:]:
        if is_over():
            break
        best = fuse_fields(best, candidate.field)
    state = FreeField.of(best)
    settle(state, SimilarSystems(), is_over, enough=_CREEP)
    return min(state, states[0], key=_state_energy)


def _state_energy(state: FreeField) -> float:
    return round(state.energy, 9)


def rounded_energy(field: CrossField) -> float:
    """The 2-norm energy for comparisons, which differences between processors must not decide."""
    return round(field.energy().total, 9)
