"""The greedy strategy of BendFields: the baseline for comparisons, and the start of solvers and searches.

It grows one cell round every stroke pixel, in which all jumps are 0. Then it decides the jumps between
cells, cheapest first, and updates the angles after every batch (docs/mathematics.md, 10). Mixed-integer
quadrangulation uses the same strategy.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from ..field.field import CrossField
from ..field.jumps import free_jumps
from ..instance.domain import Bools, Ints
from ..instance.instance import Instance
from ..instance.least_squares import residuals_at
from ..instance.sparse_systems import SimilarSystems, solve_by_gradients
from ..orthogonal.energy import takes_integers
from ..processes.blas_threads import one_thread
from ..processes.deadline import IsOver, Stop, never, stop_function
from .box_qp import CLOSE, FreeField
from .integer_fields import greedy_integer_field
from .nearest_stroke import nearest_strokes

_CLOSE_UP_TO: Final = 8192  # pixels: beyond, solves take most of the time, and local updates rank as well


@dataclass(frozen=True)
class _Pace:
    """Size of batches of jumps, and accuracy of the updates of angles after them."""

    batch: float  # energy that a batch may add
    local: float | None  # relative residual of local updates; None for updates by factorisations
    share: float = 0.0  # of the energy added so far, which a batch may add if that is more


_CLOSE: Final = _Pace(1.0, None)
_LARGE: Final = _Pace(1.0, 3e-2)
_ROUGH: Final = _Pace(0.5, 1e-2, 0.1)


@one_thread()
def greedy_field(instance: Instance, *, stop: Stop | None = None) -> CrossField:
    """Greedy field of BendFields: the minimum 2-norm energy for its jumps, within all bounds.

    The jumps are decided one after the other, the cheapest first, as in BendFields (2015), where all angles
    are solved for again each time (docs/mathematics.md, 10). Only the last solve keeps the windows, because
    BendFields has none. Deterministic unless `stop` ends it.

    Orthogonal crosses, and all crosses on meshes, get the integers of mixed-integer quadrangulation: those on
    a forest are 0, and of the others the one nearest to a whole number is rounded first. With more than 6,000
    points a fifth of them are rounded at a time.

    Parameters
    ----------
    instance
        The instance.
    stop
        A function that returns whether to stop, or an event. All remaining jumps are then decided at once.

    """
    if takes_integers(instance):
        return greedy_integer_field(instance, stop_function(stop))
    state, nearest = _grow_cells(instance)
    pace = _CLOSE if instance.grid.size <= _CLOSE_UP_TO else _LARGE
    is_over = stop_function(stop)
    _stitch(state, nearest, pace, is_over)
    return state.fit_in_bounds(is_over)


def rough_greedy(instance: Instance, is_over: IsOver = never) -> FreeField:
    """As `greedy_field`, without bounds, in a tenth of its time: 60 batches, angles updated locally."""
    state, nearest = _grow_cells(instance)
    _stitch(state, nearest, _ROUGH, is_over)
    return state


def _grow_cells(instance: Instance) -> tuple[FreeField, Ints]:
    """Each pixel with the angle of its nearest stroke, without a jump, and the numbers of these strokes."""
    nearest = nearest_strokes(instance)
    angle = np.append(instance.target, 0.0)[nearest]
    jumps = np.zeros(len(instance.grid.first), dtype=np.int32)
    return FreeField(instance, angle, np.zeros(len(angle)), jumps), nearest


def _stitch(state: FreeField, nearest: Ints, pace: _Pace, is_over: IsOver) -> None:
    """Decide the jumps between cells, cheapest first, in batches."""
    grid, solver = state.instance.grid, SimilarSystems()
    known = nearest[grid.first] == nearest[grid.second]
    _update_angles(state, known, solver, pace.local)
    added = 0.0
    while not known.all():
        open_ = np.nonzero(~known)[0]
        jumps, cost = free_jumps(state.instance, state.alpha, state.beta)
        # Rounding must not decide the order of equal costs: it would differ between machines.
        order = np.argsort(np.round(cost[open_], 9), kind="stable")
        sums = np.cumsum(cost[open_][order])
        many = max(1, int(np.searchsorted(sums, max(pace.batch, pace.share * added), side="right")))
        added += float(sums[many - 1])
        late = is_over()
        chosen = open_ if late else open_[order[:many]]
        state.p[chosen] = jumps[chosen]
        known[chosen] = True
        _update_angles(state, known, solver, _LARGE.local if late else pace.local)


def _update_angles(state: FreeField, known: Bools, solver: SimilarSystems, local: float | None) -> None:
    """Update angles, accurately enough to rank the unknown jumps."""
    energy = residuals_at(state.instance, state.p, known)
    right = -energy.slope(state.x)
    if local is None:
        state.x = state.x + solver.solve(energy.normal_matrix, right, CLOSE)
    else:
        state.x = state.x + solve_by_gradients(energy.normal_matrix, right, local)[0]
