"""Local improvement of a field: alternating angles and jumps, and curves that change their family.

Line u carries a stroke. Where two curves cross, the jumps between them determine which of them is u. Where
they cross at less than 45 degrees, the cheapest jump assigns both to one family. So the module tries to
turn every curve.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ..field.field import CrossField
from ..field.jumps import free_jumps, step_labels
from ..instance.angles import HALF, QUARTER, line_difference
from ..instance.domain import Ints
from ..instance.instance import Instance
from ..instance.least_squares import residuals_at
from ..instance.sparse_systems import SimilarSystems
from ..instance.terms import parity_sign
from ..orthogonal.energy import takes_integers
from ..processes.blas_threads import one_thread
from ..processes.deadline import IsOver, Stop, never, stop_function
from .box_qp import CLOSE, FreeField, minimise_in_box, stroke_bounds
from .nearest_stroke import chamfer_distances, nearest_strokes

FALL: Final = 1e-9  # least fall of the energy, relative to 1 + energy: less may be rounding

_SETTLED: Final = 1e-4  # slope left while jumps still change
_ROUNDS: Final = 500  # of solving and choosing jumps again; 3 to 30 are usual
_MOST_CURVES: Final = 40  # that may change their family, those with the largest deviation first
_SAME_CURVE: Final = QUARTER / 4  # neighbouring stroke pixels that turn by less belong to one curve


@one_thread()
def improved_field(field: CrossField, *, stop: Stop | None = None) -> CrossField:
    """Field that neither best jumps, nor best angles, nor the turn of a curve improve further.

    At most 40 curves are turned, the worst first. Under the gauge `box` none is turned: there u must carry
    every stroke at the price of the box, and turning seldom pays. None is turned on meshes or where crosses
    are orthogonal. Deterministic unless `stop` ends it.

    Parameters
    ----------
    field
        The field to begin with.
    stop
        A function that returns whether to stop, or an event. The best field so far is then returned.

    Returns
    -------
    CrossField
        A field whose 2-norm energy (docs/mathematics.md, 5) does not exceed the energy of `field`.

    """
    state, solver, is_over = FreeField.of(field), SimilarSystems(), stop_function(stop)
    settle(state, solver, is_over)
    if field.instance.gauge == "strokes" and not takes_integers(field.instance):
        _exchange_families(state, solver, is_over)
    improved = state.fit_in_bounds(is_over)
    return improved if improved.energy().total < field.energy().total else field


def settle(
    state: FreeField, solver: SimilarSystems, is_over: IsOver = never, *, enough: float = FALL
) -> None:
    """Alternate solving within the bounds and choosing jumps, until a round's relative fall is below enough.

    Singularities move by a pixel per round, on fine grids for a hundred rounds.
    """
    bounds = stroke_bounds(state.instance)
    lowest, least = (state.x, state.p), np.inf
    for _ in range(_ROUNDS):
        if is_over():
            break
        energy = residuals_at(state.instance, state.p)
        state.x = minimise_in_box(
            energy, state.x, *bounds, solver=solver, tolerance=_SETTLED, is_over=is_over
        )
        reached = state.energy
        fall = (least - reached) / (1 + reached)
        if fall >= FALL:
            lowest, least = (state.x, state.p), reached
        if fall < enough:
            break
        _swap_lines(state)
        state.p = free_jumps(state.instance, state.alpha, state.beta)[0]
    state.x, state.p = lowest


def _swap_lines(state: FreeField) -> None:
    """Exchange u and v at strokes with alpha at a bound in the gauge `strokes`: beyond it v fits better."""
    instance, at = state.instance, state.instance.stroke_index
    if instance.gauge != "strokes":
        return
    off = state.alpha[at] - instance.target
    swapped = np.abs(off) >= QUARTER - 1e-9
    alpha, beta = state.alpha.copy(), state.beta.copy()
    alpha[at] -= np.where(swapped, HALF * np.sign(off), 0.0)
    beta[at] *= np.where(swapped, -1.0, 1.0)
    state.alpha, state.beta = alpha, beta


def _exchange_families(state: FreeField, solver: SimilarSystems, is_over: IsOver) -> None:
    """Let curves change their family of lines where that lowers the energy, the worst first."""
    instance, grid = state.instance, state.instance.grid
    curve = stroke_curves(instance)
    miss = state.field.residual_r**2 * instance.w
    worst = np.argsort(-np.round(np.bincount(curve, miss), 9), kind="stable")[:_MOST_CURVES]
    of_pixel = np.append(curve, -1)[nearest_strokes(instance)]
    for number in worst:
        if is_over():
            return
        quarters = (of_pixel == number).astype(np.int32)
        if (quarters[grid.first] != quarters[grid.second]).any():
            _turn_if_better(state, quarters, solver, is_over)


def _turn_if_better(state: FreeField, curve_quarters: Ints, solver: SimilarSystems, is_over: IsOver) -> None:
    """Turn the crosses round a curve (own = 1) by a quarter either way, and keep the largest decrease."""
    enough = state.energy * (1 - 1e-6) - 1e-9
    trials = [_turn_trial(state, quarters, solver) for quarters in (curve_quarters, -curve_quarters)]
    best = min(trials, key=lambda trial: round(trial.energy, 9))
    if best.energy < enough:
        settle(best, solver, is_over)
        if best.energy < enough:
            state.x, state.p = best.x, best.p


def _turn_trial(state: FreeField, quarters: Ints, solver: SimilarSystems) -> FreeField:
    """The state after turning labels back by `quarters`, solved: strokes pull at the other line."""
    grid, sign = state.instance.grid, parity_sign(quarters)
    trial = FreeField(state.instance, *step_labels(grid, state.alpha, state.beta, state.p, -quarters))
    energy = residuals_at(trial.instance, trial.p)
    # In the old labels the system has changed only at these strokes, so that the present factorisation is
    # close.
    old = np.concatenate([np.ones(grid.size), sign])
    matrix = sparse.diags_array(old) @ energy.normal_matrix @ sparse.diags_array(old)
    trial.x = trial.x + old * solver.solve(matrix, -old * energy.slope(trial.x), CLOSE)
    return trial


def stroke_curves(instance: Instance) -> Ints:
    """The curve of each stroke pixel, (s,): neighbours of nearly the same direction belong together."""
    count = len(instance.theta)
    number = np.full(instance.grid.size, -1)
    number[instance.stroke_index] = np.arange(count)
    first, second = (number[end] for end in chamfer_distances(instance.grid).tocoo().coords)
    joined = (first >= 0) & (second >= 0)
    joined[joined] = (
        line_difference(instance.theta[first[joined]], instance.theta[second[joined]]) < _SAME_CURVE
    )
    links = sparse.csr_array((np.ones(joined.sum()), (first[joined], second[joined])), shape=(count, count))
    curves: Ints = connected_components(links, directed=False)[1]
    return curves
