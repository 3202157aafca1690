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
from functools import reduce
from typing import Any

import numpy as np

try:
    from . import check_certificate as base
except ImportError:  # run as a program
    import check_certificate as base  # type: ignore[import-not-found,no-redef]

FORMAT, VERSION = "crossfield-orthogonal-certificate", 3
HALF, QUARTER, MARGIN = base.HALF, base.QUARTER, base.ROUNDING * base.PRECISION
min_plus = base.min_plus_product
RELATIVE = 1e-9
LEAST_TURN = 1e-8  # radians; instances take smaller turns between frames as 0
MOST_LEVELS, MOST_DIVISIONS = 64, 10_000  # of a certificate; cells of a quarter turn
STRIDE = 4 * MOST_DIVISIONS  # between keys of labels of two points
MOST_MEMORY = 1 << 33  # bytes for a level, of whatever file
MORE_ROOM = 1 << 13  # bytes of memory for each byte of a file: more than for other crosses
MOST_WORK = 8  # times as much memory for all levels together, if each had its own
MOST_RING = 64  # pairs of a ring
MOST_TABLES = 1 << 22  # of a level: sums of so many 32-bit numbers are exact in 64-bit floats
MOST_DENSE = 6000  # points up to which limits are computed; beyond, they are pi/4
COLUMNS = 64  # of an inverse, at once
LONGEST_WALK, MOST_SWEEPS = 100, 20  # steps of a walk; turns of both signs
MOST_STAGES = 64  # of charges
MOST_BRANCHED = 2000  # loops, and particles, of branches
MOST_SHARES = 1 << 23  # of all branches together
BRANCHES_AT_ONCE = 1000
WHOLE = (1 << 16) - 1  # a share of 1
LINKS_AT_ONCE = 1 << 19  # of links from their clouds at once
MOST_CASES = 256  # of integers after the last level
FARTHEST_CENTRE = 1e3  # of a centre and of the angles of a case
MOST_NUMBER = 1e30  # coordinates, potentials and prices
THINNEST = 1e-12  # height of a face relative to its longest edge
DECIMALS = 12  # of kappa
TURNS = np.arange(-3, 4)  # by which an integer may differ from that of the centre
CENTRAL = TURNS == 0

PARTS = (
    "head", "instance_head", "instance_theta", "instance_w", "alpha", "p", "centre", "half", "ring_start",
    "ring_pair", "ring_sign", "divisions", "cases",
)  # fmt: skip
OF_MESH = ("instance_vertices", "instance_faces", "instance_stroke_faces", "kappa")
OF_GRID = ("instance_origin", "instance_mask", "instance_stroke_pixels")
PAIR_WEIGHTS = "instance_pair_weights"  # also, unless all are 1
INDICES, POTENTIAL = "instance_indices", "potential"  # also, where indices are prescribed
LOOPS = ("loop_start", "loop_row", "loop_sign", "stages")  # also, or none of them
STAGE_PARTS = {  # of charges, with their kinds; the first four have a number for each loop
    "positive": "|u1", "negative": "|u1", "potential": "<f8", "price": "<f8",
    "start": "<i4", "loop": "<i4", "weight": "<f4",
}  # fmt: skip
PRODUCTS = ("particles", "linear", "pairs", "triples", "weight", "apart")  # also, as often as `products` says
BRANCHES = ("branches", "branch_particles", "branch_shares")  # also, or none of them
LEVEL_PARTS = ("rings", "shares", "unit", "squares")

Array = Any
Ring = tuple[list[int], list[int], list[int]]


# Section 1: the instance and its rows ----------------------------------------------------------------------


class CentredRows:
    """The terms weight r^2 of the energy, those of pairs, then those of strokes; and a centre of labels.

    size: number of points n; point n is the ground, of angle 0. first, second (r,), ends: of each row.
    offset (r,): r = alpha_first - alpha_second + offset + pi/2 z. pairs: number of pairs. limit (r,): of
    Lemma 1. rings: of each ring, its pairs, 1 or -1 for their directions, and its points in order. centre
    (n + 1,): angles. nearest, residual (r,): integers of least energy there, and residuals. half (n + 1,): 1
    where labels are shifted by half a step. fixed (n + 1,): points with the label 0 alone. reach (r,): the
    size of the numbers that make a residual of the centre. slack: by which the energies of all fields may be
    less than here, because kappa differs from that of the mesh. memory, taken: most bytes for the check, and
    those that it takes without levels.

    Prescribed indices (Lemma 13) add `constant` to the energy, and shift residuals by shift (r,) on the rows
    of their rings, where is_held (r,) is True. steps (3, t): ring, row and direction along these rings. turns
    (k,): the sums of integers there.
    """

    def __init__(
        self, arrays: dict[str, Array], limit: Array | None = None, memory: int = MOST_MEMORY
    ) -> None:
        """Read a certificate. limit: of Lemma 1, where it is known."""
        self.memory, self.taken = min(memory, MOST_MEMORY), memory_of_instance(arrays)
        base.check_room(self.taken, self.memory)
        head = base.json_of(arrays, "instance_head")
        base.require(head.get("gauge") == "strokes", "gauge", "is not 'strokes'")
        base.require(head.get("orthogonal") is True, "orthogonal", "is not true")
        if "instance_faces" in arrays:
            n, first, second, kappa, point, wrong = pairs_of_mesh(arrays)
        else:
            base.take_array(arrays, "instance_origin", "<f8", 2)  # not part of the proof, but of the instance
            white, first, second, point = base.pixels_of(arrays)
            n, kappa = len(white), np.zeros(len(first))
            wrong = kappa
        m, weight = len(first), np.ones(len(first))
        if PAIR_WEIGHTS in arrays:
            weight = base.take_array(arrays, PAIR_WEIGHTS, "<f8", m)
        base.require((weight > 0) & (weight <= base.MOST_WEIGHT), PAIR_WEIGHTS, "is not in (0, 1e6]")
        theta, of_strokes = base.strokes_of(arrays, head, point)
        self.size, self.pairs, self.first = n, m, np.concatenate([first, point])
        self.second = np.concatenate([second, np.full(len(point), n)])
        self.ends = list(zip(self.first.tolist(), self.second.tolist()))
        self.offset, self.weight = np.concatenate([kappa, -theta]), np.concatenate([2 * weight, of_strokes])
        self.steps, self.turns = rings_of_indices(arrays, np.array([first, second]), kappa)
        self.is_held, self.shift, self.constant = self._shift_residuals(arrays)
        self.rings, self.fixed = rings_of(arrays, first, second), self._fixed_points()
        self.limit = limits_of(self) if limit is None else limit
        self.slack = math.fsum(self.weight[:m] * (HALF + wrong) * wrong)  # |r| is at most pi/4
        self.centre = np.append(base.take_array(arrays, "centre", "<f8", n), 0.0)
        base.require(np.abs(self.centre) <= FARTHEST_CENTRE, "centre", "is too large")
        self.reach = (self.reach_of(self.centre) + np.abs(self.shift)) * (1 + np.abs(self.shift))
        self.half = np.append(base.take_array(arrays, "half", "|u1", n), 0).astype(np.int64)
        base.require(self.half <= np.where(self.fixed, 0, 1), "half", "is not 0, or 1 at a point not fixed")
        self.nearest = np.round(-self.residuals(self.centre) / HALF)
        self.residual = self.residuals(self.centre) + HALF * self.nearest

    def _shift_residuals(self, arrays: dict[str, Array]) -> tuple[Array, Array, float]:
        """Lemma 13: which rows are held, by how much residuals are shifted, and the constant."""
        (ring, row, sign), size, count = self.steps, len(self.turns), len(self.offset)
        held = np.bincount(row, minlength=count) > 0
        if size == 0:
            return held, np.zeros(count), 0.0
        potential, weight = base.take_array(arrays, POTENTIAL, "<f8", size), np.where(held, self.weight, 1.0)
        shift = np.bincount(row, sign * potential[ring], count) / weight
        base.require(np.abs(shift) <= FARTHEST_CENTRE, POTENTIAL, "shifts a residual too far")
        sums = np.bincount(ring, sign * self.offset[row], size) + HALF * self.turns
        constant = 2 * math.fsum(potential * sums) - math.fsum(weight * shift * shift)
        reach = np.bincount(ring, np.abs(self.offset)[row], size) + HALF * np.abs(self.turns)
        error = math.fsum(np.abs(potential) * reach) + math.fsum(weight * np.abs(shift) * (1 + np.abs(shift)))
        margin = MARGIN + base.PRECISION * int(np.bincount(ring).max())
        return held, shift, constant - 2 * margin * error

    def residuals(self, angle: Array) -> Array:
        """Residuals of all rows at z = 0; angle (n + 1,), 0 at the ground."""
        return angle[self.first] - angle[self.second] + self.offset

    def reach_of(self, angle: Array) -> Array:
        """The size of the numbers in these residuals."""
        return np.abs(angle[self.first]) + np.abs(angle[self.second]) + np.abs(self.offset)

    def _fixed_points(self) -> Array:
        """The ground and the first point of each part that no row of weight joins to it."""
        ground, joined = self.size, self.weight > 0
        part = base.parts_of(ground + 1, self.first[joined], self.second[joined])
        points = np.arange(ground + 1)
        return np.asarray((points == ground) | ((points == part) & (part != part[ground])))


