"""Check a certificate of orthogonal crosses with no code of its prover.

It follows the page "Proofs for orthogonal crosses" (docs/orthogonal-proofs.md), which proves the lemmas and
describes the arrays. It needs NumPy, and the functions that read arrays from the checker of skew crosses.

Everything is recomputed from the instance in float64: the energy U of the field; the limits of residuals; for
every level the costs, a bound, and the cells and squares that it excludes; that the next level covers the
rest; and the least energy where all jumps are forced. "Optimal" means: no field has an energy below U by more
than OPTIMAL times the greater of 1 and U. "Gap" means: no field has an energy below the bound.

Rounding. Shares and tables may be any numbers, so errors in them do no harm. Cells have whole numbers and are
exact. What counts is how much an inequality may fail at a point, a pair or a ring: less than ROUNDING times
the machine's precision times the size of the numbers that enter. Their sum is taken off every bound.
Sums of costs that are not negative have a relative error below RELATIVE. pi stands for the double next to it.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from .check_certificate import (
    HALF,
    PRECISION,
    QUARTER,
    ROUNDING,
    SPARE,
    NotProvenError,
    UnreadableError,
    json_of,
    number_in,
    status_of,
    take_array,
)  # fmt: skip

FORMAT, VERSION = "crossfield-orthogonal-certificate", 1
RELATIVE = 1e-9
FLAT = 1.1e-8  # radians; instances take smaller turns between frames as 0
MOST_LEVELS = 64
MOST_DIVISIONS = 10_000  # cells of a quarter turn
MOST_COSTS = 1 << 27  # of two labels of all pairs of a level: some 10 GB
MOST_RING = 64  # pairs of a ring
MOST_DENSE = 6000  # points up to which limits are computed; beyond, they are pi/4
MOST_CASES = 256  # of integers after the last level
MOST_NUMBER = 1e6  # of a weight and of an angle
BLOCK = 256  # rows whose limits are computed at once
TREES = 2

Array = Any
Ring = tuple[list[int], list[int], list[int]]
Costs = tuple[list[Array], list[Array]]


def head_of(arrays: dict[str, Array]) -> dict[str, Any]:
    """The text in the array `head`."""
    head = json_of(arrays, "head")
    if head.get("format") != FORMAT or head.get("version") != VERSION:
        raise UnreadableError(f"is no {FORMAT} of version {VERSION}; make it again with crossfield prove")
    return head


def _require(holds: Any, name: str, wrong: str) -> None:
    """Raise NotProvenError, with the first place that fails, unless all of the condition holds."""
    holds = np.asarray(holds)
    if not holds.all():
        place = f"[{int(np.argmin(holds))}]" if holds.ndim else ""
        raise NotProvenError(f"{name}{place} {wrong}")


# Section 1: the instance and its rows ----------------------------------------------------------------------


@dataclass
class Rows:
    """The terms weight r^2 of the energy: those of the pairs, then those of the strokes.

    size: number of points n; point n is the ground, of angle 0. first, second (r,): the ends of each row.
    offset (r,): r = alpha_first - alpha_second + offset + pi/2 z. pairs: their number. ends: of each row.
    """

    size: int
    first: Array
    second: Array
    offset: Array
    weight: Array
    pairs: int

    def __post_init__(self) -> None:
        self.ends = list(zip(self.first.tolist(), self.second.tolist()))

    def residuals(self, angle: Array) -> Array:
        """Residuals of all rows at z = 0; angle (n + 1,), 0 at the ground."""
        return angle[self.first] - angle[self.second] + self.offset

    def fixed_points(self) -> Array:
        """The ground and the first point of each part that no row of weight joins to it; bool (n + 1,)."""
        first, second = self.first[self.weight > 0], self.second[self.weight > 0]
        own = np.append(np.arange(1, self.size + 1), 0)
        part, before = own, own + 1
        while (part != before).any():
            before, part = part, part.copy()
            np.minimum.at(part, first, before[second])
            np.minimum.at(part, second, before[first])
        return np.asarray(part == own)


def rows_of(arrays: dict[str, Array]) -> Rows:
    """The rows of the instance."""
    head = json_of(arrays, "instance_head")
    _require(head.get("gauge") == "strokes", "gauge", "is not strokes")
    _require(head.get("orthogonal") is True, "orthogonal", "is not true")
    n, first, second, kappa, point = (pairs_of_mesh if "instance_faces" in arrays else pairs_of_grid)(arrays)
    m, s, weight = len(first), len(point), np.ones(len(first))
    if "instance_pair_weights" in arrays:
        weight = take_array(arrays, "instance_pair_weights", "<f8", m)
    theta, w = (take_array(arrays, f"instance_{name}", "<f8", s) for name in ("theta", "w"))
    _require((weight > 0) & (weight <= MOST_NUMBER), "pair_weights", "is not in (0, 1e6]")
    _require((theta >= 0) & (theta < np.pi), "theta", "is not in [0, pi)")
    _require((w > 0) & (w <= 1), "w", "is not in (0, 1]")
    _require(np.diff(point, prepend=-1) > 0, "strokes", "are out of order")
    weight = np.concatenate([2 * weight, number_in(head, "w_strokes", 0, MOST_NUMBER) * w])
    first, second = np.concatenate([first, point]), np.concatenate([second, np.full(s, n)])
    return Rows(n, first, second, np.concatenate([kappa, -theta]), weight, m)


def pairs_of_grid(arrays: dict[str, Array]) -> tuple[int, Array, Array, Array, Array]:
    """Number of pixels, pairs with their upper, then right neighbour, kappa = 0, and stroke pixels."""
    mask = take_array(arrays, "instance_mask", "|b1", None, None)
    place = take_array(arrays, "instance_stroke_pixels", "<i4", None, 2)
    rows, columns = np.nonzero(mask)
    number = np.full((mask.shape[0] + 1, mask.shape[1] + 1), -1)
    number[1:, :-1][mask] = np.arange(len(rows))
    neighbours = np.stack([number[rows, columns], number[rows + 1, columns + 1]], axis=1)
    first, side = np.nonzero(neighbours >= 0)
    _require(((place >= 0) & (place < mask.shape)).all(axis=1), "stroke_pixels", "is no pixel")
    point = number[1:, :-1][tuple(place.T)]
    _require(point >= 0, "stroke_pixels", "is outside the mask")
    return len(rows), first, neighbours[first, side], np.zeros(len(first)), point


def pairs_of_mesh(arrays: dict[str, Array]) -> tuple[int, Array, Array, Array, Array]:
    """Number of faces, pairs that share an edge, their kappa, and stroke faces."""
    vertices = take_array(arrays, "instance_vertices", "<f8", None, 3)
    faces = take_array(arrays, "instance_faces", "<i4", None, 3).astype(np.int64)
    point = take_array(arrays, "instance_stroke_faces", "<i4", None).astype(np.int64)
    n, v = len(faces), len(vertices)
    _require((faces >= 0) & (faces < v), "faces", "names no vertex")
    _require((point >= 0) & (point < n), "stroke_faces", "is no face")
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    edge_of = {key: edge for edge, key in enumerate((start * v + end).tolist())}
    _require(len(edge_of) == 3 * n, "faces", "are not oriented, or three meet at an edge")
    opposite = np.array([edge_of.get(key, -1) for key in (end * v + start).tolist()], np.int64)
    edge = np.nonzero((opposite >= 0) & (start < end))[0]
    ends = edge // 3, opposite[edge] // 3
    corner = vertices[faces]
    x = corner[:, 1] - corner[:, 0]  # the axis of the frame
    z = np.cross(x, corner[:, 2] - corner[:, 0])
    y = np.cross(z, x) / np.linalg.norm(z, axis=1)[:, None]  # as long as x
    along = vertices[end[edge]] - vertices[start[edge]]
    one, other = (np.arctan2((y[f] * along).sum(axis=1), (x[f] * along).sum(axis=1)) for f in ends)
    kappa = take_array(arrays, "kappa", "<f8", len(edge))
    wrong = np.abs(np.remainder(other - one - kappa + np.pi, 2 * np.pi) - np.pi)
    _require(wrong < FLAT, "kappa", "is not that of the mesh")
    return n, *ends, kappa, point


# Section 2: limits of residuals ----------------------------------------------------------------------------


def limits_of(rows: Rows) -> Array:
    """Lemma 1: |r| of every row of an optimal field is at most this, shape (r,)."""
    if rows.size > MOST_DENSE:
        return np.full(len(rows.first), QUARTER)
    n, (first, second, weight) = rows.size, (rows.first, rows.second, rows.weight)
    matrix = np.zeros((n + 1, n + 1))
    for i, j, sign in ((first, first, 1), (second, second, 1), (first, second, -1), (second, first, -1)):
        np.add.at(matrix, (i, j), sign * weight)
    matrix += np.eye(n + 1) * 1e-9 * max(matrix.max(), 1e-300)
    inverse = np.zeros((n + 1, n + 1))
    inverse[:n, :n] = np.linalg.inv(matrix[:n, :n])
    resistance = np.zeros(len(first))
    for at in range(0, len(first), BLOCK):  # any potential gives a lower bound of the resistance
        block = slice(at, at + BLOCK)
        potential = inverse[first[block]] - inverse[second[block]]
        drop = potential[:, first] - potential[:, second]
        power = np.einsum("kr,kr,r->k", drop, drop, weight)
        own = drop[np.arange(len(drop)), np.arange(len(first))[block]]
        resistance[block] = np.where(power > 0, own * own / np.maximum(power, 1e-300), 0.0)
    return QUARTER * np.clip(1 - weight * resistance * (1 - RELATIVE), 0.0, 1.0) + RELATIVE


# Section 3: labels, cells and costs ------------------------------------------------------------------------


@dataclass
class Problem:
    """The rows with what all levels share.

    centre (n + 1,): angles, 0 at the ground. half (n + 1,): 1 where labels are shifted by half a step. fixed
    (n + 1,): points with the label 0 alone. residual (r,): of the centre with its nearest jumps. limit (r,).
    rings: of each ring, its pairs, 1 or -1 for their directions, and its points in order.
    """

    rows: Rows
    centre: Array
    half: Array
    fixed: Array
    residual: Array
    limit: Array
    rings: list[Ring]


def problem_of(arrays: dict[str, Array], rows: Rows, limit: Array) -> Problem:
    """The problem of a certificate."""
    n, fixed = rows.size, rows.fixed_points()
    centre = np.append(take_array(arrays, "centre", "<f8", n), 0.0)
    half = np.append(take_array(arrays, "half", "|u1", n), 0).astype(np.int64)
    _require(np.abs(centre) <= MOST_NUMBER, "centre", "is too large")
    _require(half <= np.where(fixed, 0, 1), "half", "is neither 0 nor 1, or not 0 at a fixed point")
    at_zero = rows.residuals(centre)
    residual = at_zero - HALF * np.round(at_zero / HALF)
    return Problem(rows, centre, half, fixed, residual, limit, rings_of(arrays, rows))


def rings_of(arrays: dict[str, Array], rows: Rows) -> list[Ring]:
    """The rings: closed walks over different points."""
    start = take_array(arrays, "ring_start", "<i4", None)
    _require(len(start) and start[0] == 0, "ring_start", "does not begin with 0")
    _require((np.diff(start) >= 3) & (np.diff(start) <= MOST_RING), "ring_start", "has a wrong length")
    pair = take_array(arrays, "ring_pair", "<i4", int(start[-1]))
    sign = take_array(arrays, "ring_sign", "|i1", int(start[-1]))
    _require((pair >= 0) & (pair < rows.pairs) & (np.abs(sign) == 1), "ring_pair", "is no pair")
    begin, end = np.where(
        sign > 0, (rows.first[pair], rows.second[pair]), (rows.second[pair], rows.first[pair])
    )
    rings: list[Ring] = []
    for a, b in zip(start[:-1].tolist(), start[1:].tolist()):
        closed = (np.roll(begin[a:b], -1) == end[a:b]).all() and len(set(begin[a:b].tolist())) == b - a
        _require(closed, f"ring {len(rings)}", "is no closed walk over different points")
        rings.append((pair[a:b].tolist(), sign[a:b].tolist(), begin[a:b].tolist()))
    return rings


@dataclass
class Level:
    """Labels centre + h (k + half / 2), h = pi/2 / divisions, with whole numbers k.

    labels: k of each point, ascending. cells: of each label, whether the cell up to the next one may hold the
    cross of an optimal field. squares: of each pair, whether two cells may, by their lower labels.
    """

    divisions: int
    labels: list[Array]
    cells: list[Array]
    squares: list[Array]


def first_level(problem: Problem, divisions: int) -> Level:
    """All crosses: cells that span a quarter turn; label 0 alone where a point is fixed."""
    labels, cells = [], []
    for half, fixed in zip(problem.half.tolist(), problem.fixed.tolist()):
        lowest = -((divisions + half) // 2)
        labels.append(np.zeros(1, np.int64) if fixed else np.arange(lowest, lowest + divisions + 1))
        cells.append(np.ones(1, bool) if fixed else np.arange(divisions + 1) < divisions)
    return Level(divisions, labels, cells, _outer(problem, cells))


def _outer(problem: Problem, cells: list[Array]) -> list[Array]:
    return [cells[i][:, None] & cells[j] for i, j in problem.rows.ends[: problem.rows.pairs]]


def next_level(
    problem: Problem, level: Level, cells: list[Array], squares: list[Array], factor: int
) -> Level:
    """The level whose cells are parts of those that are left: one of each (factor 1) or three."""
    labels, parents, within = [], [], []
    for old, kept, half, fixed in zip(level.labels, cells, problem.half.tolist(), problem.fixed.tolist()):
        lower = np.nonzero(kept)[0]
        parts = (factor * old[lower][:, None] + half * (factor // 3) + np.arange(factor)).ravel()
        both = old if fixed else np.union1d(parts, parts + 1)
        labels.append(both)
        within.append(kept if fixed else np.isin(both, parts))
        parents.append(np.zeros(len(both), np.int64))
        parents[-1][within[-1]] = lower if fixed else np.repeat(lower, factor)
    finer = _outer(problem, within)
    for e, ((i, j), old) in enumerate(zip(problem.rows.ends, squares)):
        finer[e] &= old[parents[i][:, None], parents[j]]
    return Level(level.divisions * factor, labels, within, finer)


def spread(bits: Array, step: int) -> Array:
    """The corners of cells or squares, known by their lower labels (step 1); those with a corner (-1)."""
    for axis in range(bits.ndim):
        moved = np.roll(bits, step, axis)
        np.moveaxis(moved, axis, 0)[0 if step > 0 else -1] = False
        bits = bits | moved
    return bits


def cost_table(problem: Problem, divisions: int) -> Array:
    """Lemma 2: costs of all rows at all differences of labels modulo the divisions; inf: excluded."""
    rows, h = problem.rows, HALF / divisions
    shift = (problem.half[rows.first] - problem.half[rows.second])[:, None] / 2
    best = np.full((len(rows.first), divisions), np.inf)
    for turn in (-2, -1, 0, 1):
        x = np.arange(divisions) + divisions * turn + shift
        a = problem.residual[:, None] + h * x
        deducted = np.where((shift == 0) & (np.abs(x) <= 1), np.abs(x), 0.25)
        cost = rows.weight[:, None] * (a * a - h * h * deducted)
        within = np.abs(a) <= problem.limit[:, None] + h * (1 + RELATIVE)
        best = np.where(within, np.minimum(best, cost), best)
    return best


def costs_of(problem: Problem, level: Level) -> Costs:
    """The costs of the labels of each point by strokes, and of each two labels of each pair."""
    rows, n, labels = problem.rows, level.divisions, level.labels
    table, ends = cost_table(problem, n), rows.ends[: rows.pairs]
    unary = [np.where(spread(cells, 1), 0.0, np.inf) for cells in level.cells]
    for of_stroke, (i, _) in zip(table[rows.pairs :], rows.ends[rows.pairs :]):
        unary[i] = unary[i] + of_stroke[labels[i] % n]
    costs = [
        np.where(spread(squares, 1), of_pair[(labels[i][:, None] - labels[j]) % n], np.inf)
        for of_pair, squares, (i, j) in zip(table, level.squares, ends)
    ]
    excluded = -1
    while excluded != (excluded := sum(int(np.isinf(of_point).sum()) for of_point in unary)):
        for e, (i, j) in enumerate(ends):  # labels without a partner are excluded, with all costs of theirs
            used = np.isfinite(unary[i])[:, None] & np.isfinite(unary[j])
            costs[e] = np.where(used, costs[e], np.inf)
            unary[i] = np.where(np.isfinite(costs[e]).any(axis=1), unary[i], np.inf)
            unary[j] = np.where(np.isfinite(costs[e]).any(axis=0), unary[j], np.inf)
    return unary, costs


# Section 4: shares and tables give a bound -----------------------------------------------------------------


@dataclass
class Excess:
    """Lemma 3: the cost of any labelling is at least `bound` plus its excesses, none of which is negative.

    points: excess of each label, r. pairs: of each two labels, s. tables: of each ring in use, for each of
    its steps; least: the least sum of -tables along it. error: of all sums together.
    """

    bound: float
    points: list[Array]
    pairs: list[Array]
    tables: dict[int, list[Array]]
    least: dict[int, float]
    error: float


def excess_of(problem: Problem, costs: Costs, shares: list[Array], tables: dict[int, list[Array]]) -> Excess:
    """Lemma 3: the bound and the excesses. shares: of each pair, one for each label of its first point."""
    points, pairs = list(costs[0]), list(costs[1])
    size = [_size(cost) for cost in points]
    for ring, of_ring in tables.items():
        for e, table in zip(problem.rings[ring][0], of_ring):
            pairs[e] = pairs[e] + table
            size.append(3 * _size(table))
    for e, ((i, j), share) in enumerate(zip(problem.rows.ends, shares)):
        rest = pairs[e] - share[:, None]
        other = rest.min(axis=0)  # the greatest share of the second point
        pairs[e] = rest - np.where(np.isfinite(other), other, 0.0)
        points[i], points[j] = points[i] + share, points[j] + other
        size.append(2 * _size(rest) + 2 * _size(share))
    least = [*(float(point.min()) for point in points[:-1]), 0.0]
    points = [point - bound for point, bound in zip(points, least)]
    rings = {ring: ring_least(problem, ring, pairs, of_ring) for ring, of_ring in tables.items()}
    error = ROUNDING * PRECISION * math.fsum(size)
    _require(all(map(math.isfinite, [*least, *rings.values()])), "the level", "leaves not even the field")
    return Excess(math.fsum([*least, *rings.values()]) - error, points, pairs, tables, rings, error)


def _size(numbers: Array) -> float:
    return float(np.abs(numbers[np.isfinite(numbers)]).max(initial=0.0))


def min_plus(one: Array, other: Array) -> Array:
    """The least sum over the middle labels."""
    return (one[:, :, None] + other).min(axis=1)


def along_ring(problem: Problem, ring: int, matrices: list[Array]) -> list[Array]:
    """Matrices of the steps of a ring, from first to second point, turned along the walk or back."""
    return [matrix if sign > 0 else matrix.T for matrix, sign in zip(matrices, problem.rings[ring][1])]


def ring_least(problem: Problem, ring: int, pairs: list[Array], tables: list[Array]) -> float:
    """The least sum of -tables over labels of the points of a ring, each two of a pair in use."""
    negative = [np.where(np.isfinite(pairs[e]), -t, np.inf) for e, t in zip(problem.rings[ring][0], tables)]
    product, *steps, last = along_ring(problem, ring, negative)
    for step in steps:
        product = min_plus(product, step)
    return float((product + last.T).min())


# Section 5: what a level excludes --------------------------------------------------------------------------


def kept_of(problem: Problem, level: Level, excess: Excess, most: float) -> tuple[list[Array], list[Array]]:
    """Lemma 4: the cells and squares that an optimal field of energy `most` or less may use."""
    ends, spare = problem.rows.ends, (most - excess.bound + 2 * excess.error) * (1 + RELATIVE)
    allowed = [point <= spare for point in excess.points]
    for number in range(TREES):
        for i, marginal in enumerate(tree_marginals(problem, excess, number, spare)):
            allowed[i] &= marginal <= spare
    pairs = [
        excess.points[i][:, None] + s + excess.points[j] <= spare for (i, j), s in zip(ends, excess.pairs)
    ]
    for ring in excess.tables:
        for e, marginal in zip(problem.rings[ring][0], ring_marginals(problem, ring, excess)):
            pairs[e] &= marginal <= spare
    cells = [cell & spread(labels, -1) for cell, labels in zip(level.cells, allowed)]
    squares = [square & spread(labels, -1) for square, labels in zip(level.squares, pairs)]
    for _ in range(2):
        for e, (i, j) in enumerate(ends[: len(squares)]):
            squares[e] &= cells[i][:, None] & cells[j]
            cells[i] &= squares[e].any(axis=1)
            cells[j] &= squares[e].any(axis=0)
    _require(all(cell.any() for cell in cells), "the level", "leaves not even the field")
    return cells, squares


def spanning_forest(
    problem: Problem, excess: Excess, number: int, spare: float
) -> list[tuple[int, int, int]]:
    """Point, parent and pair of the edges of a forest, parents first; pairs of great excesses come first."""
    value = np.array([np.minimum(s, spare).mean() for s in excess.pairs])
    value *= np.random.default_rng(number).uniform(1.0 if number == 0 else 0.0, 1.0, len(value))
    root, near = list(range(problem.rows.size)), [list[tuple[int, int]]() for _ in range(problem.rows.size)]
    for e in np.argsort(-value).tolist():
        i, j = problem.rows.ends[e]
        for end in (i, j):
            while root[root[end]] != root[end]:
                root[end] = root[root[end]]
        if root[i] != root[j]:
            root[root[i]] = root[j]
            near[i].append((j, e))
            near[j].append((i, e))
    edges, seen = [], [False] * len(root)
    for begin in range(len(root)):
        waiting = [] if seen[begin] else [begin]
        seen[begin] = True
        for i in waiting:
            for j, e in near[i]:
                if not seen[j]:
                    seen[j] = True
                    edges.append((j, i, e))
                    waiting.append(j)
    return edges


def tree_marginals(problem: Problem, excess: Excess, number: int, spare: float) -> list[Array]:
    """Of each label, the least sum of the excesses of points and pairs on a forest."""
    up, message = list(excess.points), dict[int, Array]()
    edges = spanning_forest(problem, excess, number, spare)
    matrices = [excess.pairs[e] if problem.rows.ends[e][0] == i else excess.pairs[e].T for i, _, e in edges]
    for (i, parent, _), matrix in zip(edges[::-1], matrices[::-1]):
        message[i] = (matrix + up[i][:, None]).min(axis=0)
        up[parent] = up[parent] + message[i]
    whole = list(up)
    for (i, parent, _), matrix in zip(edges, matrices):
        rest = whole[parent] - np.where(np.isfinite(message[i]), message[i], 0.0)  # without i; inf stays
        whole[i] = up[i] + (matrix + rest).min(axis=1)
    return whole


def ring_marginals(problem: Problem, ring: int, excess: Excess) -> list[Array]:
    """Of each two labels of the pairs of a ring, the least sum of all excesses on it."""
    pairs, _, points = problem.rings[ring]
    own = [excess.pairs[e] - table for e, table in zip(pairs, excess.tables[ring])]
    steps = [s + excess.points[i][:, None] for s, i in zip(along_ring(problem, ring, own), points)]
    after = [steps[-1]]  # from the end of each step to the first point
    for step in steps[-2:0:-1]:
        after.insert(0, min_plus(step, after[0]))
    marginals, before = [steps[0] + after[0].T], steps[0]
    for step, rest in zip(steps[1:-1], after[1:]):
        marginals.append(step + min_plus(rest, before).T)
        before = min_plus(before, step)
    marginals.append(steps[-1] + before.T)
    return along_ring(problem, ring, [marginal - excess.least[ring] for marginal in marginals])


# Section 6: forced jumps -----------------------------------------------------------------------------------


def possible_turns(
    problem: Problem, level: Level, cells: list[Array], squares: list[Array]
) -> list[list[int]]:
    """Lemma 5: of each row, by how much more than the centre's its integer may be in an optimal field."""
    rows, h, turns = problem.rows, HALF / level.divisions, list[list[int]]()
    reach = problem.limit + h * (1 + RELATIVE) + RELATIVE
    position = [h * (labels + half / 2) for labels, half in zip(level.labels, problem.half.tolist())]
    for row, (i, j) in enumerate(rows.ends):
        square = squares[row] if row < rows.pairs else cells[i][:, None]
        at = (problem.residual[row] + position[i][:, None] - position[j])[square]
        turns.append([turn for turn in range(-3, 4) if (np.abs(at + HALF * turn) <= reach[row]).any()])
    return turns


