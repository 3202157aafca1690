"""Two quick fields without an integer program: the greedy strategy of BendFields, and a power field.

`greedy` is the baseline to compare solvers with, and their start. It grows one cell round every stroke pixel, in
which all jumps are 0, and then decides the jumps between cells, cheapest first, with a sparse least-squares solve
after every batch (domain notes, 2.3; the strategy is that of mixed-integer quadrangulation).

`power_field` smooths exp(4 i theta), which needs no jumps, and takes the orthogonal crosses from it.

With x = (alpha, beta) the energy at fixed jumps is the quadratic x'Hx - 2 b'x + constant. H and b are summed over those
pairs whose jump is known.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.sparse.linalg import LinearOperator, cg, splu

from .angles import line_difference
from .field import CrossField, relabelled
from .grid import Bools, Floats, Grid, Ints
from .instance import HALF, QUARTER, Instance

Progress = Callable[[int, int], object]
"""Is told how many jumps are known, and how many there are."""

_BATCH_COST: Final = 1.0  # energy that one batch of jumps may add
_PULL: Final = 1e-9  # towards the present angles: parts without strokes, or w_beta = 0, leave H singular
_MOST_STEPS: Final = 25  # of conjugate gradients; beyond, a new factorisation is cheaper
_ROUNDS: Final = 30  # of solving and choosing jumps again at the end; 3 to 6 are usual
_MOST_CURVES: Final = 20  # that may change their family, those first that miss their strokes most
_SAME_CURVE: Final = QUARTER / 4  # neighbouring stroke pixels that turn by less are one curve
_HOLDS: Final = 15  # active sets tried for the bounds; 2 to 4 are usual


def greedy(instance: Instance, *, progress: Progress | None = None) -> CrossField:
    """The field of the greedy strategy, inside the instance's windows of alpha, beta and p.

    Beyond BendFields, after the last batch the bounds are kept by an active set, angles and jumps are improved in turn
    until the energy stays, and single curves may change to the other family of lines, which matters where curves
    cross at less than 45 degrees: the cheapest jump there takes both for one family. Deterministic. `progress` is called as progress(jumps known, jumps in all) after every batch.
    """
    cells = stroke_cells(instance)
    angle = np.append(instance.target, 0.0)[cells]
    state = _State(instance, angle, np.zeros(len(angle)), np.zeros(len(instance.grid.first), dtype=np.int32))
    _stitch(state, cells, progress)
    _improve(state)
    _exchange_families(state, cells)
    return relabelled(instance, state.alpha, state.beta, state.p)


def power_field(instance: Instance) -> CrossField:
    """The orthogonal crosses of the harmonic extension of exp(4 i theta), with the best jumps.

    z minimises 2 |z_i - z_j|^2 over pairs and w |z - exp(4 i theta)|^2 over strokes; alpha = arg(z)/4 and beta = 0.
    Parts without a stroke get alpha = 0.
    """
    grid = instance.grid
    weight = _stroke_weight(instance)
    goal = np.zeros((grid.size, 2))
    goal[instance.stroke_index] = np.stack([np.cos(4 * instance.theta), np.sin(4 * instance.theta)], axis=-1)
    every = np.ones(len(grid.first), dtype=bool)
    matrix = _laplacian(grid, every, np.ones(len(every))) + sparse.diags_array(weight + _PULL)
    z = _factor(matrix)(weight[:, None] * goal)
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

    def quadratic(self, known: Bools) -> tuple[Any, Floats]:
        """H, sparse (2n, 2n), and b (2n,) of the energy over the known pairs."""
        instance, grid = self.instance, self.instance.grid
        weight, goal = _stroke_weight(instance), np.zeros(grid.size)
        goal[instance.stroke_index] = instance.target
        stroke = sparse.diags_array(weight)
        of_alpha = _laplacian(grid, known, np.ones(len(known))) + stroke
        of_beta = (
            _laplacian(grid, known, _sign(self.p)) + stroke + instance.w_beta * sparse.eye_array(grid.size)
        )
        jump = 2 * HALF * np.where(known, self.p, 0)
        pulled = np.bincount(grid.second, jump, grid.size) - np.bincount(grid.first, jump, grid.size)
        matrix = sparse.block_array([[of_alpha, stroke], [stroke, of_beta]], format="csc")
        return matrix, np.concatenate([pulled + weight * goal, weight * goal])


def _laplacian(grid: Grid, known: Bools, sign: Floats) -> Any:
    """The matrix of sum over the known pairs of 2 (sign x_i - x_j)^2."""
    i, j, sign = grid.first[known], grid.second[known], sign[known]
    degree = 2.0 * (np.bincount(i, minlength=grid.size) + np.bincount(j, minlength=grid.size))
    half = sparse.csc_array((-2.0 * sign, (i, j)), shape=(grid.size, grid.size))
    return sparse.diags_array(degree) + half + half.T


def _stroke_weight(instance: Instance) -> Floats:
    weight = np.zeros(instance.grid.size)
    weight[instance.stroke_index] = instance.w_strokes * instance.w
    return weight


def _sign(p: Ints) -> Floats:
    return 1.0 - 2.0 * (p & 1).astype(np.float64)


def _factor(matrix: Any) -> Callable[[Floats], Floats]:
    """The solver of a positive definite system, which needs no pivoting."""
    solve: Callable[[Floats], Floats] = splu(
        matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    ).solve
    return solve


class _Solver:
    """Least-squares solves of systems that differ little: one factorisation serves the next few as preconditioner."""

    def __init__(self) -> None:
        self._inverse: Callable[[Floats], Floats] | None = None

    def near(self, matrix: Any, b: Floats, x: Floats) -> Floats:
        """The minimiser to three digits of the step from x: enough to rank jumps."""
        residual = b - matrix @ x
        matrix = matrix + _PULL * sparse.eye_array(len(b), format="csc")
        if self._inverse is not None:
            inverse = LinearOperator(matrix.shape, matvec=self._inverse, dtype=np.float64)
            step, failed = cg(matrix, residual, rtol=1e-3, maxiter=_MOST_STEPS, M=inverse)
            if not failed:
                near: Floats = x + step
                return near
        self._inverse = _factor(matrix)
        return x + self._inverse(residual)


def _minimiser(matrix: Any, b: Floats, x: Floats) -> Floats:
    """The exact minimiser; where the energy does not say, the one near x."""
    solve = _factor(matrix + _PULL * sparse.eye_array(len(b), format="csc"))
    for _ in range(3):
        x = x + solve(b - matrix @ x)
    return x


def _stitch(state: _State, cells: Ints, progress: Progress | None) -> None:
    """Decide the jumps between cells, cheapest first, in batches that cost at most `_BATCH_COST`."""
    grid = state.instance.grid
    known = cells[grid.first] == cells[grid.second]
    solver = _Solver()
    state.x = solver.near(*state.quadratic(known), state.x)
    while not known.all():
        open_ = np.nonzero(~known)[0]
        jumps, cost = _free_jumps(grid, state.alpha, state.beta)
        # Rounding must not decide the order of equal costs: it would differ between machines.
        order = np.argsort(np.round(cost[open_], 9), kind="stable")
        many = max(1, int(np.searchsorted(np.cumsum(cost[open_][order]), _BATCH_COST, side="right")))
        chosen = open_[order[:many]]
        state.p[chosen] = jumps[chosen]
        known[chosen] = True
        state.x = solver.near(*state.quadratic(known), state.x)
        if progress is not None:
            progress(int(known.sum()), len(known))


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


def _improve(state: _State) -> None:
    """Solve within the bounds and choose jumps again, in turn, as long as the energy falls."""
    every = np.ones(len(state.p), dtype=bool)
    bounds = _bounds(state.instance)
    kept, least = (state.x, state.p), np.inf
    for _ in range(_ROUNDS):
        state.x = _bounded(*state.quadratic(every), state.x, *bounds)
        energy = state.energy
        if least - energy < 1e-9 * (1 + energy):
            break
        kept, least = (state.x, state.p), energy
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


def _bounded(matrix: Any, b: Floats, x: Floats, lower: Floats, upper: Floats) -> Floats:
    """The minimiser within the bounds, by a primal-dual active set.

    Held variables that would rather move inwards are set free, free ones that left their bounds are held. Should
    the set not settle, nothing is set free any more, and at the very end x is clipped.
    """
    held = np.zeros(len(x), dtype=np.int8)
    for attempt in range(_HOLDS):
        x = np.where(held < 0, lower, np.where(held > 0, upper, x))
        free = np.nonzero(held == 0)[0]
        rows = matrix[free]
        x[free] = _minimiser(rows[:, free], b[free] - rows @ np.where(held == 0, 0.0, x), x[free])
        push = matrix @ x - b
        stays = (held * push <= 0) | (attempt > _HOLDS // 2)
        now = np.where(held == 0, (x > upper + 1e-12) * 1 - (x < lower - 1e-12) * 1, held * stays)
        if (now == held).all():
            break
        held = now.astype(np.int8)
    return np.clip(x, lower, upper)


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


def _exchange_families(state: _State, cells: Ints) -> None:
    """Let curves change to the other family of lines where that lowers the energy.

    All jumps round the cells of a curve go up or down by one, which turns its crosses by a quarter against the rest.
    """
    instance, grid = state.instance, state.instance.grid
    if (
        instance.gauge == "box"
    ):  # there u must carry every stroke at the price of the box, and turning seldom pays
        return
    curve = _curves(instance)
    miss = CrossField(instance, state.alpha, state.beta, state.p).residual_r ** 2 * instance.w
    worst = np.argsort(-np.round(np.bincount(curve, miss), 9), kind="stable")[:_MOST_CURVES]
    of_pixel = np.append(curve, -1)[cells]
    for number in worst:
        own = (of_pixel == number).astype(np.int32)
        step = own[grid.first] - own[grid.second]
        if step.any():
            _turn_if_better(state, step)


def _turn_if_better(state: _State, step: Ints) -> None:
    """Add step or -step to the jumps, solve, and keep the better one if it lowers the energy."""
    every = np.ones(len(step), dtype=bool)
    enough = state.energy * (1 - 1e-6) - 1e-9
    trials = [_State(state.instance, state.alpha, state.beta, state.p + change) for change in (step, -step)]
    for trial in trials:
        trial.x = _minimiser(*trial.quadratic(every), trial.x)
    # Without the bounds the energy is a lower bound, and usually the answer.
    best = min(trials, key=lambda trial: round(trial.energy, 9))
    if best.energy < enough:
        _improve(best)
        if best.energy < enough:
            state.x, state.p = best.x, best.p


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