def memory_of_instance(arrays: dict[str, Array]) -> int:
    """Bytes that the check takes at most without levels; more than was measured."""
    mask = arrays.get("instance_mask", np.zeros(0, bool))
    size = len(arrays["instance_faces"]) if "instance_faces" in arrays else int(mask.sum())
    return int(24 * mask.size + 1500 * size + 8 * sum(array.nbytes for array in arrays.values()))


def pairs_of_mesh(arrays: dict[str, Array]) -> tuple[int, Array, Array, Array, Array, Array]:
    """Number of faces, pairs that share an edge, their kappa, stroke faces, and errors of kappa."""
    vertices = base.take_array(arrays, "instance_vertices", "<f8", None, 3)
    faces = base.take_array(arrays, "instance_faces", "<i4", None, 3).astype(np.int64)
    point = base.take_array(arrays, "instance_stroke_faces", "<i4", None).astype(np.int64)
    n, v = len(faces), len(vertices)
    base.require(n > 0, "faces", "are none")
    base.require(np.abs(vertices) <= MOST_NUMBER, "vertices", "is too far away")
    base.require((faces >= 0) & (faces < v), "faces", "names no vertex")
    base.require((point >= 0) & (point < n), "stroke_faces", "is no face")
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    edge_of = {key: edge for edge, key in enumerate((start * v + end).tolist())}
    base.require(len(edge_of) == 3 * n, "faces", "are not oriented, or three meet at an edge")
    opposite = np.array([edge_of.get(key, -1) for key in (end * v + start).tolist()], np.int64)
    edge = np.nonzero((opposite >= 0) & (start < end))[0]
    ends = edge // 3, opposite[edge] // 3
    side = np.roll(vertices[faces], -1, axis=1) - vertices[faces]
    longest = np.abs(side).max(axis=(1, 2))
    base.require(longest > 0, "faces", "has no area")
    side /= longest[:, None, None]  # whatever the scale, nothing overflows or vanishes
    x, z = side[:, 0], np.cross(side[:, 0], -side[:, 2])  # the axis of the frame, and a normal
    area = np.linalg.norm(z, axis=1)
    base.require(area > THINNEST * (side * side).sum(axis=2).max(axis=1), "faces", "has no area")
    y = np.cross(z, x) / area[:, None]  # as long as x
    along = side.reshape(-1, 3)[edge]
    one, other = (np.arctan2((y[f] * along).sum(axis=1), (x[f] * along).sum(axis=1)) for f in ends)
    turn = np.round(np.remainder(other - one + np.pi, 2 * np.pi) - np.pi, DECIMALS)
    kappa = base.take_array(arrays, "kappa", "<f8", len(edge))
    wrong = np.abs(kappa - np.where(np.abs(turn) < LEAST_TURN, 0.0, turn))
    wrong = np.minimum(wrong, np.abs(wrong - 2 * np.pi))
    base.require((np.abs(kappa) <= 4) & (wrong < 1.1 * 10.0**-DECIMALS), "kappa", "is not that of the mesh")
    return n, *ends, kappa, point, wrong


def rings_of_indices(arrays: dict[str, Array], pairs: Array, kappa: Array) -> tuple[Any, Array]:
    """Steps (ring, pair, direction) along the rings of prescribed indices, and the sums of integers there.

    pairs (2, m): their points.
    """
    if INDICES not in arrays:
        return np.zeros((3, 0), np.int64), np.zeros(0)
    vertex, wanted = base.take_array(arrays, INDICES, "<i4", None, 2).astype(np.int64).T
    base.require(len(vertex) > 0 and np.diff(vertex, prepend=-1) > 0, INDICES, "are out of order")
    steps_at = steps_on_mesh if "instance_faces" in arrays else steps_on_grid
    ring, pair, sign, defect = steps_at(arrays, vertex, pairs)
    flat = (defect - np.bincount(ring, sign * kappa[pair], len(vertex))) / HALF
    base.require(np.abs(flat - np.round(flat)) < 0.1, INDICES, "do not fit the angles round a vertex")
    return (ring, pair, sign), np.round(flat) - wanted


def steps_on_mesh(arrays: dict[str, Array], vertex: Array, _: Array) -> tuple[Array, Array, Array, Array]:
    """Steps counter-clockwise round vertices, and 2 pi less the angles there, (k,)."""
    faces = arrays["instance_faces"].astype(np.int64)
    at, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    inner = np.isin(at * (faces.max() + 1) + end, end * (faces.max() + 1) + at)
    ends = np.stack([at, end])[:, inner & (at < end)]  # the second face of a pair is left of the way back
    number = np.searchsorted(vertex, ends).clip(max=len(vertex) - 1)
    high, pair = np.nonzero(vertex[number] == ends)
    ring = number[high, pair]
    side = np.roll(arrays["instance_vertices"][faces], -1, axis=1) - arrays["instance_vertices"][faces]
    side /= np.abs(side).max(axis=(1, 2))[:, None, None]
    back = -np.roll(side, 1, axis=1)
    angle = np.arctan2(np.linalg.norm(np.cross(side, back), axis=2), (side * back).sum(axis=2)).ravel()
    known, size = np.isin(at, vertex), len(vertex)
    corner = np.searchsorted(vertex, at[known])
    closed = np.bincount(corner, minlength=size) == np.bincount(ring, minlength=size)
    base.require(closed & np.isin(vertex, at), INDICES, "names a vertex without a ring")
    return ring, pair, 2 * high - 1, 2 * np.pi - np.bincount(corner, angle[known], size)


def steps_on_grid(arrays: dict[str, Array], vertex: Array, pairs: Array) -> tuple[Array, Array, Array, Array]:
    """Steps counter-clockwise round corners of pixels, numbered row by row, and zeros, (k,).

    Where only two pixels meet in a corner, across, it has two numbers.
    """
    inside = np.pad(arrays["instance_mask"], 1)
    corners = np.array([inside[:-1, :-1], inside[:-1, 1:], inside[1:, :-1], inside[1:, 1:]])
    one, two, three, four = corners
    across = (one & four & ~two & ~three) | (two & three & ~one & ~four)
    count = (corners.any(axis=0).astype(np.int64) + across).ravel()
    place = np.searchsorted(np.cumsum(count), vertex, side="right")
    base.require(place < len(count), INDICES, "names a vertex without a ring")
    row, column = np.divmod(place, inside.shape[1] - 1)
    base.require(corners[:, row, column].all(axis=0), INDICES, "names a vertex without a ring")
    number = np.full(inside.shape, -1)
    number[inside] = np.arange(inside.sum())
    upper, lower = number[row[:, None] + [[[0]], [[1]]], column[:, None] + [0, 1]]
    (c, d), (a, b), size = upper.T, lower.T, inside.size
    key, order = pairs[0] * size + pairs[1], np.argsort(pairs[0] * size + pairs[1])
    wanted = np.concatenate([a * size + b, b * size + d, c * size + d, a * size + c])
    pair = order[np.searchsorted(key[order], wanted)]
    ring, sign = np.tile(np.arange(len(vertex)), 4), np.repeat([1, 1, -1, -1], len(vertex))
    return ring, pair, sign, np.zeros(len(vertex))


def rings_of(arrays: dict[str, Array], first: Array, second: Array) -> list[Ring]:
    """The rings: closed walks over different points and pairs. first, second (m,): the ends of pairs."""
    start = base.take_array(arrays, "ring_start", "<i4", None).astype(np.int64)
    base.require(len(start) and start[0] == 0, "ring_start", "does not begin with 0")
    steps = np.diff(start)
    base.require((steps >= 2) & (steps <= MOST_RING), "ring_start", "has too short or too long a ring")
    pair = base.take_array(arrays, "ring_pair", "<i4", int(start[-1]))
    sign = base.take_array(arrays, "ring_sign", "|i1", int(start[-1]))
    base.require((pair >= 0) & (pair < len(first)) & (np.abs(sign) == 1), "ring_pair", "is no pair")
    begin, end = np.where(sign > 0, [first[pair], second[pair]], [second[pair], first[pair]])
    ring, following = np.repeat(np.arange(len(steps)), steps), np.roll(np.arange(len(pair)), -1)
    following[start[1:] - 1] = start[:-1]
    closed = begin[following] == end
    for numbers in (begin, pair):
        _, once = np.unique(ring * (numbers.max(initial=0) + 1) + numbers, return_index=True)
        closed &= np.isin(np.arange(len(pair)), once)
    wrong = "is no closed walk over different points and pairs"
    base.require(np.bincount(ring, ~closed, len(steps)) == 0, "ring", wrong)
    parts = [[part.tolist() for part in np.split(array, start[1:-1])] for array in (pair, sign, begin)]
    return list(zip(*parts)) if len(steps) else []


