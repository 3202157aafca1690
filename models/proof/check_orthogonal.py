"""Check a certificate of orthogonal crosses with no code of its prover: `python check_orthogonal.py FILE`.

This file needs Python 3.9 or newer, NumPy, and check_certificate.py beside it, which reads arrays. It follows
the page "Proofs for orthogonal crosses" (docs/orthogonal-proofs.md), which proves the lemmas and describes
the arrays. Exit codes are those of check_certificate.py.

Rounding. Shares and tables may be any numbers, so errors in them do no harm. Cells have whole numbers and are
exact. What counts is how much an inequality may fail at a point, a pair or a ring: less than ROUNDING times
the machine's precision times the size of the numbers that enter. Their sum is taken off every bound.
Sums of costs that are not negative have a relative error below RELATIVE. pi stands for the double next to it.
"""

from __future__ import annotations

import itertools
import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np

try:
    from . import check_certificate as base
except ImportError:  # run as a program
    import check_certificate as base  # type: ignore[import-not-found,no-redef]

FORMAT, VERSION = "crossfield-orthogonal-certificate", 2
HALF, QUARTER, MARGIN = base.HALF, base.QUARTER, base.ROUNDING * base.PRECISION
RELATIVE = 1e-9
FLAT = 1.1e-8  # radians; instances take smaller turns between frames as 0
MOST_LEVELS = 64
MOST_DIVISIONS = 10_000  # cells of a quarter turn
MOST_COSTS = 1 << 27  # of two labels of all pairs of a level: some 10 GB
MOST_RING = 64  # pairs of a ring
MOST_DENSE = 6000  # points up to which limits are computed; beyond, they are pi/4
MOST_CASES = 256  # of integers after the last level
MOST_NUMBER = 1e6  # of a weight and of an angle

Array = Any
Ring = tuple[list[int], list[int], list[int]]
Costs = tuple[list[Array], list[Array]]


# Section 1: the instance and its rows ----------------------------------------------------------------------


class CentredRows:
    """The terms weight r^2 of the energy, those of pairs, then those of strokes; and a centre of labels.

    size: number of points n; point n is the ground, of angle 0. first, second (r,), ends: of each row.
    offset (r,): r = alpha_first - alpha_second + offset + pi/2 z. pairs: number of pairs. limit (r,): of
    Lemma 1. rings: of each ring, its pairs, 1 or -1 for their directions, and its points in order. centre
    (n + 1,): angles. nearest, residual (r,): integers of least energy there, and residuals. half (n + 1,): 1
    where labels are shifted by half a step. fixed (n + 1,): points with the label 0 alone.
    """

    def __init__(self, arrays: dict[str, Array], limit: Array | None = None) -> None:
        """Read a certificate. limit: of Lemma 1, where it is known."""
        head = base.json_of(arrays, "instance_head")
        base.require(head.get("gauge") == "strokes", "gauge", "is not strokes")
        base.require(head.get("orthogonal") is True, "orthogonal", "is not true")
        if "instance_faces" in arrays:
            n, first, second, kappa, point = pairs_of_mesh(arrays)
        else:
            white, first, second, point = base.pixels_of(arrays)
            n, kappa = len(white), np.zeros(len(first))
        m, weight = len(first), np.ones(len(first))
        if "instance_pair_weights" in arrays:
            weight = base.take_array(arrays, "instance_pair_weights", "<f8", m)
        base.require((weight > 0) & (weight <= MOST_NUMBER), "pair_weights", "is not in (0, 1e6]")
        theta, of_strokes = base.strokes_of(arrays, head, point)
        self.size, self.pairs, self.first = n, m, np.concatenate([first, point])
        self.second = np.concatenate([second, np.full(len(point), n)])
        self.ends = list(zip(self.first.tolist(), self.second.tolist()))
        self.offset, self.weight = np.concatenate([kappa, -theta]), np.concatenate([2 * weight, of_strokes])
        self.rings, self.fixed = rings_of(arrays, first, second), self._fixed_points()
        self.limit = limits_of(self) if limit is None else limit
        self.centre = np.append(base.take_array(arrays, "centre", "<f8", n), 0.0)
        base.require(np.abs(self.centre) <= MOST_NUMBER, "centre", "is too large")
        self.half = np.append(base.take_array(arrays, "half", "|u1", n), 0).astype(np.int64)
        base.require(self.half <= np.where(self.fixed, 0, 1), "half", "is not 0, or 1 at a point not fixed")
        self.nearest = np.round(-self.residuals(self.centre) / HALF)
        self.residual = self.residuals(self.centre) + HALF * self.nearest

    def residuals(self, angle: Array) -> Array:
        """Residuals of all rows at z = 0; angle (n + 1,), 0 at the ground."""
        return angle[self.first] - angle[self.second] + self.offset

    def _fixed_points(self) -> Array:
        """The ground and the first point of each part that no row of weight joins to it."""
        first, second = self.first[self.weight > 0], self.second[self.weight > 0]
        own = np.append(np.arange(1, self.size + 1), 0)
        part, before = own, own + 1
        while (part != before).any():
            before, part = part, part.copy()
            np.minimum.at(part, first, before[second])
            np.minimum.at(part, second, before[first])
        return np.asarray(part == own)