def cases_of(turns: list[list[int]]) -> list[tuple[int, ...]]:
    """All choices of one turn for each row; none if there are too many."""
    return list(itertools.product(*turns)) if math.prod(map(len, turns)) <= MOST_CASES else []


def cases_bound(problem: Problem, turns: list[list[int]], angles: Array) -> float:
    """Lemma 6: a lower bound of the energy in all cases, by a tangent at the angles (k, n) of each."""
    rows, cases = problem.rows, cases_of(turns)
    if not cases or len(cases) != len(angles):
        return -math.inf
    nearest = np.round(-rows.residuals(problem.centre) / HALF)
    bounds: list[float] = []
    for turn, angle in zip(cases, np.column_stack([angles, np.zeros(len(angles))])):
        r = rows.residuals(angle) + HALF * (nearest + np.array(turn))
        force = 2 * rows.weight * r
        slope = np.bincount(rows.first, force, rows.size + 1) - np.bincount(rows.second, force, rows.size + 1)
        away = np.abs(angle - problem.centre) + np.where(problem.fixed, 0.0, np.pi)
        size = float(np.sum(rows.weight * (1 + r * r) * (1 + np.abs(angle[rows.first])))) * (1 + away.max())
        bounds.append(
            math.fsum(rows.weight * r * r) - math.fsum(np.abs(slope) * away) - ROUNDING * PRECISION * size
        )
    return min(bounds)


