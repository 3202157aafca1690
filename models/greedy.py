"""Two quick fields without an integer program: the greedy strategy of BendFields, and a power field.

`greedy` is the baseline to compare solvers with, and their start. It grows one cell round every stroke pixel, in
which all jumps are 0, and then decides the jumps between cells, cheapest first, with the angles brought up to date
after every batch (domain notes, 2.3; the strategy is that of mixed-integer quadrangulation).

`power_field` smooths exp(4 i theta), which needs no jumps, and takes the orthogonal crosses from it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components, dijkstra

from .angles import line_difference
from .box_qp import fitted, least_in_box
from .field import CrossField, relabelled
from .grid import Bools, Floats, Grid, Ints
from .instance import HALF, QUARTER, Instance
from .quadratic import Solver, energy_at, factored, local_step, stroke_weight

Progress = Callable[[int, int], object]
"""Is told how many jumps are known, and how many there are."""

_BATCH_COST: Final = 1.0  # energy that one batch of jumps may add
_CLOSE_UP_TO: Final = (
    8192  # pixels: beyond, solves take most of the time, and local updates rank jumps as well
)
_CLOSE: Final = 1e-2  # relative residual of a step by a factorisation: ranks jumps like the exact one
_LOCAL: Final = 3e-2  # the same of a local update, which leaves the smooth part of the error
_SETTLED: Final = 1e-4  # slope left while jumps still change
_ROUNDS: Final = 500  # of solving and choosing jumps again at the end; 3 to 30 are usual
_MOST_CURVES: Final = 40  # that may change their family, those first that miss their strokes most
_SAME_CURVE: Final = QUARTER / 4  # neighbouring stroke pixels that turn by less are one curve


def greedy(instance: Instance, *, progress: Progress | None = None) -> CrossField:
    """The field of the greedy strategy: least 2-norm energy for its jumps, inside the windows of alpha, beta and p.

    Beyond BendFields, after the last batch the bounds are kept, angles and jumps are improved in turn
    until the energy stays, and single curves may change to the other family of lines, which matters where curves
    cross at less than 45 degrees: the cheapest jump there takes both for one family. Deterministic. `progress` is called as progress(jumps known, jumps in all) after every batch.
    """
    cells = stroke_cells(instance)
    angle = np.append(instance.target, 0.0)[cells]
    state = _State(instance, angle, np.zeros(len(angle)), np.zeros(len(instance.grid.first), dtype=np.int32))
    solver = Solver()
    _stitch(state, cells, solver, progress)
    _improve(state, solver)
    if instance.gauge == "strokes":
        # In the box u must carry every stroke at the price of the box, and turning seldom pays.
        _exchange_families(state, cells, solver)
    return fitted(relabelled(instance, state.alpha, state.beta, state.p))


def power_field(instance: Instance) -> CrossField:
    """The orthogonal crosses of the harmonic extension of exp(4 i theta), with the best jumps.

    z minimises 2 |z_i - z_j|^2 over pairs and w |z - exp(4 i theta)|^2 over strokes; alpha = arg(z)/4 and beta = 0.
    Parts without a stroke get alpha = 0.
    """
    grid = instance.grid
    weight = stroke_weight(instance)
    goal = np.zeros((grid.size, 2))
    goal[instance.stroke_index] = np.stack([np.cos(4 * instance.theta), np.sin(4 * instance.theta)], axis=-1)
    # Without jumps the part of alpha in H is the very matrix of this energy.
    alike = energy_at(instance, np.zeros(len(grid.first), dtype=np.int32)).matrix[: grid.size, : grid.size]
    z = factored(alike)(weight[:, None] * goal)
    alpha, beta = np.arctan2(z[:, 1], z[:, 0]) / 4, np.zeros(grid.size)
    start = relabelled(instance, alpha, beta, _free_jumps(grid, alpha, beta)[0])
    return start.with_best_jumps()


def stroke_cells(instance: Instance) -> Ints:
    """For each pixel the number of its nearest stroke pixel, or -1 in a part without strokes; shape (n,).

    Nearest by the 3-4 chamfer distance along paths inside the mask.
    """
    grid = instance.grid
    _, _, source = dijkstra(
        _chamfer(grid), directed=False, indices=instance.stroke_index, min_only=True, return_predecessors=True
    )
    number = np.full(grid.size + 1, -1, dtype=np.int32)
    number[instance.stroke_index] = np.arange(len(instance.stroke_index))
    cells: Ints = number[np.where(source >= 0, source, grid.size)]
    return cells


def _chamfer(grid: Grid) -> Any:
    """Distances between neighbours: 3 along the grid, 4 across a corner that lies beside a pixel of the mask."""
    number = grid.number
    beside = [(number[1:, :-1], number[:-1, 1:], number[:-1, :-1], number[1:, 1:])]
    beside.append((beside[0][2], beside[0][3], beside[0][0], beside[0][1]))
    first, second = [grid.first], [grid.second]
    for start, end, one, other in beside:
        passable = (start >= 0) & (end >= 0) & ((one >= 0) | (other >= 0))
        first.append(start[passable])
        second.append(end[passable])
    length = np.full(sum(map(len, first)), 4.0)
    length[: len(grid.first)] = 3.0
    place = (np.concatenate(first), np.concatenate(second))
    return sparse.csr_array((length, place), shape=(grid.size, grid.size))


@dataclass(eq=False)
class _State:
    """Angles and jumps that change while the field grows; angles are free of windows until the end."""

    instance: Instance
    alpha: Floats
    beta: Floats
    p: Ints

    @property
    def x(self) -> Floats:
        return np.concatenate([self.alpha, self.beta])

    @x.setter
    def x(self, value: Floats) -> None:
        self.alpha, self.beta = np.split(value, 2)

    @property
    def energy(self) -> float:
        return CrossField(self.instance, self.alpha, self.beta, self.p).energy().total


def _stitch(state: _State, cells: Ints, solver: Solver, progress: Progress | None) -> None:
    """Decide the jumps between cells, cheapest first, in batches that cost at most `_BATCH_COST`."""
    grid = state.instance.grid
    known = cells[grid.first] == cells[grid.second]
    _settle(state, known, solver)
    while not known.all():
        open_ = np.nonzero(~known)[0]
        jumps, cost = _free_jumps(grid, state.alpha, state.beta)
        # Rounding must not decide the order of equal costs: it would differ between machines.
        order = np.argsort(np.round(cost[open_], 9), kind="stable")
        many = max(1, int(np.searchsorted(np.cumsum(cost[open_][order]), _BATCH_COST, side="right")))
        chosen = open_[order[:many]]
        state.p[chosen] = jumps[chosen]
        known[chosen] = True
        _settle(state, known, solver if grid.size <= _CLOSE_UP_TO else None)
        if progress is not None:
            progress(int(known.sum()), len(known))


def _settle(state: _State, known: Bools, solver: Solver | None) -> None:
    """Bring the angles up to date with the known jumps, well enough to rank the others; without a solver, locally."""
    energy = energy_at(state.instance, state.p, known)
    right = -energy.slope(state.x)
    if solver is None:
        state.x = state.x + local_step(energy, right, _LOCAL)
    else:
        state.x = state.x + solver.step(energy.matrix, right, _CLOSE)


def _free_jumps(grid: Grid, alpha: Floats, beta: Floats) -> tuple[Ints, Floats]:
    """The best jump of each pair, in no range, and its energy; ties go to the smaller jump. Shapes (m,)."""
    difference = alpha[grid.first] - alpha[grid.second]
    lower = np.floor(-difference / HALF).astype(np.int32)
    # The best even and the best odd jump are the two beside -2d/pi, unless that is a whole number.
    candidates = lower + np.arange(-1, 3, dtype=np.int32)[:, None]
    a = difference + HALF * candidates
    b = _sign(candidates) * beta[grid.first] - beta[grid.second]
    cost = np.round(2 * (a * a + b * b), 12)
    best = np.argmin(cost, axis=0)
    at = (best, np.arange(len(best)))
    return candidates[at], cost[at]


def _improve(state: _State, solver: Solver) -> None:
    """Solve within the bounds and choose jumps again, in turn, as long as the energy falls."""
    bounds = _bounds(state.instance)
    kept, least = (state.x, state.p), np.inf
    for _ in range(_ROUNDS):
        energy = energy_at(state.instance, state.p)
        state.x = least_in_box(energy, state.x, *bounds, solver=solver, tolerance=_SETTLED)
        reached = state.energy
        if least - reached < 1e-9 * (1 + reached):
            break
        kept, least = (state.x, state.p), reached
        _swap_lines(state)
        state.p = _free_jumps(state.instance.grid, state.alpha, state.beta)[0]
    state.x, state.p = kept


def _bounds(instance: Instance) -> tuple[Floats, Floats]:
    """Least and greatest (alpha, beta), shapes (2n,): alpha is bound at strokes only, for elsewhere every label will do."""
    size, at = instance.grid.size, instance.stroke_index
    lower = np.concatenate([np.full(size, -np.inf), np.full(size, -QUARTER)])
    upper = -lower
    lower[at], upper[at] = instance.alpha_lower[at], instance.alpha_upper[at]
    return lower, upper


def _swap_lines(state: _State) -> None:
    """Exchange u and v where a stroke pixel's alpha has run against its window of the gauge `strokes`.

    There (alpha, beta) and (alpha -+ pi/2, -beta) fit the stroke equally badly, and beyond the bound the other fits better.
    """
    instance, at = state.instance, state.instance.stroke_index
    if instance.gauge != "strokes":
        return
    off = state.alpha[at] - instance.target
    swapped = np.abs(off) >= QUARTER - 1e-9
    alpha, beta = state.alpha.copy(), state.beta.copy()
    alpha[at] -= np.where(swapped, HALF * np.sign(off), 0.0)
    beta[at] *= np.where(swapped, -1.0, 1.0)
    state.alpha, state.beta = alpha, beta


def _exchange_families(state: _State, cells: Ints, solver: Solver) -> None:
    """Let curves change to the other family of lines where that lowers the energy, those first that miss most."""
    instance, grid = state.instance, state.instance.grid
    curve = _curves(instance)
    miss = CrossField(instance, state.alpha, state.beta, state.p).residual_r ** 2 * instance.w
    worst = np.argsort(-np.round(np.bincount(curve, miss), 9), kind="stable")[:_MOST_CURVES]
    of_pixel = np.append(curve, -1)[cells]
    for number in worst:
        own = (of_pixel == number).astype(np.int32)
        if (own[grid.first] != own[grid.second]).any():
            _turn_if_better(state, own, solver)


def _turn_if_better(state: _State, own: Ints, solver: Solver) -> None:
    """Turn the crosses round a curve (own = 1) by a quarter either way and keep what lowers the energy most.

    Without the bounds the energy of a trial is a lower bound, and usually the answer.
    """
    enough = state.energy * (1 - 1e-6) - 1e-9
    trials = [_turned(state, quarters, solver) for quarters in (own, -own)]
    best = min(trials, key=lambda trial: round(trial.energy, 9))
    if best.energy < enough:
        _improve(best, solver)
        if best.energy < enough:
            state.x, state.p = best.x, best.p


def _turned(state: _State, quarters: Ints, solver: Solver) -> _State:
    """The state after turning each pixel's labels back by `quarters`, solved: what v was before is now u.

    The turn alone leaves the crosses as they are; but the strokes, which pull at u, now pull at the other line.
    """
    grid, sign = state.instance.grid, _sign(quarters)
    jumps = state.p + quarters[grid.first] - quarters[grid.second]
    trial = _State(state.instance, state.alpha - HALF * quarters, sign * state.beta, jumps)
    energy = energy_at(trial.instance, trial.p)
    # In the old labels the system has changed at these strokes only, so that the factorisation at hand is close.
    old = np.concatenate([np.ones(grid.size), sign])
    matrix = sparse.diags_array(old) @ energy.matrix @ sparse.diags_array(old)
    trial.x = trial.x + old * solver.step(matrix, -old * energy.slope(trial.x), _CLOSE)
    return trial


def _curves(instance: Instance) -> Ints:
    """The number of the curve of each stroke pixel: neighbours of nearly the same direction belong together. Shape (s,)."""
    count = len(instance.theta)
    number = np.full(instance.grid.size, -1)
    number[instance.stroke_index] = np.arange(count)
    first, second = (number[end] for end in _chamfer(instance.grid).tocoo().coords)
    joined = (first >= 0) & (second >= 0)
    joined[joined] = (
        line_difference(instance.theta[first[joined]], instance.theta[second[joined]]) < _SAME_CURVE
    )
    links = sparse.csr_array((np.ones(joined.sum()), (first[joined], second[joined])), shape=(count, count))
    curves: Ints = connected_components(links, directed=False)[1]
    return curves


def _sign(p: Ints) -> Floats:
    return 1.0 - 2.0 * (p & 1).astype(np.float64)