def pairs_of_mesh(arrays: dict[str, Array]) -> tuple[int, Array, Array, Array, Array]:
    """Number of faces, pairs that share an edge, their kappa, and stroke faces."""
    vertices = base.take_array(arrays, "instance_vertices", "<f8", None, 3)
    faces = base.take_array(arrays, "instance_faces", "<i4", None, 3).astype(np.int64)
    point = base.take_array(arrays, "instance_stroke_faces", "<i4", None).astype(np.int64)
    n, v = len(faces), len(vertices)
    base.require((faces >= 0) & (faces < v), "faces", "names no vertex")
    base.require((point >= 0) & (point < n), "stroke_faces", "is no face")
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    edge_of = {key: edge for edge, key in enumerate((start * v + end).tolist())}
    base.require(len(edge_of) == 3 * n, "faces", "are not oriented, or three meet at an edge")
    opposite = np.array([edge_of.get(key, -1) for key in (end * v + start).tolist()], np.int64)
    edge = np.nonzero((opposite >= 0) & (start < end))[0]
    ends = edge // 3, opposite[edge] // 3
    corner = vertices[faces]
    x = corner[:, 1] - corner[:, 0]  # the axis of the frame
    z = np.cross(x, corner[:, 2] - corner[:, 0])
    y = np.cross(z, x) / np.linalg.norm(z, axis=1)[:, None]  # as long as x
    along = vertices[end[edge]] - vertices[start[edge]]
    one, other = (np.arctan2((y[f] * along).sum(axis=1), (x[f] * along).sum(axis=1)) for f in ends)
    kappa = base.take_array(arrays, "kappa", "<f8", len(edge))
    wrong = np.abs(np.remainder(other - one - kappa + np.pi, 2 * np.pi) - np.pi)
    base.require(wrong < FLAT, "kappa", "is not that of the mesh")
    return n, *ends, kappa, point


def rings_of(arrays: dict[str, Array], first: Array, second: Array) -> list[Ring]:
    """The rings: closed walks over different points. first, second (m,): the ends of pairs."""
    start = base.take_array(arrays, "ring_start", "<i4", None)
    base.require(len(start) and start[0] == 0, "ring_start", "does not begin with 0")
    base.require((np.diff(start) >= 3) & (np.diff(start) <= MOST_RING), "ring_start", "has a wrong length")
    pair = base.take_array(arrays, "ring_pair", "<i4", int(start[-1]))
    sign = base.take_array(arrays, "ring_sign", "|i1", int(start[-1]))
    base.require((pair >= 0) & (pair < len(first)) & (np.abs(sign) == 1), "ring_pair", "is no pair")
    begin, end = np.where(sign > 0, [first[pair], second[pair]], [second[pair], first[pair]])
    rings: list[Ring] = []
    for a, b in zip(start[:-1].tolist(), start[1:].tolist()):
        closed = (np.roll(begin[a:b], -1) == end[a:b]).all() and len(set(begin[a:b].tolist())) == b - a
        base.require(closed, f"ring {len(rings)}", "is no closed walk over different points")
        rings.append((pair[a:b].tolist(), sign[a:b].tolist(), begin[a:b].tolist()))
    return rings