# Section 7: the theorem ------------------------------------------------------------------------------------


@dataclass
class ProvenClaim:
    """Findings of the checker. levels: the bounds of the levels. forced_pairs (m,): where jumps are forced.

    bound: what a certificate may claim everywhere; it is less than what is proven here by a margin for other
    processors.
    """

    status: str
    energy: float
    bound: float
    levels: list[float]
    forced_pairs: Array
    norm: Any = 2

    @property
    def forced(self) -> int:
        """The number of forced jumps."""
        return int(self.forced_pairs.sum())


def check_arrays(arrays: dict[str, Array], limit: Array | None = None) -> ProvenClaim:
    """Check the arrays of a certificate and return what they prove. limit: `limits_of`, where it is known.

    Raises NotProvenError when a level does not follow from the one before, or when less is proven than
    claimed, and UnreadableError for arrays that are not a certificate.
    """
    try:
        rows = rows_of(arrays)
        return _check_levels(arrays, problem_of(arrays, rows, limits_of(rows) if limit is None else limit))
    except (ValueError, TypeError, KeyError, IndexError, OverflowError, RecursionError) as error:
        raise UnreadableError(f"is damaged ({type(error).__name__}: {str(error)[:80]})") from error


def _check_levels(arrays: dict[str, Array], problem: Problem) -> ProvenClaim:
    head, rows = head_of(arrays), problem.rows
    energy, error = energy_of(arrays, rows)
    threshold = number_in(head, "threshold", energy + error, math.inf)
    divisions = take_array(arrays, "divisions", "<i4", None).tolist()
    _require(1 <= len(divisions) <= MOST_LEVELS, "divisions", "has too few or too many levels")
    _require(divisions[0] >= 3 and max(divisions) <= MOST_DIVISIONS, "divisions", "is out of range")
    check_size(problem, [divisions[0]] * (rows.size + 1))
    level, kept, bounds = first_level(problem, divisions[0]), None, list[float]()
    for number, count in enumerate(divisions):
        if kept is not None:
            factor = count // level.divisions
            _require(count == factor * level.divisions and factor in (1, 3), "divisions", "grows otherwise")
            stored = stored_cells(arrays, number - 1, level)
            covered = all((a | ~b).all() for new, old in zip(stored, kept) for a, b in zip(new, old))
            _require(covered, f"level {number}", "does not cover what the level before leaves")
            check_size(problem, [factor * int(cell.sum()) for cell in stored[0]])
            level = next_level(problem, level, *stored, factor)
        shares, tables = stored_shares(arrays, number, problem, level)
        excess = excess_of(problem, costs_of(problem, level), shares, tables)
        bounds.append(excess.bound)
        kept = kept_of(problem, level, excess, threshold)
    assert kept is not None
    turns = possible_turns(problem, level, *kept)
    angles = take_array(arrays, "cases", "<f8", None, rows.size)
    _require(np.abs(angles) <= MOST_NUMBER, "cases", "is too large") if angles.size else None
    least = cases_bound(problem, turns, angles)
    forced = np.array([of_row == [0] for of_row in turns], bool)
    proven = max(0.0, min(max(*bounds, least), energy - error))
    bound = max(0.0, proven - SPARE * (1 + proven))
    claim = ProvenClaim(status_of(energy, bound), energy, bound, bounds, forced[: rows.pairs])
    check_claim(head, claim, proven, error)
    return claim