def limits_of(rows: CentredRows) -> Array:
    """Lemma 1: |r| of every row of an optimal field is at most this, (r,); pi/4 with prescribed indices.

    Any potential gives a lower bound of a resistance. Here it is a difference of two columns of an inverse.
    """
    count = len(rows.first)
    if rows.size > MOST_DENSE or len(rows.turns):
        return np.full(count, QUARTER + RELATIVE)
    weight = rows.weight / max(rows.weight.max(initial=0.0), 1e-300)  # the limits do not depend on the unit
    place, start = blocks_of(rows.size, rows.first[: rows.pairs], rows.second[: rows.pairs])
    room = 96 * rows.size * int(np.diff(start).max()) + 64 * COLUMNS * count
    base.check_room(rows.taken + room, rows.memory)
    ends = np.sort([place[rows.first], place[rows.second]], axis=0)
    block = np.searchsorted(start, ends[0], side="right") - 1
    order = np.argsort(block, kind="stable")
    edges = np.split(order, np.searchsorted(block[order], np.arange(1, len(start) - 1)))
    share = np.zeros(count)  # weight times resistance
    for number, columns in inverse_columns(start, ends, weight, edges):
        for at in range(0, len(edges[number]), COLUMNS):
            some = edges[number][at : at + COLUMNS]
            one, other = np.minimum(ends[:, some] - start[number], columns.shape[1] - 1)
            potential = columns[:, one] - columns[:, other]
            drop = potential[ends[0]] - potential[ends[1]]
            power = np.maximum(weight @ (drop * drop), 1e-300)
            share[some] = weight[some] * drop[some, np.arange(len(some))] ** 2 / power
    return QUARTER * np.clip(1 - share * (1 - RELATIVE), 0.0, 1.0) + RELATIVE


def inverse_columns(
    start: Array, ends: Array, weight: Array, edges: list[Array]
) -> Iterator[tuple[int, Array]]:
    """The inverse of the matrix of weights: numbers of blocks, and their columns, the next block's and zeros.

    ends (2, r): places of points, ascending. edges: the rows whose first end is in a block. Last blocks come
    first. The columns have a row of zeros for the ground.
    """
    n, size, solved, carry = int(start[-1]), np.diff(start), list[tuple[Array, Array]](), np.zeros(1)
    degree = np.bincount(ends.ravel(), np.append(weight, weight), n + 1)[:n]
    degree = degree + 1e-9 * max(degree.max(), 1.0)
    for number, some in enumerate(edges):
        here, inner = slice(start[number], start[number + 1]), some[ends[1, some] < n]
        links = np.zeros((size[number], size[number : number + 2].sum()))
        np.add.at(links, tuple(ends[:, inner] - start[number]), weight[inner])
        within, across = links[:, : size[number]], links[:, size[number] :]
        inverse = np.linalg.inv(np.diag(degree[here]) - within - within.T - carry)
        solved.append((inverse, inverse @ across))
        carry = across.T @ solved[-1][1]
    line, after = np.zeros((0, 0)), np.zeros((n + 1, 0))  # entries from the diagonal on; the next columns
    for number in reversed(range(len(size))):
        inverse, across = solved[number]
        right = across @ line
        line = np.hstack([inverse + right[:, : across.shape[1]] @ across.T, right])
        parts = [line.T]
        for _, across in reversed(solved[:number]):
            parts.insert(0, across @ parts[0][: across.shape[1]])
        columns = np.vstack([*parts, np.zeros((1, size[number]))])
        yield number, np.hstack([columns, after, np.zeros((n + 1, 1))])
        after = columns


def blocks_of(count: int, first: Array, second: Array) -> tuple[Array, Array]:
    """Places of points and ground, (n + 1,), and where blocks of places begin.

    Rows join only points of one block, or of successive ones. first, second (m,): their points.
    """
    part, points = base.parts_of(count, first, second), np.arange(count)
    order = np.lexsort((depths_of(part == points, first, second), part))
    far = np.isin(points, order[np.append(np.diff(part[order]) > 0, True)])  # the last point of each part
    _, layer = np.unique(part * count + depths_of(far, first, second), return_inverse=True)
    _, block = np.unique(starts_of(np.bincount(layer))[:-1] // COLUMNS, return_inverse=True)
    order = np.argsort(block[layer], kind="stable")
    return np.append(np.argsort(order), count), starts_of(np.bincount(block[layer]))


def depths_of(start: Array, first: Array, second: Array) -> Array:
    """How many pairs lead from each point to the nearest one where `start` is true, (n,)."""
    depth, here = np.where(start, 0, -1), 0
    while (depth == here).any():
        for one, other in ((first, second), (second, first)):
            near = other[depth[one] == here]
            depth[near[depth[near] < 0]] = here + 1
        here += 1
    return depth


# Section 2: labels, cells and costs ------------------------------------------------------------------------


def level_memory(rows: CentredRows, counts: Array) -> int:
    """Bytes that the check takes at most with a level; more than was measured.

    counts (n + 1,): the numbers of cells of all points.
    """
    counts = np.asarray(counts, np.float64) + 1
    return rows.taken + int(80 * (counts[rows.first] @ counts[rows.second]) + 100 * counts.sum())


def starts_of(sizes: Array) -> Array:
    """Where blocks of these sizes begin in a flat array, and its length."""
    return np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)


def spans(begin: Array, sizes: Array) -> Array:
    """All places of blocks that begin there, block after block."""
    return np.repeat(begin - starts_of(sizes)[:-1], sizes) + np.arange(np.sum(sizes))


class RowTable:
    """A matrix for each row of the energy, flat: an entry for each two items (cells or labels) of its points.

    start (n + 2,): where the items of a point begin. begin (r + 1,), width (r,): where a matrix begins, and
    its columns. row: of each entry. item: of the lines of all matrices, for first and for second points.
    line: both lines of each entry. first_line (r + 1,): where a matrix begins among lines of first points.
    """

    def __init__(self, rows: CentredRows, point: Array) -> None:
        count = np.bincount(point, minlength=rows.size + 1)
        self.start, height, self.width = starts_of(count), count[rows.first], count[rows.second]
        base.require(count > 0, "the level", "leaves a point no label")
        base.check_room(level_memory(rows, count), rows.memory)
        self.begin = starts_of(height * self.width)
        self.row = np.repeat(np.arange(len(height), dtype=np.int32), height * self.width)
        self.item = spans(self.start[rows.first], height), spans(self.start[rows.second], self.width)
        lines = self.first_line, _ = starts_of(height), starts_of(self.width)
        origin = self.begin[:-1] - self.start[rows.first] * self.width - self.start[rows.second]
        numbers = origin, self.width, self.begin
        self._origin, self._width, begin = (array.astype("i4") for array in numbers)  # modulo 2^32
        inside = np.divmod(np.arange(begin[-1], dtype=np.int32) - begin[self.row], self._width[self.row])
        self.line = [line.astype("i4")[self.row] + at for line, at in zip(lines, inside)]

    def at_ends(self, numbers: Array) -> list[Array]:
        """The numbers of the two items of each entry; numbers: of all items."""
        return [numbers[item][line] for item, line in zip(self.item, self.line)]

    def places(self, row: Array, first: Array, second: Array) -> Array:
        """Where the entries of two items in a row lie."""
        return self._origin[row] + first * self._width[row] + second

    def have_partners(self, used: Array) -> Array:
        """Whether each item has an entry in use in all its rows."""
        kept = np.ones(self.start[-1], bool)
        for item, line in zip(self.item, self.line):
            in_use = np.zeros(len(item), bool)
            in_use[line[used]] = True
            kept[item[~in_use]] = False
        return kept

    def matrix(self, numbers: Array, row: int) -> Array:
        """The entries of a row."""
        return numbers[self.begin[row] : self.begin[row + 1]].reshape(-1, self.width[row])