def limits_of(rows: CentredRows) -> Array:
    """Lemma 1: |r| of every row of an optimal field is at most this, shape (r,)."""
    n, first, second, weight = rows.size, rows.first, rows.second, rows.weight
    if n > MOST_DENSE:
        return np.full(len(first), QUARTER)
    matrix = np.zeros((n + 1, n + 1))
    for i, j, sign in ((first, first, 1), (second, second, 1), (first, second, -1), (second, first, -1)):
        np.add.at(matrix, (i, j), sign * weight)
    matrix += np.eye(n + 1) * 1e-9 * max(matrix.max(), 1e-300)
    inverse = np.zeros((n + 1, n + 1))
    inverse[:n, :n] = np.linalg.inv(matrix[:n, :n])
    resistance = np.zeros(len(first))
    for e, (i, j) in enumerate(rows.ends):  # any potential gives a lower bound of the resistance
        potential = inverse[i] - inverse[j]
        drop = potential[first] - potential[second]
        power = weight @ (drop * drop)
        resistance[e] = drop[e] ** 2 / power if power > 0 else 0.0
    return QUARTER * np.clip(1 - weight * resistance * (1 - RELATIVE), 0.0, 1.0) + RELATIVE


# Section 2: labels, cells and costs ------------------------------------------------------------------------


@dataclass
class CellLevel:
    """Labels centre + h (k + half / 2), h = pi/2 / divisions, with whole numbers k.

    cells: of each point, the lower labels k, ascending, of cells that may hold the cross of an optimal field.
    squares: of each pair, whether two cells may. labels: k of each point, ascending: the ends of its cells.
    """

    divisions: int
    fixed: Array
    cells: list[Array]
    squares: list[Array]

    def __post_init__(self) -> None:
        ends = zip(self.cells, self.fixed)
        self.labels = [cells if fixed else np.union1d(cells, cells + 1) for cells, fixed in ends]
        self.lower = [np.searchsorted(labels, cells) for labels, cells in zip(self.labels, self.cells)]

    def corners(self, *points: int) -> Iterator[tuple[Array, ...]]:
        """Where the corners of all cells of a point, or squares of two, lie among the labels."""
        last = [len(self.labels[i]) - 1 for i in points]
        for up in itertools.product((0, 1), repeat=len(points)):
            yield np.ix_(*(np.minimum(self.lower[i] + u, end) for i, u, end in zip(points, up, last)))

    def with_corner(self, labels: Array, *points: int) -> Array:
        """Whether each cell, or square, has one of these labels, or two labels, at a corner."""
        return np.logical_or.reduce([labels[at] for at in self.corners(*points)])

    def corners_of(self, squares: Array, *points: int) -> Array:
        """Whether each two labels are a corner of one of these squares."""
        labels = np.zeros([len(self.labels[i]) for i in points], bool)
        for at in self.corners(*points):
            labels[at] |= squares
        return labels