def check_size(problem: Problem, cells: list[int]) -> None:
    """Raise NotProvenError for a level with more costs than memory may hold. cells: of each point."""
    costs = sum((cells[i] + 1) * (cells[j] + 1) for i, j in problem.rows.ends[: problem.rows.pairs])
    _require(costs <= MOST_COSTS, "the level", "has too many labels")


def energy_of(arrays: dict[str, Array], rows: Rows) -> tuple[float, float]:
    """The energy of the field, and the greatest error of that number."""
    n, m = rows.size, rows.pairs
    alpha, p = take_array(arrays, "alpha", "<f8", n), take_array(arrays, "p", "<i4", m)
    lower = np.zeros(n)
    lower[rows.first[m:]] = -rows.offset[m:] - QUARTER
    inside = (alpha >= lower - RELATIVE) & (alpha <= lower + HALF + RELATIVE)
    _require(inside, "alpha", "is outside its window")
    _require(np.abs(p) <= 16, "p", "is too large")
    r = rows.residuals(np.append(alpha, 0.0))
    r[:m] += HALF * p
    return math.fsum(rows.weight * r * r), ROUNDING * PRECISION * float(np.sum(rows.weight * (1 + r * r)))


def stored_cells(arrays: dict[str, Array], number: int, level: Level) -> tuple[list[Array], list[Array]]:
    """The cells and squares that a level keeps, as the certificate states them."""
    kept = []
    for name, within in (("cells", level.cells), ("squares", level.squares)):
        ends = np.cumsum([0, *(bits.size for bits in within)]).tolist()
        packed = take_array(arrays, f"level_{number}_{name}", "|u1", (ends[-1] + 7) // 8)
        flat = np.unpackbits(packed, count=ends[-1]).astype(bool)
        kept.append([flat[a:b].reshape(w.shape) & w for a, b, w in zip(ends, ends[1:], within)])
    return kept[0], kept[1]


def stored_shares(
    arrays: dict[str, Array], number: int, problem: Problem, level: Level
) -> tuple[list[Array], dict[int, list[Array]]]:
    """The shares of all pairs and the tables of rings of a level, as the certificate states them."""
    name, m = f"level_{number}", problem.rows.pairs
    rings = take_array(arrays, f"{name}_rings", "<i4", None).tolist()
    known = all(0 <= ring < len(problem.rings) for ring in rings) and len(set(rings)) == len(rings)
    _require(known, f"{name}_rings", "names no ring, or one twice")
    blocks = []
    for kind, shapes in (
        ("shares", [level.labels[i].shape for i, _ in problem.rows.ends[:m]]),
        ("tables", [level.squares[e].shape for ring in rings for e in problem.rings[ring][0]]),
    ):
        unit = float(take_array(arrays, f"{name}_{kind}_unit", "<f8", 1)[0])
        _require(abs(unit - 0.5) <= 0.5, f"{name}_{kind}_unit", "is not in [0, 1]")
        ends = np.cumsum([0, *map(math.prod, shapes)]).tolist()
        steps = take_array(arrays, f"{name}_{kind}", "<i4", ends[-1])
        blocks.append([steps[a:b].reshape(shape) * unit for a, b, shape in zip(ends, ends[1:], shapes)])
    waiting = iter(blocks[1])
    return blocks[0], {ring: [next(waiting) for _ in problem.rings[ring][0]] for ring in rings}


def check_claim(head: dict[str, Any], claim: ProvenClaim, most: float, error: float) -> None:
    """Raise NotProvenError unless the claim is proven. most: the greatest bound that is."""
    energy, bound = number_in(head, "energy", 0.0, math.inf), number_in(head, "bound", -math.inf, math.inf)
    close = abs(energy - claim.energy) <= error + 1e-12 * max(1.0, claim.energy)
    _require(close, "energy", f"is claimed as {energy!r}, but the field has {claim.energy!r}")
    proven = f"only {most!r} is proven, for an energy of {claim.energy!r}"
    _require(bound <= most, "bound", f"is claimed as {bound!r}, but {proven}")
    true = head.get("status") == "gap" or (
        head.get("status") == "optimal" and status_of(energy, bound) == claim.status == "optimal"
    )
    _require(true, "status", f"is {head.get('status')!r}, but {proven}")