class CellLevel:
    """Labels centre + h (k + half / 2), h = pi/2 / divisions, with whole numbers k.

    cells: the lower label k of each cell that may hold the cross of an optimal field, point after point,
    ascending; owner: its point. allowed: whether two cells may, by entries of the table `squares`. label,
    point: k and point of each label, in the same order; key: both as one number. ends (2, cells): the labels
    at both ends of each cell. pairs: the table of labels.
    """

    def __init__(self, rows: CentredRows, divisions: int, owner: Array, cells: Array) -> None:
        self.rows, self.divisions, self.owner, self.cells = rows, divisions, owner, cells
        key = owner * STRIDE + cells
        self.key, ends = np.unique([key, key + ~rows.fixed[owner]], return_inverse=True)
        self.ends, self.point = ends.reshape(2, -1).astype("i4"), (self.key + STRIDE // 2) // STRIDE
        self.label = (self.key - STRIDE * self.point).astype("i4")
        self.squares, self.pairs = RowTable(rows, owner), RowTable(rows, self.point)
        self.allowed = np.ones(len(self.squares.row), bool)

    def corners(self) -> Iterator[Array]:
        """Where the four corners of all squares lie in the table of labels."""
        (first, second), (row, column) = self.squares.item, self.squares.line
        for one, two in itertools.product(self.ends, repeat=2):
            yield self.pairs.places(self.squares.row, one[first][row], two[second][column])


def first_level(rows: CentredRows, divisions: int) -> CellLevel:
    """All crosses: cells that span a quarter turn; label 0 alone where a point is fixed."""
    count = np.where(rows.fixed, 1, divisions)
    base.check_room(level_memory(rows, count), rows.memory)
    lowest = np.where(rows.fixed, 0, -((divisions + rows.half) // 2))
    return CellLevel(rows, divisions, np.repeat(np.arange(len(count)), count), spans(lowest, count))


def next_level(level: CellLevel, squares: Array, factor: int) -> CellLevel:
    """The level whose cells are parts of those that are left: one of each (factor 1) or three."""
    rows, left = level.rows, np.nonzero(level.squares.have_partners(squares))[0].astype("i4")
    point = level.owner[left]
    parts = np.where(rows.fixed, 1, factor)[point]
    lowest, parent = parts * level.cells[left] + rows.half[point] * (parts // 3), np.repeat(left, parts)
    finer = CellLevel(rows, level.divisions * factor, level.owner[parent], spans(lowest, parts))
    finer.allowed = squares[level.squares.places(finer.squares.row, *finer.squares.at_ends(parent))]
    return finer


def costs_of(level: CellLevel) -> Array:
    """Lemma 2: the cost of each two labels of a row; inf: excluded."""
    rows, pairs, n, h = level.rows, level.pairs, level.divisions, HALF / level.divisions
    shift = (rows.half[rows.first] - rows.half[rows.second])[:, None] / 2
    best, usable = np.full((len(rows.first), n), np.inf), np.zeros(len(pairs.row), bool)
    for turn in (-2, -1, 0, 1):  # of all differences of labels modulo n
        x = np.arange(n) + n * turn + shift
        a = rows.residual[:, None] + h * x
        deducted = np.where((shift == 0) & (np.abs(x) <= 1), np.abs(x), 0.25)
        cost = rows.weight[:, None] * ((a - rows.shift[:, None]) ** 2 - h * h * deducted)
        within = np.abs(a) <= rows.limit[:, None] + h * (1 + RELATIVE)
        best = np.where(within, np.minimum(best, cost), best)
    for corner in level.corners():
        usable[corner[level.allowed]] = True
    first, second = pairs.at_ends(level.label)
    costs, excluded = np.where(usable, best[pairs.row, (first - second) % n], np.inf), -1
    while excluded != (excluded := np.isinf(costs).sum()):  # with a label, all its costs are excluded
        costs[~np.logical_and(*pairs.at_ends(pairs.have_partners(np.isfinite(costs))))] = np.inf
    return costs


# Section 3: bound and exclusion ----------------------------------------------------------------------------


class Excess:
    """Lemma 3: the cost of any labelling is at least `bound` plus its excesses, none of which is negative.

    points: excess of each label, r. pairs: of each two labels, s. rings: those in use, the tables of their
    steps, and the least sum of -tables. error: of all sums together.
    """

    def __init__(self, level: CellLevel, costs: Array, unit: float, shares: Array, rings: list[Any]) -> None:
        """shares: of each label of the first points of pairs. rings: rings, and the tables of their steps.

        Both are whole multiples of the unit, so that tables of one pair have an exact sum.
        """
        rows, pairs, of_strokes = level.rows, level.pairs, costs[level.pairs.begin[level.rows.pairs] :]
        shares = np.append(shares * unit, np.where(np.isfinite(of_strokes), of_strokes, 0.0))
        self.level, self.pairs = level, np.zeros_like(costs)
        for ring, tables in rings:
            for e, table in zip(ring[0], tables):
                pairs.matrix(self.pairs, e)[:] += table
        self.pairs *= unit
        self.pairs += costs
        self.pairs -= shares[pairs.line[0]]
        size = greatest(costs, pairs.begin) + rows.weight * (1 + rows.reach) / 8
        size += 2 * greatest(self.pairs, pairs.begin) + 2 * greatest(shares, pairs.first_line)
        rest = np.full(len(pairs.item[1]), np.inf)  # the greatest shares of the second points
        np.minimum.at(rest, pairs.line[1], self.pairs)
        self.pairs -= np.where(np.isfinite(rest), rest, 0.0)[pairs.line[1]]
        points = np.where(pairs.have_partners(np.isfinite(costs)), 0.0, np.inf)
        np.add.at(points, pairs.item[0], shares)
        np.add.at(points, pairs.item[1], rest)
        rings = [(ring, [table * unit for table in tables]) for ring, tables in rings]
        self.rings = [(*ring, self._ring_least(*ring)) for ring in rings]
        least = np.append(np.minimum.reduceat(points, pairs.start[:-1]), [ring[2] for ring in self.rings])
        base.require(np.isfinite(least), "the level", "leaves not even the field")
        self.points = points - least[level.point]
        self.by_point = np.split(self.points, pairs.start[1:-1])
        of_tables = [3 * np.abs(table).max() for _, tables in rings for table in tables]
        self.error = MARGIN * math.fsum([*size, *of_tables])
        self.bound = math.fsum(least) - self.error + rows.constant
        base.require(math.isfinite(self.bound), "the level", "has no finite bound")

    def _along(self, ring: Ring, tables: list[Array], combine: Any) -> list[Array]:
        """Pairs combined with tables, step after step along a ring."""
        pairs = (self.level.pairs.matrix(self.pairs, e) for e in ring[0])
        return [m if sign > 0 else m.T for m, sign in zip(map(combine, pairs, tables), ring[1])]

    def _ring_least(self, ring: Ring, tables: list[Array]) -> float:
        """The least sum of -tables over labels of the points of a ring, each two of a pair in use."""
        *steps, last = self._along(ring, tables, lambda s, table: np.where(np.isfinite(s), -table, np.inf))
        return float((reduce(min_plus, steps) + last.T).min())

    def ring_marginals(self, ring: Ring, tables: list[Array], least: float, left: list[Array]) -> list[Array]:
        """Of each two labels that are left of the pairs of a ring, the least sum of all excesses on it."""
        steps, here = self._along(ring, tables, np.subtract), [left[i] for i in ring[2]]
        inside = map(np.ix_, here, [*here[1:], here[0]])
        steps = [(s + self.by_point[i][:, None])[labels] for s, i, labels in zip(steps, ring[2], inside)]
        before = list(itertools.accumulate(steps[:-1], min_plus))  # from the first point
        after = list(itertools.accumulate(steps[:0:-1], lambda back, step: min_plus(step, back)))[::-1]
        middle = [step + min_plus(back, on).T for step, on, back in zip(steps[1:-1], before, after[1:])]
        marginals = zip([steps[0] + after[0].T, *middle, steps[-1] + before[-1].T], ring[1])
        return [(marginal if sign > 0 else marginal.T) - least for marginal, sign in marginals]


def greatest(numbers: Array, start: Array) -> Array:
    """The greatest absolute value of finite numbers in each block."""
    return np.maximum.reduceat(np.where(np.isfinite(numbers), np.abs(numbers), 0.0), start[:-1])


def kept_of(level: CellLevel, excess: Excess, most: float) -> Array:
    """Lemma 4: the squares that an optimal field of energy `most` or less may use."""
    spare = (most - excess.bound + 2 * excess.error) * (1 + RELATIVE)
    labels = excess.points <= spare
    pairs = np.add(*level.pairs.at_ends(np.where(labels, excess.points, np.inf))) + excess.pairs <= spare
    labels &= level.pairs.have_partners(pairs)
    left = [np.nonzero(kept)[0] for kept in np.split(labels, level.pairs.start[1:-1])]
    for ring, tables, least in excess.rings if min(map(len, left)) else ():
        for e, marginal in zip(ring[0], excess.ring_marginals(ring, tables, least, left)):
            ends = np.ix_(*(left[i] for i in level.rows.ends[e]))
            level.pairs.matrix(pairs, e)[ends] &= marginal <= spare
    squares = level.allowed & np.logical_or.reduce([pairs[corner] for corner in level.corners()])
    squares[level.squares.begin[level.rows.pairs] :] = True  # those of strokes are not stored
    return squares & np.logical_and(*level.squares.at_ends(level.squares.have_partners(squares)))


# Section 4: the last step ----------------------------------------------------------------------------------


def possible_turns(level: CellLevel, squares: Array) -> Array:
    """Lemma 5: whether the integer of a row in an optimal field may exceed the centre's by TURNS, (r, 7)."""
    rows, table, h = level.rows, level.squares, HALF / level.divisions
    left = squares & np.logical_and(*table.at_ends(table.have_partners(squares)))
    first, second = table.at_ends(h * (level.cells + rows.half[level.owner] / 2))
    row, reach = table.row[left], rows.limit + h * (1 + RELATIVE) + RELATIVE
    size, reach = rows.residual[row] + (first - second)[left], reach[row]
    possible = (np.abs(size + HALF * turn) - reach <= 0 for turn in TURNS)
    return np.array([np.bincount(row[of_turn], minlength=len(rows.first)) > 0 for of_turn in possible]).T


def cases_of(turns: Array) -> list[tuple[int, ...]]:
    """All choices of one turn for each row; none if there are too many."""
    if np.log2(np.maximum(turns.sum(axis=1), 1)).sum() > math.log2(MOST_CASES) + RELATIVE:
        return []
    return list(itertools.product(*(TURNS[of_row] for of_row in turns)))


def cases_bound(rows: CentredRows, turns: Array, angles: Array) -> float:
    """Lemma 6: a lower bound of the energy in all cases, by a tangent at the angles (k, n) of each.

    With prescribed indices, cases have these, and residuals at pi/4 cannot grow: the tangent has multipliers.
    """
    cases, (ring, row, sign) = cases_of(turns), rows.steps
    if not cases or len(cases) != len(angles):
        return -math.inf
    bounds: list[float] = []
    for turn, angle in zip(cases, np.column_stack([angles, np.zeros(len(angles))])):
        z = rows.nearest + np.array(turn)
        if (np.bincount(ring, sign * z[row], len(rows.turns)) != rows.turns).any():
            continue
        r = rows.residuals(angle) + HALF * z
        force = 2 * rows.weight * r
        slope = np.bincount(rows.first, force, rows.size + 1) - np.bincount(rows.second, force, rows.size + 1)
        at = np.nonzero((np.abs(r) > QUARTER - LEAST_TURN) & (len(rows.turns) > 0))[0]
        normal = np.zeros((rows.size + 1, len(at)))
        normal[rows.first[at], np.arange(len(at))] = np.sign(r[at])
        normal[rows.second[at], np.arange(len(at))] = -np.sign(r[at])
        free = ~rows.fixed
        pull = np.maximum(np.linalg.lstsq(normal[free], -slope[free], rcond=None)[0], 0.0) if len(at) else at
        slope = slope + normal @ pull  # of no rows, sums are whole numbers
        away, reach = np.abs(angle - rows.centre) + np.where(rows.fixed, 0.0, np.pi), rows.reach_of(angle)
        size = np.sum(rows.weight * (1 + r * r) * (1 + reach)) / 4 + pull @ (1 + reach[at])
        total = math.fsum(rows.weight * r * r) + math.fsum(pull * (np.abs(r[at]) - QUARTER - RELATIVE))
        bounds.append(total - math.fsum(np.abs(slope) * away) - MARGIN * float(size * (1 + away.max())))
    return min(bounds, default=math.inf)


# Section 5: charges ----------------------------------------------------------------------------------------


class Charges:
    """Loops, which are closed walks over rows, and their charges: sums of residuals, in quarter turns.

    origin (l,): f, the possible charge nearest 0, negated. most (2, l): how many positive and negative
    particles an optimal field has there at most. resistance (l,), begin, column, entry: the Laplacian; its
    entries off the diagonal, negated, line by line. closed (l,): whether a loop shares all its rows. margin:
    relative error of sums over rows. error: of each charge.
    """

    def __init__(self, arrays: dict[str, Array], rows: CentredRows) -> None:
        start = base.take_array(arrays, "loop_start", "<i4", None).astype(np.int64)
        base.require(len(start) and start[0] == 0, "loop_start", "does not begin with 0")
        base.require(np.diff(start) > 0, "loop_start", "does not increase")
        row = base.take_array(arrays, "loop_row", "<i4", int(start[-1])).astype(np.int64)
        sign = base.take_array(arrays, "loop_sign", "|i1", int(start[-1])).astype(np.int64)
        n, count, self.size, self.rows = rows.size, len(rows.first), len(start) - 1, rows
        base.require((row >= 0) & (row < count) & (np.abs(sign) == 1), "loop_row", "is no row")
        base.require(rows.weight[row] >= RELATIVE, "loop_row", "has too little weight")
        loop = np.repeat(np.arange(self.size), np.diff(start))
        base.require(len(np.unique(loop * count + row)) == len(row), "loops", "pass a row twice")
        uses, both = np.bincount(row, minlength=count), np.bincount(row, sign, count)
        base.require((uses < 2) | ((uses == 2) & (both == 0)), "loops", "pass a row twice in one direction")
        place = np.append(loop * (n + 1) + rows.first[row], loop * (n + 1) + rows.second[row])
        place, number = np.unique(place, return_inverse=True)
        passed = np.bincount(number.ravel(), np.append(sign, -sign))
        base.require((passed == 0) | (place % (n + 1) == n), "loops", "are not closed")
        step = np.argsort(row, kind="stable")
        self.links = loop[step[uses[row[step]] == 2].reshape(-1, 2).T]
        share = 1 / rows.weight[row[step[uses[row[step]] == 2]][::2]]
        line, column = np.append(self.links, self.links[::-1], axis=1)
        order = np.argsort(line, kind="stable")
        self.begin, self.column = np.searchsorted(line[order], np.arange(self.size + 1)), column[order]
        self.entry = np.append(share, share)[order]
        self.closed = np.bincount(loop, uses[row] == 1, self.size) == 0
        self.resistance, turns, reach, far = (
            np.bincount(loop, numbers, self.size)
            for numbers in (
                1 / rows.weight[row], sign * (rows.offset - rows.shift)[row] / HALF, rows.limit[row] / HALF,
                (np.abs(rows.offset) + np.abs(rows.shift))[row],
            )
        )  # fmt: skip
        self.margin = MARGIN + base.PRECISION * int(np.diff(start).max(initial=0))
        self.error, reach = self.margin * (1 + float(far.max(initial=0.0))), reach + RELATIVE
        least, most = turns + np.ceil(-turns - reach), turns + np.floor(reach - turns)
        base.require(least < most + 0.5, "loops", "have a charge beyond the limits")
        nearest = least + np.clip(np.round(-least), 0, np.round(most - least))
        self.origin, self.most = -nearest, np.round([most - nearest, nearest - least]).astype(np.int64)
        if len(rows.turns) == 0:
            self._exclude_by_walks(reach + self.error)

    def _exclude_by_walks(self, reach: Array) -> None:
        """Exclude particles by Lemma 8. reach (l,): the greatest charges by Lemma 1."""
        for _ in range(MOST_SWEEPS):
            before = self.most.sum()
            for side, sign in enumerate((1, -1)):
                gain, ahead = 1 - sign * self.origin - reach, np.zeros(self.size)
                for _ in range(LONGEST_WALK):
                    worth = np.maximum(gain + ahead, 0.0) / self.resistance
                    ahead = (1 - RELATIVE) * self.around(np.where(self.most[1 - side] == 0, worth, 0.0))
                self.most[side] = np.minimum(self.most[side], np.floor(1 - gain - ahead).clip(0))
            if self.most.sum() == before:
                break

    def around(self, numbers: Array) -> Array:
        """Sums of numbers (l,) over the neighbours of all loops, with the entries of the Laplacian."""
        line = np.repeat(np.arange(self.size), np.diff(self.begin))
        return np.bincount(line, self.entry * numbers[self.column], self.size)


class Clouds:
    """Particles and their clouds (Lemma 9).

    most (2, l): how many positive and negative particles each loop may have. loop, sign (p,): of each kind of
    particle, the positive ones first. owner, cell, weight (k,): the kind, loop and number of each entry of a
    cloud. at_home (k,): whether that is the loop of the particle. smeared (k,): the smeared particle at the
    same places; size (k,): of the numbers therein.
    """

    def __init__(self, charges: Charges, most: Array, start: Array, cell: Array, weight: Array) -> None:
        side, self.loop = np.nonzero(most)
        self.most, self.sign, self.count = most, 1 - 2 * side, most[side, self.loop]
        size, start, cell, weight = charges.size, start.astype(int), cell.astype(int), weight.astype(float)
        base.require(len(start) == len(side) + 1 and start[0] == 0, "clouds", "are not one for each particle")
        base.require((np.diff(start) >= 0).all() and start[-1] == len(cell), "clouds", "have other lengths")
        base.require((cell >= 0) & (cell < size) & (weight > 0), "clouds", "have a wrong loop or weight")
        self.owner, self.cell, self.weight = np.repeat(np.arange(len(side)), np.diff(start)), cell, weight
        key = self.owner * size + cell
        base.require(np.diff(key) > 0, "clouds", "name a loop twice or out of order")
        side = side[self.owner]
        self.at_home = cell == self.loop[self.owner]
        base.require(
            self.at_home | (most[1 - side, cell] == 0), "clouds", "cover a particle of the other sign"
        )
        covered = np.zeros((2, size), bool)
        covered[side, cell] = True
        meet = covered[0] & (covered[1] | (charges.around(covered[1].astype(float)) > 0))
        base.require(~meet, "clouds", "of both signs meet")
        around = np.zeros(len(cell))
        block = max(LINKS_AT_ONCE // int(np.diff(charges.begin).max(initial=1)), 1)
        for begin in range(0, len(cell), block):
            part = slice(begin, begin + block)
            degree = charges.begin[cell[part] + 1] - charges.begin[cell[part]]
            step, entry = spans(charges.begin[cell[part]], degree), np.repeat(np.arange(len(degree)), degree)
            wanted = (self.owner[part] * size)[entry] + charges.column[step]
            at = np.minimum(np.searchsorted(key, wanted), len(key) - 1)
            across = np.where(key[at] == wanted, charges.entry[step] * weight[at], 0.0)
            around[part] = np.bincount(entry, across, len(degree))
        mass = charges.resistance[cell] * weight
        self.smeared, self.size = self.at_home - mass + around, self.at_home + mass + around
        least = charges.margin * self.size
        base.require(self.smeared >= least, "clouds", "smear a particle to less than nothing")

    def remaining(self, bound: float, added: Array, kind: Array, threshold: float) -> Array:
        """How many particles fields of at most that energy have, (2, l), from what `stage_of` returns."""
        may = bound + np.maximum(added, 0.0) <= threshold
        remaining = np.zeros_like(self.most)
        remaining[(1 - self.sign) // 2, self.loop] = np.bincount(kind, may, len(self.loop))
        return remaining


def stage_of(charges: Charges, clouds: Clouds, potential: Array, price: Array) -> tuple[float, Array, Array]:
    """Lemma 10: a lower bound; what each particle adds to it, (c,), and the kind of that particle.

    The c particles are those of the kinds one after the other, first, second and so on of each kind.
    """
    kinds, (owner, weight), turn = len(clouds.loop), (clouds.owner, clouds.weight), 2 * charges.error
    laplace = charges.resistance * potential - charges.around(potential)
    reach = charges.resistance * np.abs(potential) + charges.around(np.abs(potential))
    ground, reach = charges.origin + laplace, np.abs(charges.origin) + reach
    itself = np.bincount(owner, weight * (clouds.at_home + clouds.smeared), kinds)
    most = np.bincount(owner, weight * (clouds.at_home + clouds.size + 2 * reach[clouds.cell]), kinds)
    most = most + (2 * np.abs(potential) + np.abs(price))[clouds.loop]
    margin = charges.margin + base.PRECISION * np.bincount(owner, minlength=kinds)
    error = margin * most + turn * np.bincount(owner, weight, kinds)
    pull = potential[clouds.loop] - np.bincount(owner, weight * ground[clouds.cell], kinds)
    kind = np.repeat(np.arange(kinds), clouds.count)
    number = spans(0 * clouds.count, clouds.count)
    added = (itself + 2 * clouds.sign * pull - error)[kind] + 2 * number * (itself - error)[kind]
    added -= (clouds.sign * price[clouds.loop])[kind]
    least = math.fsum(np.minimum(added, 0.0)) + math.fsum(price * charges.origin)
    least -= math.fsum(potential * (charges.origin + ground))
    size = (
        np.abs(price) @ (1 + np.abs(charges.origin)) + np.abs(potential) @ (2 + reach) + np.abs(added).sum()
    )
    bound = HALF**2 * (least - (charges.margin + turn) * float(size)) + charges.rows.constant
    return bound, HALF**2 * added, kind


class Particles:
    """Particles that fields may have, one by one, for bounds in units of (pi/2)^2.

    unit (u,): the kind of each, as of `stage_of`; number (u,): which of that kind; sign, loop (u,). wanted:
    the sum of signs, if all loops are closed. never (u, u): whether no field has both. inverse (l, l): of the
    Laplacian, about; bounds hold for any.
    """

    def __init__(self, charges: Charges, clouds: Clouds, count: Array) -> None:
        """Take up to so many particles of each kind, count (c,)."""
        size, kinds, rows = charges.size, len(clouds.loop), charges.rows
        self.charges, self.count, self.number = charges, count, spans(0 * count, count)
        self.unit = np.repeat(np.arange(kinds), count)
        units = len(self.unit)
        fits = units > 0 and max(size, units) <= MOST_BRANCHED
        base.require(fits, "particles", "are none or too many")
        base.check_room(rows.taken + 8 * (size + units) * (6 * size + 6 * units), rows.memory)
        self.margin = charges.margin + base.PRECISION * (size + units)
        self.sign, self.loop = clouds.sign[self.unit], clouds.loop[self.unit]
        total = float(charges.origin.sum())
        self.wanted, is_whole = round(total), abs(total - round(total)) < 0.1
        base.require(is_whole or not charges.closed.all(), "loops", "have charges of another sum than 0")
        line, self.laplacian = np.repeat(np.arange(size), np.diff(charges.begin)), np.diag(charges.resistance)
        np.subtract.at(self.laplacian, (line, charges.column), charges.entry)
        part = base.parts_of(size, *charges.links)
        joined = (part[:, None] == part) * charges.resistance.mean() / size
        self.inverse = np.linalg.inv(self.laplacian + joined)
        self.never = (self.sign[:, None] != self.sign) & (self.loop[:, None] == self.loop)

    def prices(self, added: Array, there: Array, free: Array) -> tuple[Array, Array]:
        """The best multipliers (b,) for the sum of all charges, where that is 0, and whether it may be.

        added (b, u): what particles add, with their signs.
        """
        if not self.charges.closed.all():
            return np.zeros(len(added)), np.ones(len(added), bool)
        due, count = self.wanted - there @ self.sign + (free & (self.sign < 0)).sum(axis=1), free.sum(axis=1)
        order = np.sort(np.where(free, added, np.inf), axis=1)
        best = order[np.arange(len(added)), np.clip(due - 1, 0, np.maximum(count - 1, 0))]
        return np.where(count > 0, best, 0.0), (due >= 0) & (due <= count)


class Products(Particles):
    """A bound of energies from products of two particles (Lemma 12).

    It is one of fields with other charges than a known one, whose energy is at least `least`.

    matrix (u + 1, u + 1): [1 x] matrix [1 x] is at most the energy of the particles x, but for `error`.
    apart (u + 1, u + 1): the same is positive at the known field alone; None if a particle of it is left out.
    """

    def __init__(self, charges: Charges, clouds: Clouds, count: Array, known: Array) -> None:
        """As `Particles`. known (c,): how many particles of each kind the known field has."""
        super().__init__(charges, clouds, count)
        green, origin = (self.inverse + self.inverse.T) / 2, charges.origin
        energy = 2 * green - green @ self.laplacian @ green
        reach = np.abs(green)
        reach = 2 * reach + reach @ np.abs(self.laplacian) @ reach
        far, pull = np.abs(origin) + np.bincount(self.loop, minlength=charges.size), energy @ origin
        self.error = 4 * float((self.margin * far + charges.error) @ reach @ (1 + far))
        between = self.sign[:, None] * energy[np.ix_(self.loop, self.loop)] * self.sign
        cross = -(self.sign * pull[self.loop])[None]
        self.matrix = np.block([[np.array([[origin @ pull]]), cross], [cross.T, (between + between.T) / 2]])
        self.sum = np.append(-float(self.wanted), self.sign) if charges.closed.all() else None
        has, self.apart = self.number < known[self.unit], None
        here = np.bincount(self.loop, self.sign * has, charges.size) - origin
        potential = green @ here
        size = 2 * np.abs(here) + np.abs(self.laplacian) @ np.abs(potential)
        error = np.abs(potential) @ (self.margin * size + 2 * charges.error)
        least = 2 * potential @ here - potential @ self.laplacian @ potential - error
        self.least = HALF**2 * float(least) + charges.rows.constant
        differ = 1 if self.sum is None else 2 * (self.sum @ np.append(1.0, has) == 0)  # particles, at least
        if differ and (known <= count).all():
            self.apart = np.diag(np.append(differ - has.sum(), 2.0 * has - 1))

    def bound(self, dual: Array, triples: Array, weight: Array, apart: float) -> tuple[float, Array]:
        """A lower bound, and one for fields with each particle, (u,).

        dual (u + 1, u + 1): symmetric. triples (k, 3), weight (k,): triangle inequalities and multipliers.
        apart: the multiplier of `apart`.
        """
        taken, used = self.triangles(triples, weight)
        if self.apart is not None:
            taken, used = taken + apart * self.apart, used + apart * float(np.abs(self.apart).sum())
        rest = self.matrix + taken - dual
        norm, size = float(np.linalg.norm(rest)), float(np.abs(self.matrix).sum() + np.abs(dual).sum()) + used
        if self.sum is not None:  # only numbers with that sum count, so any multiple of the last term does
            unit = self.sum / np.linalg.norm(self.sum)
            along, square = rest @ unit, np.outer(unit, unit)
            rest = rest - np.outer(along, unit) - np.outer(unit, along) + (along @ unit + norm) * square
        lacking = max(0.0, -float(np.linalg.eigvalsh(rest)[0])) + 2 * self.margin * norm
        added, pairs = np.diag(dual)[1:] + 2 * dual[0, 1:] - lacking, 2 * np.maximum(dual[1:, 1:], 0.0)
        pairs[self.never | np.eye(len(pairs), dtype=bool)] = 0.0
        there = np.vstack([np.zeros(len(added), bool), np.eye(len(added), dtype=bool)])
        first, more, reach = self._tangents(rest + lacking * np.eye(len(rest)), norm)
        added = added + there @ pairs + more  # to no other particle, and to each one
        price, fits = self.prices(self.sign * added, there, ~there)
        pull = added - price[:, None] * self.sign
        least = (
            dual[0, 0]
            - lacking
            + price * self.wanted
            + np.where(there, pull, np.minimum(pull, 0.0)).sum(axis=1)
        )
        size = size + np.abs(pull).sum(axis=1) + np.abs(price) * (abs(self.wanted) + len(pull)) + reach
        bounds = least + first - (self.margin + base.PRECISION * len(weight)) * size - self.error
        base.require(np.isfinite(bounds), "products", "have a bound that is no number")
        bounds = np.where(fits, HALF**2 * bounds + self.charges.rows.constant, np.inf)
        return float(bounds[0]), bounds[1:]

    def _tangents(self, matrix: Array, norm: float) -> tuple[Array, Array, Array]:
        """Tangents of [1 x] matrix [1 x] at the least value with each particle, after one that is 0.

        They are lower bounds, because no value is negative: constants (1 + u,), slopes (1 + u, u), and the
        size of the numbers.
        """
        inverse = np.linalg.inv(matrix + RELATIVE * (1 + norm) * np.eye(len(matrix)))
        itself, across = np.diag(inverse)[1:], inverse[0, 1:]
        size = inverse[0, 0] * itself - across * across
        at = ((itself - across) / size)[:, None] * inverse[0] + ((inverse[0, 0] - across) / size)[
            :, None
        ] * inverse[1:]
        at = np.vstack([np.zeros(len(matrix)), np.where(np.isfinite(at), at, 0.0)])
        slope, far = at @ matrix, np.abs(at) @ np.abs(matrix)
        constant = 2 * slope[:, 0] - (slope * at).sum(axis=1)
        return constant, 2 * slope[:, 1:], 2 * far.sum(axis=1) + (far * np.abs(at)).sum(axis=1)

    def triangles(self, triples: Array, weight: Array) -> tuple[Array, float]:
        """The matrix of triangle inequalities times multipliers, and the size of the numbers in its sums.

        weight (k,): multipliers, negated for inequalities of the second kind.
        """
        size, n = np.abs(weight), len(self.matrix)
        places, factors = triangle_terms(n, triples, weight < 0)
        matrix = np.bincount(places.ravel(), (factors * size).ravel(), n * n).reshape(n, n)
        return (matrix + matrix.T) / 2, 7 * float(size.sum())


def triangle_terms(size: int, triples: Array, is_second: Array) -> tuple[Array, Array]:
    """The terms of triangle inequalities: places in a flat matrix (size, size), and factors, (7, k) each.

    Of particles a, b, c, the first kind is ab + ac <= a + bc, the second a + b + c <= 1 + ab + ac + bc.
    triples (k, 3): the particles. is_second (k,): the kinds. A particle has its place on the diagonal, after
    that of 1.
    """
    (a, b, c), turn, far = 1 + triples.T, np.where(is_second, -1.0, 1.0), 1.0 * is_second
    places = [a * size + b, a * size + c, b * size + c, a * (size + 1), b * (size + 1), c * (size + 1), 0 * a]
    return np.array(places), np.array([turn, turn, -1 + 0 * turn, -turn, far, far, -far])


class Branches(Particles):
    """Bounds of energies where some particles are there and others are not (Lemma 11).

    smeared (u, l): what its cloud makes of a particle, with its sign. alone (u,): what it adds without others
    or a potential, at least. mutual (u, u): what one adds for another one that is there.
    """

    def __init__(self, charges: Charges, clouds: Clouds, count: Array) -> None:
        """As `Particles`."""
        super().__init__(charges, clouds, count)
        size, kinds, units = charges.size, len(clouds.loop), np.arange(len(self.unit))
        weight = np.zeros((kinds, size))
        weight[clouds.owner, clouds.cell] = clouds.weight
        self.weight = weight[self.unit]
        smeared, reach = -self.weight @ self.laplacian, self.weight @ np.abs(self.laplacian)
        smeared[units, self.loop] += 1
        reach[units, self.loop] += 1
        near = self.weight[:, self.loop]
        pairs = near + smeared @ self.weight.T - self.margin * (near + reach @ self.weight.T)
        alike = (self.sign[:, None] == self.sign) & (self.unit[:, None] != self.unit)
        pairs = np.where(alike, np.maximum(pairs, 0.0), 0.0)
        self.mutual, self.smeared = pairs + pairs.T, self.sign[:, None] * smeared
        self.pulled = 2 * self.margin * (1 + 2 * self.weight @ charges.resistance)
        most = clouds.at_home + clouds.size + 2 * np.abs(charges.origin)[clouds.cell]
        itself, error = (
            np.bincount(clouds.owner, clouds.weight * numbers, kinds)[self.unit]
            for numbers in (clouds.at_home + clouds.smeared, self.margin * most + 2 * charges.error)
        )
        self.alone = (itself - error) * (2 * self.number + 1)

    def bounds(self, state: Array, shares: Array) -> Array:
        """Lower bounds (b,). state (b, u): 1 for particles that are there, 0 for others, 2 for either.

        shares (b, u): how much of the latter the charges have that make the potential.
        """
        there, free, origin = state == 1, state == 2, self.charges.origin
        potential = (np.where(free, shares, there) @ self.smeared - origin) @ self.inverse
        laplace, far = potential @ self.laplacian, np.abs(potential).max(axis=1)
        pull = potential[:, self.loop] - (origin + laplace) @ self.weight.T
        mutual = there @ self.mutual
        added = self.alone + 2 * self.sign * pull - far[:, None] * self.pulled + mutual
        price, fits = self.prices(self.sign * added, there, free)
        fits &= ((there @ self.never) * there == 0).all(axis=1)
        size = (np.abs(added) + mutual).sum(axis=1)
        size += np.abs(price) * (len(self.unit) + len(origin) + np.abs(origin).sum())
        highest = 2 + np.abs(origin).max() + 2 * self.charges.resistance.max() * far
        size += np.abs(potential).sum(axis=1) * highest
        added -= price[:, None] * self.sign
        least = np.where(free, np.minimum(added, 0.0), there * (added - mutual / 2)).sum(axis=1)
        least += price * origin.sum() - (potential * (2 * origin + laplace)).sum(axis=1)
        bounds = least - (self.margin + 2 * self.charges.error) * size
        base.require(np.isfinite(bounds), "branches", "have a bound that is no number")
        return np.where(fits, HALF**2 * bounds + self.charges.rows.constant, np.inf)


def states_of(tree: Array, units: int) -> Array:
    """The states of the branches at the ends of a tree: for each node its particle, or -1 at an end.

    Both subtrees follow it, first the one where the particle is there.
    """
    ends, open_ends = [], [np.full(units, 2, np.int8)]
    for unit in tree.tolist():
        base.require(len(open_ends) > 0, "branches", "go on after the end")
        state = open_ends.pop()
        if unit < 0:
            ends.append(state)
            continue
        base.require(unit < units and state[unit] == 2, "branches", "divide by a particle twice")
        without = state.copy()
        state[unit], without[unit] = 1, 0
        open_ends += [without, state]
    base.require(len(ends) > 0 and not open_ends, "branches", "do not end")
    return np.array(ends)


def branches_bound(arrays: dict[str, Array], branches: Branches) -> float:
    """The least bound of the branches in a certificate."""
    tree, units = base.take_array(arrays, "branches", "<i4", None), len(branches.unit)
    count = int((tree < 0).sum())
    base.require(count * units <= MOST_SHARES, "branches", "are too many")
    shares, least = base.take_array(arrays, "branch_shares", "<u2", count, units), math.inf
    base.check_room(branches.charges.rows.taken + 16 * count * units, branches.charges.rows.memory)
    states = states_of(tree, units)
    for begin in range(0, count, BRANCHES_AT_ONCE):
        part = slice(begin, begin + BRANCHES_AT_ONCE)
        least = min(least, float(branches.bounds(states[part], shares[part] / WHOLE).min()))
    return least


def charges_bound(arrays: dict[str, Array], rows: CentredRows, threshold: float) -> float:
    """The greatest bound of the charges in a certificate; 0 without any."""
    if "loop_start" not in arrays:
        return 0.0
    best, charges, clouds, count = stages_bound(arrays, rows, threshold)

    def particles(name: str) -> Array:
        stored = base.take_array(arrays, name, "|u1", len(count)).astype(np.int64)
        base.require(stored >= count, name, "leaves out a particle")
        return stored

    rounds, bounds, rest = products_count(arrays), [best], math.inf
    known = base.take_array(arrays, "products_known", "|u1", len(count)).astype(int) if rounds else count
    for number in range(rounds):
        products = Products(charges, clouds, particles(f"products_{number}_particles"), known)
        rest = min(rest, products.least if products.apart is not None else math.inf)
        bound, count = products_bound(arrays, number, products, threshold)
        bounds.append(bound)
    if "branches" in arrays:  # after products, they need not have the known charges
        bounds.append(branches_bound(arrays, Branches(charges, clouds, particles("branch_particles"))))
    return max(best, min(rest, max(bounds)))


def products_bound(
    arrays: dict[str, Array], number: int, products: Products, threshold: float
) -> tuple[float, Array]:
    """A bound from products, and how many particles of each kind fields of at most that energy have."""
    units, prefix = len(products.unit), f"products_{number}_"
    linear = base.take_array(arrays, prefix + "linear", "<f8", 2, units + 1)
    pairs = base.take_array(arrays, prefix + "pairs", "<f4", units * (units - 1) // 2).astype(float)
    triples = base.take_array(arrays, prefix + "triples", "<u2", None, 3).astype(np.int64)
    weight = base.take_array(arrays, prefix + "weight", "<f4", len(triples)).astype(float)
    apart = base.take_array(arrays, prefix + "apart", "<f8", 1)
    for name, numbers in (("linear", linear), ("pairs", pairs), ("weight", weight), ("apart", apart)):
        base.require(np.abs(numbers) <= MOST_NUMBER, prefix + name, "is too large")
    one, other, third = np.sort(triples, axis=1).T
    wrong = (one == other) | (other == third) | (third >= units)
    base.require(~wrong, prefix + "triples", "are not of three particles")
    base.check_room(
        products.charges.rows.taken + 100 * (units * units + len(triples)), products.charges.rows.memory
    )
    upper = np.triu_indices(units, 1)
    base.require((pairs >= 0) | products.never[upper], prefix + "pairs", "is negative")
    base.require(apart >= 0, prefix + "apart", "is negative")
    bound, with_each = products.bound(dual_of(linear, pairs), triples, weight, float(apart[0]))
    left = np.bincount(products.unit, with_each <= threshold, len(products.count))
    return bound, left.astype(np.int64)


def dual_of(linear: Array, pairs: Array) -> Array:
    """The symmetric matrix with that first row and diagonal, and those entries above it."""
    units = linear.shape[1] - 1
    dual = np.zeros((units + 1, units + 1))
    dual[1:, 1:][np.triu_indices(units, 1)] = pairs
    dual[0, 1:] = linear[0, 1:]
    dual += dual.T
    np.fill_diagonal(dual, linear[1])
    return dual


def products_count(arrays: dict[str, Array]) -> int:
    """How often products bound the energy."""
    count = int(base.take_array(arrays, "products", "<i4", 1)[0]) if "products" in arrays else 0
    base.require(0 <= count <= MOST_STAGES, "products", "are too many")
    return count


def stages_bound(
    arrays: dict[str, Array], rows: CentredRows, threshold: float
) -> tuple[float, Charges, Clouds, Array]:
    """The greatest bound of stages, the charges, the last clouds, and how many particles of each are left.

    Each stage covers what the one before leaves to fields with an energy of at most the threshold.
    """
    charges, best = Charges(arrays, rows), 0.0
    remaining, links, size = charges.most, charges.links, charges.size
    for number in range(stage_count(arrays)):
        positive, negative, potential, price, start, cell, weight = (
            base.take_array(arrays, f"stage_{number}_{name}", kind, size if place < 4 else None)
            for place, (name, kind) in enumerate(STAGE_PARTS.items())
        )
        most = np.array([positive, negative], np.int64)
        base.require((most >= remaining).ravel(), "stage", "leaves out a particle")
        base.require(price[links[0]] == price[links[1]], "price", "differs at a link")
        base.require(charges.closed | (price == 0), "price", "is not 0 at a border")
        for name, numbers in (("potential", potential), ("price", price)):  # what overflows excludes all
            base.require(np.abs(numbers) <= MOST_NUMBER, name, "is too large")
        base.check_room(rows.taken + 200 * (len(cell) + int(most.sum())), rows.memory)
        clouds = Clouds(charges, most, start, cell, weight)
        bound, added, kind = stage_of(charges, clouds, potential, price)
        best, remaining = max(best, bound), clouds.remaining(bound, added, kind, threshold)
    return best, charges, clouds, remaining[(1 - clouds.sign) // 2, clouds.loop]


def stage_count(arrays: dict[str, Array]) -> int:
    """The number of stages of charges."""
    count = int(base.take_array(arrays, "stages", "<i4", 1)[0])
    base.require(0 < count <= MOST_STAGES, "stages", "are none or too many")
    return count


# The theorem -----------------------------------------------------------------------------------------------


@base.refuse_damage
def check_arrays(
    arrays: dict[str, Array], limit: Array | None = None, memory: int = MOST_MEMORY
) -> base.Findings:
    """Check the arrays of a certificate and return what they prove.

    limit: of Lemma 1, where it is known. memory: most bytes for the check. Raises NotProvenError when a level
    does not follow from the one before, or when less is proven than claimed, and UnreadableError for arrays
    that are not a certificate.
    """
    head = base.head_of(arrays, FORMAT, VERSION)
    divisions = base.take_array(arrays, "divisions", "<i4", None).tolist()
    check_names(arrays, len(divisions))
    fits = len(divisions) <= MOST_LEVELS and all(3 <= count <= MOST_DIVISIONS for count in divisions)
    base.require(fits and (divisions or "loop_start" in arrays), "divisions", "is out of range")
    rows = CentredRows(arrays, limit, memory)
    energy, error, same = energy_of(arrays, rows)
    threshold = base.number_in(head, "threshold", energy + error, math.inf)
    bounds, work, squares = list[float](), 0, np.zeros(0, bool)
    turns = np.ones((len(rows.first), len(TURNS)), bool)
    for number, count in enumerate(divisions):
        if number == 0:
            level = first_level(rows, count)
        else:
            base.require(count in (level.divisions, 3 * level.divisions), "divisions", "grows otherwise")
            size = int(level.squares.begin[rows.pairs])
            packed = base.take_array(arrays, f"level_{number - 1}_squares", "|u1", (size + 7) // 8)
            stored = level.allowed.copy()  # all squares of strokes
            stored[:size] &= np.unpackbits(packed, count=size).astype(bool)
            base.require(stored | ~squares, f"level {number}", "does not cover what the level before leaves")
            level = next_level(level, stored, count // level.divisions)
        work += level_memory(rows, np.diff(level.squares.start))
        base.check_format(
            work <= MOST_WORK * rows.memory, "has larger levels than a file of its size may have"
        )
        excess = Excess(level, costs_of(level), *stored_shares(arrays, number, level))
        bounds.append(excess.bound)
        squares = kept_of(level, excess, threshold)
    if divisions:
        turns = possible_turns(level, squares)
    angles = base.take_array(arrays, "cases", "<f8", None, rows.size)
    base.require(np.abs(angles) <= FARTHEST_CENTRE, "cases", "is too large")
    least = max(*bounds, cases_bound(rows, turns, angles), charges_bound(arrays, rows, threshold))
    proven = max(0.0, min(least, energy - error) - rows.slack)
    bound = max(0.0, proven - base.SPARE * (1 + proven))
    status, forced = base.status_of(energy, bound), (turns[: rows.pairs] == CENTRAL).all(axis=1) & same
    claim = base.Findings(status, 2, energy, bound, forced, bounds)
    base.check_claim(head, claim, proven, error)
    return claim


def check_names(arrays: dict[str, Array], levels: int) -> None:
    """Raise UnreadableError unless the arrays are exactly those of a certificate with so many levels."""
    of_domain = OF_MESH if "instance_faces" in arrays else OF_GRID
    more = {PAIR_WEIGHTS} & arrays.keys()
    more |= {INDICES, POTENTIAL} if INDICES in arrays else set()
    if "loop_start" in arrays:
        stages = range(stage_count(arrays))
        more |= {*LOOPS} | {f"stage_{number}_{part}" for number in stages for part in STAGE_PARTS}
        more |= {f"products_{number}_{part}" for number in range(products_count(arrays)) for part in PRODUCTS}
        more |= {"products", "products_known"} if "products" in arrays else set()
        more |= {*BRANCHES} if "branches" in arrays else set()
    base.compare_names(arrays, {*PARTS, *of_domain, *more}, LEVEL_PARTS, levels)


def check_bytes(data: bytes) -> base.Findings:
    """Check the bytes of a certificate. Raises as `check_arrays`."""
    memory = base.memory_for(len(data), MORE_ROOM)
    return check_arrays(base.unpack_archive(data), memory=memory)  # type: ignore[no-any-return]


def energy_of(arrays: dict[str, Array], rows: CentredRows) -> tuple[float, float, Array]:
    """The energy of the field, the greatest error of that number, and which jumps are the centre's (m,).

    For the latter, crosses take the labels that are nearest to the centre.
    """
    m, lower = rows.pairs, np.zeros(rows.size)
    alpha, p = base.take_array(arrays, "alpha", "<f8", rows.size), base.take_array(arrays, "p", "<i4", m)
    lower[rows.first[m:]] = -rows.offset[m:] - QUARTER
    inside = (alpha >= lower - RELATIVE) & (alpha <= lower + HALF + RELATIVE)
    base.require(inside, "alpha", "is outside its window")
    p = p.astype(np.int64)
    base.require(np.abs(p) <= base.MOST_JUMP, "p", "is no jump")
    r = rows.residuals(np.append(alpha, 0.0))
    r[:m] += HALF * p
    (ring, row, sign), wrong = rows.steps, "has other sums along the rings of prescribed indices"
    base.require(np.bincount(ring, sign * p[row], len(rows.turns)) == rows.turns, "p", wrong)
    base.require(
        np.abs(r[rows.is_held]) <= QUARTER + LEAST_TURN, "alpha", "is too far from neighbours at an index"
    )
    turns = np.round((rows.centre[:-1] - alpha) / HALF)
    same = p - turns[rows.first[:m]] + turns[rows.second[:m]] == rows.nearest[:m]
    return math.fsum(rows.weight * r * r), MARGIN * float(np.sum(rows.weight * (1 + r * r))), same


def stored_shares(arrays: dict[str, Array], number: int, level: CellLevel) -> tuple[float, Array, list[Any]]:
    """The unit of a level, and in it the shares of pairs, and rings with tables, as stored."""
    unit = base.take_array(arrays, f"level_{number}_unit", "<f8", 1)
    base.require((unit >= 0) & (unit <= 1), f"level_{number}_unit", "is not in [0, 1]")
    numbers, name = base.take_array(arrays, f"level_{number}_rings", "<i4", None), f"level_{number}_rings"
    base.require((numbers >= 0) & (numbers < len(level.rows.rings)), name, "is no ring")
    pairs, rings = level.pairs, [level.rows.rings[ring] for ring in numbers]
    steps = [e for ring in rings for e in ring[0]]
    base.require(len(steps) <= MOST_TABLES, name, "has too many tables")
    ends = pairs.first_line[level.rows.pairs] + starts_of(np.diff(pairs.begin)[steps])
    multiples = base.take_array(arrays, f"level_{number}_shares", "<i4", int(ends[-1]))
    shares, *blocks = np.split(multiples.astype(np.float64), ends[:-1])
    tables = iter([block.reshape(-1, pairs.width[e]) for block, e in zip(blocks, steps)])
    return float(unit[0]), shares, [(ring, [next(tables) for _ in ring[0]]) for ring in rings]


if __name__ == "__main__":
    sys.exit(base.main(sys.argv[1:], check_bytes))