def first_level(rows: CentredRows, divisions: int) -> CellLevel:
    """All crosses: cells that span a quarter turn; label 0 alone where a point is fixed."""
    check_size(rows, np.where(rows.fixed, 1, divisions))
    lowest = np.where(rows.fixed, 0, -((divisions + rows.half) // 2))
    cells = [low + np.arange(1 if fixed else divisions) for low, fixed in zip(lowest, rows.fixed)]
    squares = [np.ones((len(cells[i]), len(cells[j])), bool) for i, j in rows.ends[: rows.pairs]]
    return CellLevel(divisions, rows.fixed, cells, squares)


def check_size(rows: CentredRows, cells: Array) -> None:
    """Raise NotProvenError for a level with more costs than memory may hold. cells: of each point."""
    costs = np.sum((cells[rows.first[: rows.pairs]] + 1) * (cells[rows.second[: rows.pairs]] + 1))
    base.require(costs <= MOST_COSTS, "the level", "has too many labels")


def cells_of(rows: CentredRows, level: CellLevel, squares: list[Array]) -> list[Array]:
    """Whether each cell has a square with some cell of every neighbour."""
    kept = [np.ones(len(cells), bool) for cells in level.cells]
    for (i, j), square in zip(rows.ends, squares):
        kept[i] &= square.any(axis=1)
        kept[j] &= square.any(axis=0)
    return kept


def next_level(rows: CentredRows, level: CellLevel, squares: list[Array], factor: int) -> CellLevel:
    """The level whose cells are parts of those that are left: one of each (factor 1) or three."""
    kept, parts = cells_of(rows, level, squares), np.where(rows.fixed, 1, factor)
    check_size(rows, parts * np.array([left.sum() for left in kept]))
    cells = [
        (count * lower[left][:, None] + half * (count // 3) + np.arange(count)).ravel()
        for lower, left, half, count in zip(level.cells, kept, rows.half, parts)
    ]
    finer = [
        square[np.ix_(kept[i], kept[j])].repeat(parts[i], axis=0).repeat(parts[j], axis=1)
        for (i, j), square in zip(rows.ends, squares)
    ]
    return CellLevel(level.divisions * factor, rows.fixed, cells, finer)


def cost_table(rows: CentredRows, divisions: int) -> Array:
    """Lemma 2: costs of all rows at all differences of labels modulo the divisions; inf: excluded."""
    h = HALF / divisions
    shift = (rows.half[rows.first] - rows.half[rows.second])[:, None] / 2
    best = np.full((len(rows.first), divisions), np.inf)
    for turn in (-2, -1, 0, 1):
        x = np.arange(divisions) + divisions * turn + shift
        a = rows.residual[:, None] + h * x
        deducted = np.where((shift == 0) & (np.abs(x) <= 1), np.abs(x), 0.25)
        cost = rows.weight[:, None] * (a * a - h * h * deducted)
        within = np.abs(a) <= rows.limit[:, None] + h * (1 + RELATIVE)
        best = np.where(within, np.minimum(best, cost), best)
    return best


def costs_of(rows: CentredRows, level: CellLevel) -> Costs:
    """The costs of the labels of each point by strokes, and of each two labels of each pair."""
    n, labels = level.divisions, level.labels
    table, ends = cost_table(rows, n), rows.ends[: rows.pairs]
    unary = [np.zeros(len(of_point)) for of_point in labels]
    for of_stroke, (i, _) in zip(table[rows.pairs :], rows.ends[rows.pairs :]):
        unary[i] = unary[i] + of_stroke[labels[i] % n]
    costs = [
        np.where(level.corners_of(squares, i, j), of_pair[(labels[i][:, None] - labels[j]) % n], np.inf)
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


# Section 3: bound and exclusion ----------------------------------------------------------------------------


class Excess:
    """Lemma 3: the cost of any labelling is at least `bound` plus its excesses, none of which is negative.

    points: excess of each label, r. pairs: of each two labels, s. tables: of each ring in use, for each of
    its steps; least: the least sum of -tables along it. error: of all sums together.
    """

    def __init__(
        self, rows: CentredRows, costs: Costs, shares: list[Array], tables: dict[int, list[Array]]
    ) -> None:
        """Compute them. shares: of each pair, one for each label of its first point."""
        points, pairs = list(costs[0]), list(costs[1])
        size = [greatest(cost) for cost in points]
        for ring, of_ring in tables.items():
            for e, table in zip(rows.rings[ring][0], of_ring):
                pairs[e] = pairs[e] + table
                size.append(3 * greatest(table))
        for e, ((i, j), share) in enumerate(zip(rows.ends, shares)):
            rest = pairs[e] - share[:, None]
            other = rest.min(axis=0)  # the greatest share of the second point
            pairs[e] = rest - np.where(np.isfinite(other), other, 0.0)
            points[i], points[j] = points[i] + share, points[j] + other
            size.append(2 * greatest(rest) + 2 * greatest(share))
        least = [*(float(point.min()) for point in points[:-1]), 0.0]
        self.points, self.pairs, self.tables = [p - bound for p, bound in zip(points, least)], pairs, tables
        self.least = {ring: ring_least(rows, ring, pairs, of_ring) for ring, of_ring in tables.items()}
        least += self.least.values()
        base.require(np.isfinite(least).all(), "the level", "leaves not even the field")
        self.error = MARGIN * math.fsum(size)
        self.bound = math.fsum(least) - self.error


def greatest(numbers: Array) -> float:
    """The greatest absolute value of finite numbers."""
    return float(np.abs(numbers[np.isfinite(numbers)]).max(initial=0.0))


def min_plus(one: Array, other: Array) -> Array:
    """The least sum over the middle labels."""
    least = np.full((len(one), other.shape[1]), np.inf)
    for column, row in zip(one.T, other):  # all at once would leave the processor's cache
        np.minimum(least, column[:, None] + row, out=least)
    return least


def along_ring(rows: CentredRows, ring: int, matrices: list[Array]) -> list[Array]:
    """Matrices of the steps of a ring, from first to second point, turned along the walk or back."""
    return [matrix if sign > 0 else matrix.T for matrix, sign in zip(matrices, rows.rings[ring][1])]


def ring_least(rows: CentredRows, ring: int, pairs: list[Array], tables: list[Array]) -> float:
    """The least sum of -tables over labels of the points of a ring, each two of a pair in use."""
    negative = [np.where(np.isfinite(pairs[e]), -t, np.inf) for e, t in zip(rows.rings[ring][0], tables)]
    *steps, last = along_ring(rows, ring, negative)
    return float((reduce(min_plus, steps) + last.T).min())


def kept_of(rows: CentredRows, level: CellLevel, excess: Excess, forests: Array, most: float) -> list[Array]:
    """Lemma 4: the squares that an optimal field of energy `most` or less may use."""
    ends, spare = rows.ends, (most - excess.bound + 2 * excess.error) * (1 + RELATIVE)
    allowed = [point <= spare for point in excess.points]
    for forest in forests:
        for i, marginal in enumerate(forest_marginals(rows, excess, forest.tolist())):
            allowed[i] &= marginal <= spare
    cells = [level.with_corner(labels, i) for i, labels in enumerate(allowed)]
    pairs = [
        excess.points[i][:, None] + s + excess.points[j] <= spare for (i, j), s in zip(ends, excess.pairs)
    ]
    for ring in excess.tables:
        for e, marginal in zip(rows.rings[ring][0], ring_marginals(rows, ring, excess)):
            pairs[e] &= marginal <= spare
    squares = [level.with_corner(labels, i, j) for (i, j), labels in zip(ends, pairs)]
    squares = [square & within for square, within in zip(squares, level.squares)]
    for _ in range(2):
        squares = [square & cells[i][:, None] & cells[j] for (i, j), square in zip(ends, squares)]
        cells = cells_of(rows, level, squares)
    base.require(all(cell.any() for cell in cells), "the level", "leaves not even the field")
    return squares


def forest_marginals(rows: CentredRows, excess: Excess, forest: list[int]) -> list[Array]:
    """Of each label, the least sum of the excesses of points and pairs on a forest.

    forest: its pairs; all that are joined come one after the other, each with a point of those before.
    """
    edges, reached, up = list[tuple[int, int, Array]](), set[int](), list(excess.points)
    for e in forest:
        i, j = rows.ends[e]
        child, parent = (j, i) if i in reached else (i, j)
        base.require(child not in reached, "forests", "has a cycle")
        reached |= {i, j}
        edges.append((child, parent, excess.pairs[e] if child == i else excess.pairs[e].T))
    message = dict[int, Array]()
    for i, parent, matrix in reversed(edges):
        message[i] = (matrix + up[i][:, None]).min(axis=0)
        up[parent] = up[parent] + message[i]
    whole = list(up)
    for i, parent, matrix in edges:
        rest = whole[parent] - np.where(np.isfinite(message[i]), message[i], 0.0)  # without i; inf stays
        whole[i] = up[i] + (matrix + rest).min(axis=1)
    return whole


def ring_marginals(rows: CentredRows, ring: int, excess: Excess) -> list[Array]:
    """Of each two labels of the pairs of a ring, the least sum of all excesses on it."""
    pairs, _, points = rows.rings[ring]
    own = [excess.pairs[e] - table for e, table in zip(pairs, excess.tables[ring])]
    steps = [s + excess.points[i][:, None] for s, i in zip(along_ring(rows, ring, own), points)]
    before = list(itertools.accumulate(steps[:-1], min_plus))  # from the first point
    after = list(itertools.accumulate(steps[:0:-1], lambda back, step: min_plus(step, back)))[::-1]
    middle = [step + min_plus(back, ahead).T for step, ahead, back in zip(steps[1:-1], before, after[1:])]
    marginals = [steps[0] + after[0].T, *middle, steps[-1] + before[-1].T]
    return along_ring(rows, ring, [marginal - excess.least[ring] for marginal in marginals])


# Section 4: the last step ----------------------------------------------------------------------------------


def possible_turns(rows: CentredRows, level: CellLevel, squares: list[Array]) -> list[list[int]]:
    """Lemma 5: of each row, by how much more than the centre's its integer may be in an optimal field."""
    h, turns, cells = HALF / level.divisions, list[list[int]](), cells_of(rows, level, squares)
    reach = rows.limit + h * (1 + RELATIVE) + RELATIVE
    position = [h * (lower + half / 2) for lower, half in zip(level.cells, rows.half.tolist())]
    for row, (i, j) in enumerate(rows.ends):
        square = squares[row] if row < rows.pairs else cells[i][:, None]
        at = (rows.residual[row] + position[i][:, None] - position[j])[square]
        turns.append([turn for turn in range(-3, 4) if (np.abs(at + HALF * turn) <= reach[row]).any()])
    return turns


def cases_of(turns: list[list[int]]) -> list[tuple[int, ...]]:
    """All choices of one turn for each row; none if there are too many."""
    return list(itertools.product(*turns)) if math.prod(map(len, turns)) <= MOST_CASES else []


def cases_bound(rows: CentredRows, turns: list[list[int]], angles: Array) -> float:
    """Lemma 6: a lower bound of the energy in all cases, by a tangent at the angles (k, n) of each."""
    cases = cases_of(turns)
    if not cases or len(cases) != len(angles):
        return -math.inf
    bounds: list[float] = []
    for turn, angle in zip(cases, np.column_stack([angles, np.zeros(len(angles))])):
        r = rows.residuals(angle) + HALF * (rows.nearest + np.array(turn))
        force = 2 * rows.weight * r
        slope = np.bincount(rows.first, force, rows.size + 1) - np.bincount(rows.second, force, rows.size + 1)
        away = np.abs(angle - rows.centre) + np.where(rows.fixed, 0.0, np.pi)
        size = float(np.sum(rows.weight * (1 + r * r) * (1 + np.abs(angle[rows.first])))) * (1 + away.max())
        bounds.append(math.fsum(rows.weight * r * r) - math.fsum(np.abs(slope) * away) - MARGIN * size)
    return min(bounds)


# The theorem -----------------------------------------------------------------------------------------------


@base.refuse_damage
def check_arrays(arrays: dict[str, Array], limit: Array | None = None) -> base.ProvenClaim:
    """Check the arrays of a certificate and return what they prove. limit: of Lemma 1, where it is known.

    Raises NotProvenError when a level does not follow from the one before, or when less is proven than
    claimed, and UnreadableError for arrays that are not a certificate.
    """
    head, rows = base.head_of(arrays, FORMAT, VERSION), CentredRows(arrays, limit)
    energy, error = energy_of(arrays, rows)
    threshold = base.number_in(head, "threshold", energy + error, math.inf)
    divisions = base.take_array(arrays, "divisions", "<i4", None).tolist()
    base.require(1 <= len(divisions) <= MOST_LEVELS, "divisions", "has too few or too many levels")
    base.require(divisions[0] >= 3 and max(divisions) <= MOST_DIVISIONS, "divisions", "is out of range")
    level, bounds, squares = first_level(rows, divisions[0]), list[float](), list[Array]()
    for number, count in enumerate(divisions):
        if number:
            factor, stored = count // level.divisions, stored_squares(arrays, number - 1, level)
            grows = count == factor * level.divisions and factor in (1, 3)
            base.require(grows, "divisions", "grows otherwise")
            covered = all((new | ~old).all() for new, old in zip(stored, squares))
            base.require(covered, f"level {number}", "does not cover what the level before leaves")
            level = next_level(rows, level, stored, factor)
        excess = Excess(rows, costs_of(rows, level), *stored_shares(arrays, number, rows, level))
        bounds.append(excess.bound)
        forests = base.take_array(arrays, f"level_{number}_forests", "<i4", None, None)
        base.require((forests >= 0).all() and (forests < rows.pairs).all(), "forests", "names no pair")
        squares = kept_of(rows, level, excess, forests, threshold)
    turns = possible_turns(rows, level, squares)
    angles = base.take_array(arrays, "cases", "<f8", None, rows.size)
    base.require(np.abs(angles).max(initial=0.0) <= MOST_NUMBER, "cases", "is too large")
    proven = max(0.0, min(max(*bounds, cases_bound(rows, turns, angles)), energy - error))
    bound = max(0.0, proven - base.SPARE * (1 + proven))
    forced = np.array([of_row == [0] for of_row in turns[: rows.pairs]], bool)
    claim = base.ProvenClaim(base.status_of(energy, bound), 2, energy, bound, forced, bounds)
    base.check_claim(head, claim, proven, error)
    return claim


def energy_of(arrays: dict[str, Array], rows: CentredRows) -> tuple[float, float]:
    """The energy of the field, and the greatest error of that number."""
    n, m = rows.size, rows.pairs
    alpha, p = base.take_array(arrays, "alpha", "<f8", n), base.take_array(arrays, "p", "<i4", m)
    lower = np.zeros(n)
    lower[rows.first[m:]] = -rows.offset[m:] - QUARTER
    inside = (alpha >= lower - RELATIVE) & (alpha <= lower + HALF + RELATIVE)
    base.require(inside, "alpha", "is outside its window")
    base.require(np.abs(p) <= 16, "p", "is too large")
    r = rows.residuals(np.append(alpha, 0.0))
    r[:m] += HALF * p
    return math.fsum(rows.weight * r * r), MARGIN * float(np.sum(rows.weight * (1 + r * r)))


def stored_squares(arrays: dict[str, Array], number: int, level: CellLevel) -> list[Array]:
    """The squares that a level keeps, as the certificate states them."""
    shapes = [square.shape for square in level.squares]
    size = sum(map(math.prod, shapes))
    packed = base.take_array(arrays, f"level_{number}_squares", "|u1", (size + 7) // 8)
    stored = split(np.unpackbits(packed, count=size).astype(bool), shapes)
    return [square & within for square, within in zip(stored, level.squares)]


def split(numbers: Array, shapes: list[Any]) -> list[Array]:
    """Consecutive parts of a flat array, in these shapes."""
    ends = np.cumsum([0, *map(math.prod, shapes)]).tolist()
    return [numbers[a:b].reshape(shape) for a, b, shape in zip(ends, ends[1:], shapes)]


def stored_shares(
    arrays: dict[str, Array], number: int, rows: CentredRows, level: CellLevel
) -> tuple[list[Array], dict[int, list[Array]]]:
    """The shares of all pairs and the tables of rings of a level, as the certificate states them."""
    rings = base.take_array(arrays, f"level_{number}_rings", "<i4", None).tolist()
    known = all(0 <= ring < len(rows.rings) for ring in rings) and len(set(rings)) == len(rings)
    base.require(known, f"level_{number}_rings", "names no ring, or one twice")
    steps, size = [e for ring in rings for e in rows.rings[ring][0]], list(map(len, level.labels))
    shapes: list[Any] = [(size[i],) for i, _ in rows.ends[: rows.pairs]]
    shapes += [(size[i], size[j]) for i, j in map(rows.ends.__getitem__, steps)]
    unit = float(base.take_array(arrays, f"level_{number}_unit", "<f8", 1)[0])
    base.require(0 <= unit <= 1, f"level_{number}_unit", "is not in [0, 1]")
    multiples = base.take_array(arrays, f"level_{number}_shares", "<i4", sum(map(math.prod, shapes)))
    blocks = split(multiples * unit, shapes)
    tables = iter(blocks[rows.pairs :])
    return blocks[: rows.pairs], {ring: [next(tables) for _ in rows.rings[ring][0]] for ring in rings}


if __name__ == "__main__":
    sys.exit(base.main(sys.argv[1:], lambda data: check_arrays(base.unpack_archive(data))))
