"""Centre lines of pen strokes that drawing programs export as filled outlines.

The outline is sampled, and each sample is paired with the sample that faces it across the stroke: the one on
the smallest circle that touches both from inside. The middles of the pairs, in the order of the outline, are
the centre line. Sides that cross do not face each other, so a stroke may cross itself and others.

A shape is a stroke if it is thin all along: no circle inside it is much wider than the mean width, which is
twice the area over the perimeter, and its longest centre line is several times as long as it is wide.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..input_limits import MAX_OUTLINE_SAMPLES, MAX_SAMPLE_PAIRS
from ..instance.angles import vector_length
from ..instance.domain import Bools, Floats
from .curves import evaluate_cubics, lines_as_cubics, run_numbers

SLENDER: Final = 5.0  # least length of a stroke's longest centre line as a share of its greatest width
_ELONGATED: Final = 7.0  # least half perimeter of a stroke as a share of its mean width; cheap to compute
_UNEVEN: Final = 4.0  # greatest width of a stroke as a share of its mean width: pressure, blobs of ink
_UNPAIRED: Final = 0.05  # greatest share of a stroke's outline that is wider
_FINE, _COARSE = 0.5, 1.0  # distance of samples as a share of the mean width, on short and on long curves
_FEW: Final = 16  # samples on a curve from which on they are coarse
_OPPOSITE: Final = -0.7  # greatest cosine between the normals of two sides that face each other
_FAR: Final = 3.0  # greatest step along the other side as a share of the mean width: round a bend
_LEAP: Final = 3.0  # greatest step of the centre line as a share of the step of the outline
_CAP: Final = 2.0  # greatest length of the outline round the end of a stroke as a share of its width
_BASE: Final = 1.5  # length over which the direction of an end is found as a share of its width
_REACH: Final = 4.0  # greatest gap between two pieces of a stroke as a share of their width
_LEAST: Final = 2.0  # least length of a centre line as a share of the mean width
_AHEAD: Final = 0.8  # least cosine between the end of a piece and the way to the piece that continues it
_MOST_BODIES: Final = 1000  # larger areas with which an area is compared
_NEAR: Final = 1e-3  # distance of the test for the fill from a sample as a share of the step
_MOST_TESTS: Final = 10_000_000  # tests of curves for the loops of a shape
_MOST_SAMPLES: Final = 200_000  # of a stroke; what would need more counts as an area
_QUARTERS: Final = (0.0, 0.25, 0.5, 0.75)  # parameters of curves where the polygons of the test have corners
_TINY: Final = 1e-300

Indices = NDArray[np.intp]
_End = tuple[int, int]
"""An end of a piece: its number, and 0 for its start or 1 for its end."""

# The area of a closed path of cubics is the sum of x_i y_j times these over their control points i and j.
_UPPER: Final = np.array([[0, 6, 3, 1], [0, 0, 3, 3], [0, 0, 0, 6], [0, 0, 0, 0]]) / 20
_AREA: Final = _UPPER - _UPPER.T


@dataclass(frozen=True, eq=False)
class PenStroke:
    """The centre lines of a pen stroke and its mean width.

    points: control points (m, 4, 2) of smooth runs, in which each curve starts where the last one ends.
    """

    points: Floats
    width: float


def find_pen_strokes(
    outlines: Sequence[Floats], widest: float = np.inf, *, even_odd: Sequence[bool] | None = None
) -> list[PenStroke | None]:
    """Find the centre lines of filled shapes that are pen strokes; None stands for an area.

    Parameters
    ----------
    outlines
        Control points (k, 4, 2) of each shape; a gap between its curves ends a closed loop.
    widest
        Greatest width of a stroke in the units of the outlines.
    even_odd
        Whether each shape is filled by the even-odd rule; by default none is.

    Returns
    -------
    list
        The stroke of each shape, or None.

    Raises
    ------
    InputError
        For outlines that need too many samples.

    """
    room = MAX_OUTLINE_SAMPLES
    strokes: list[PenStroke | None] = []
    for number, outline in enumerate(outlines):
        cubics, loop = _close_loops(outline)
        area = _areas_under(cubics)
        side = _filled_sides(cubics, loop, area, even_odd=even_odd is not None and even_odd[number])
        width, share = _measure_shape(cubics, abs(float((side * area).sum())))
        stroke = None
        if 0 < width <= widest:
            room -= int(share.sum())
            if room < 0:
                raise InputError("draws too many long and thin filled shapes; simplify the drawing")
            stroke = _find_stroke(_sample_outline(cubics, loop, side, share), width, widest)
        strokes.append(stroke)
    return strokes


def find_silhouettes(areas: Sequence[Floats]) -> list[int]:
    """The numbers of the areas, control points (k, 4, 2) each, that are not in the box of a larger one.

    They are the outline of a drawing that has no other: in it, only areas show where the body ends.
    """
    low, high = (
        np.array([bound(area.reshape(-1, 2), axis=0) for area in areas]) for bound in (np.min, np.max)
    )
    outer: list[int] = []
    for number in np.argsort(-np.prod(high - low, axis=1), kind="stable").tolist():
        around = outer[:_MOST_BODIES]
        is_within = (low[around] <= low[number]) & (high[around] >= high[number])
        if not is_within.all(axis=1).any():
            outer.append(number)
    return sorted(outer)


def _find_stroke(samples: _OutlineSamples, width: float, widest: float) -> PenStroke | None:
    """The stroke whose outline has these samples and this mean width; None for an area."""
    partner = _pair_samples(samples, width)
    if partner is None:
        return None
    lines = _link_pieces(_cut_pieces(samples, partner, width))
    # Shorter ones are leftovers of sides that overlap.
    lines = [line for line in lines if _polyline_length(line[0]) >= _LEAST * width]
    gap = vector_length(*(samples.at - samples.at[partner])[partner >= 0].T)
    greatest = float(np.quantile(gap, 1 - _UNPAIRED)) if len(gap) else np.inf
    longest = max((_polyline_length(points) for points, _ in lines), default=0.0)
    if greatest > widest or longest < SLENDER * greatest:
        return None
    cubics = [_smooth_cubics(points, width, closed=closed) for points, closed in lines]
    return PenStroke(np.concatenate(cubics), width)


# --- samples of the outline ---------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _OutlineSamples:
    """Samples of an outline in its order, each loop from its start.

    at: (n, 2). inward: (n, 2), unit normals into the fill. first: (n,), the first sample of the same loop.
    count: (n,), the number of samples on it.
    """

    at: Floats
    inward: Floats
    first: Indices
    count: Indices

    def move_on(self, sample: Indices | int, steps: Indices | int) -> Indices:
        """The samples that are so many steps further on the same loops."""
        first = self.first[sample]
        moved: Indices = first + (sample - first + steps) % self.count[sample]
        return moved


def _close_loops(outline: Floats) -> tuple[Floats, Indices]:
    """The curves with a straight one that closes each loop, and the loop of each."""
    loop = run_numbers(outline, np.zeros(len(outline), dtype=np.int32)).astype(np.intp)
    first = np.flatnonzero(np.diff(loop, prepend=-1))
    last = np.append(first[1:], len(loop)) - 1
    is_open = (outline[last, 3] != outline[first, 0]).any(axis=1)
    if not is_open.any():
        return outline, loop
    first, last = first[is_open], last[is_open]
    closing = lines_as_cubics(outline[last, 3], outline[first, 0])
    return np.insert(outline, last + 1, closing, axis=0), np.insert(loop, last + 1, loop[last])


def _areas_under(cubics: Floats) -> Floats:
    """The part (k,) of each curve in the area that the curves enclose, positive on their left (y up)."""
    x, y = np.moveaxis(cubics - cubics[0, 0], -1, 0)
    return np.asarray(((x @ _AREA) * y).sum(axis=1))


def _filled_sides(cubics: Floats, loop: Indices, area: Floats, *, even_odd: bool) -> Floats:
    """1 for each curve (k,) with the fill on its left (y up), and -1 for the others."""
    first = np.flatnonzero(np.diff(loop, prepend=-1))
    side = np.sign(np.add.reduceat(area, first))
    if 1 < len(first) <= _MOST_TESTS / len(cubics):
        corner = np.stack([evaluate_cubics(cubics, np.full(len(cubics), t)) for t in _QUARTERS], axis=1)
        corner = corner.reshape(-1, 2)
        start = len(_QUARTERS) * first
        end = np.append(start[1:], len(corner)) - 1
        after, before = np.arange(len(corner)) + 1, np.arange(len(corner)) - 1
        after[end], before[start] = start, end
        # One side of the leftmost corner of a loop lies outside of this loop; the other loops decide.
        leftmost = np.lexsort((corner[:, 0], np.repeat(loop, len(_QUARTERS))))[start]
        step = corner[after[leftmost]] - corner[before[leftmost]]
        normal = _NEAR * np.stack([-step[:, 1], step[:, 0]], axis=1)
        left, right = (
            _is_filled(corner[leftmost] + way * normal, corner, corner[after], even_odd=even_odd)
            for way in (1, -1)
        )
        side = np.where(left == right, side, np.where(left, 1.0, -1.0))
    return np.asarray(side[loop])


def _is_filled(points: Floats, start: Floats, end: Floats, *, even_odd: bool) -> Bools:
    """Whether points (p, 2) lie in the fill of closed polygons with sides from start to end (n, 2)."""
    filled = np.empty(len(points), dtype=bool)
    for number, (x, y) in enumerate(points.tolist()):
        side = (end[:, 0] - start[:, 0]) * (y - start[:, 1]) - (x - start[:, 0]) * (end[:, 1] - start[:, 1])
        up, down = (start[:, 1] <= y) & (end[:, 1] > y), (end[:, 1] <= y) & (start[:, 1] > y)
        winding = np.count_nonzero(up & (side > 0)) - np.count_nonzero(down & (side < 0))
        filled[number] = winding % 2 if even_odd else winding
    return filled


def _measure_shape(cubics: Floats, area: float) -> tuple[float, Floats]:
    """The mean width of a shape, 0 for one that is not long, and the samples (k,) that its curves need."""
    legs = vector_length(*np.moveaxis(np.diff(cubics, axis=1), -1, 0)).sum(axis=1)
    length = (legs + vector_length(*(cubics[:, 3] - cubics[:, 0]).T)) / 2
    perimeter = float(length.sum())
    width = 2 * area / perimeter
    if perimeter / 2 < _ELONGATED * width or perimeter > _MOST_SAMPLES * _FINE * width:
        return 0.0, length
    return width, np.maximum(length / (_COARSE * width), np.minimum(length / (_FINE * width), _FEW))


def _sample_outline(cubics: Floats, loop: Indices, side: Floats, share: Floats) -> _OutlineSamples:
    """Samples at even steps of each loop; their number is the sum of `share` (k,) over its curves."""
    total = np.cumsum(share)
    first = np.flatnonzero(np.diff(loop, prepend=-1))
    start, end = (total - share)[first], total[np.append(first[1:], len(loop)) - 1]
    count = np.maximum(np.ceil(end - start), 3).astype(np.intp)
    first = np.repeat(np.cumsum(count) - count, count)
    half = np.repeat((end - start) / count, count) / 2
    place = np.repeat(start, count) + (2 * (np.arange(len(first)) - first) + 1) * half
    place = np.concatenate([place, place - half, place + half])
    curve = np.minimum(np.searchsorted(total, place), len(total) - 1)
    points = evaluate_cubics(cubics[curve], 1 - (total[curve] - place) / np.maximum(share[curve], _TINY))
    at, before, after = np.split(points, 3)
    # A chord is less noisy than the derivative of a short curve, and hardly reaches beyond a corner.
    step = after - before
    normal = side[curve[: len(at)], None] * np.stack([-step[:, 1], step[:, 0]], axis=1)
    normal /= np.maximum(vector_length(*step.T), _TINY)[:, None]
    return _OutlineSamples(at, normal, first, np.repeat(count, count))


# --- pairs of samples and pieces of centre lines ------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Piece:
    """An unbroken piece of a centre line as a polyline, its width, and whether it is closed.

    is_tip: whether its start and its end are ends of the stroke; others lie at junctions.
    """

    points: Floats
    width: float
    closed: bool
    is_tip: tuple[bool, bool] = (False, False)


def _pair_samples(samples: _OutlineSamples, width: float) -> Indices | None:
    """The sample (n,) that faces each one across the stroke, -1 without one; None for an area."""
    from scipy.spatial import cKDTree

    at, inward, reach = samples.at, samples.inward, _UNEVEN * width
    tree = cKDTree(at)
    if tree.count_neighbors(tree, reach) > 2 * MAX_SAMPLE_PAIRS:  # a scribble, traced over and over
        return None
    one, other = tree.query_pairs(reach, output_type="ndarray").T
    way = at[other] - at[one]
    square = (way * way).sum(axis=1)
    ahead, behind = (inward[one] * way).sum(axis=1), -(inward[other] * way).sum(axis=1)
    # Diameters of the circles that touch the outline at a sample and pass through the other one.
    across = [
        np.divide(square, depth, out=np.full(len(way), np.inf), where=depth > 0) for depth in (ahead, behind)
    ]
    least = np.full(len(at), np.inf)
    np.minimum.at(least, one, across[0])
    np.minimum.at(least, other, across[1])
    is_wide = least > reach
    # Areas beside the strokes in one shape, such as filled eyes, have loops of their own.
    is_stroke = np.bincount(samples.first, is_wide)[samples.first] <= samples.count / 2
    if not is_stroke.any() or is_wide[is_stroke].mean() > _UNPAIRED:
        return None
    faces = np.flatnonzero(np.maximum(*across) <= reach)
    faces = faces[(inward[one[faces]] * inward[other[faces]]).sum(axis=1) < _OPPOSITE]
    first, second = (
        np.concatenate([side[faces] for side in sides]) for sides in ((one, other), (other, one))
    )
    order = np.lexsort((np.concatenate([side[faces] for side in across]), first))
    best = order[np.flatnonzero(np.diff(first[order], prepend=-1))]
    partner = np.full(len(at), -1)
    partner[first[best]] = second[best]
    return partner


def _find_runs(samples: _OutlineSamples, partner: Indices, width: float) -> list[tuple[Indices, bool]]:
    """Runs of samples along one side of a stroke, longest first, and whether each is a whole loop."""
    at, inward = samples.at, samples.inward
    after = samples.move_on(np.arange(len(at)), 1)
    middle, gap = (at + at[partner]) / 2, vector_length(*(at - at[partner]).T)
    step = vector_length(*(at[after] - at).T)
    holds = (partner >= 0) & (partner[after] >= 0) & ((inward * inward[after]).sum(axis=1) > 0)
    holds &= vector_length(*(middle[after] - middle).T) <= _LEAP * step
    holds &= np.abs(gap[after] - gap) <= step
    # At a junction the other side goes on far away, along another branch.
    along = np.append(0.0, np.cumsum(step))
    way = along[partner] - along[partner[after]]
    round_trip = along[samples.first + samples.count] - along[samples.first]
    holds &= (samples.first[partner] == samples.first[partner[after]]) & (
        np.minimum(np.abs(way), round_trip[partner] - np.abs(way)) <= _FAR * width + step
    )
    runs: list[tuple[Indices, bool]] = []
    for first in np.unique(samples.first).tolist():
        loop = np.arange(first, first + samples.count[first])
        breaks = np.flatnonzero(~holds[loop])
        if len(breaks):
            ends = breaks[:-1] + len(loop) - breaks[-1]
            parts = np.split(np.roll(loop, -breaks[-1] - 1), ends)
            runs += [(part, False) for part in parts if len(part) > 1]
        else:
            runs.append((loop, True))
    return sorted(runs, key=lambda run: -len(run[0]))


def _cut_pieces(samples: _OutlineSamples, partner: Indices, mean_width: float) -> list[_Piece]:
    """The pieces of the centre lines between ends and junctions, each found from one of its sides."""
    at = samples.at
    step = vector_length(*(at[samples.move_on(np.arange(len(at)), 1)] - at).T)
    is_taken = np.zeros(len(at), dtype=bool)
    pieces = []
    for run, is_loop in _find_runs(samples, partner, mean_width):
        is_free = ~is_taken[partner[run]]
        for part in np.split(run, np.flatnonzero(np.diff(is_free)) + 1):
            if len(part) < 2 or is_taken[partner[part[0]]]:
                continue
            is_taken[part] = True
            piece = _make_piece(samples, step, part, partner[part], closed=is_loop and len(part) == len(run))
            if _polyline_length(piece.points) >= piece.width / 2:
                pieces.append(piece)
    return pieces


def _make_piece(
    samples: _OutlineSamples, step: Floats, side: Indices, other_side: Indices, *, closed: bool
) -> _Piece:
    """The piece between two sides of a stroke, with its free ends at the tips of their caps."""
    at = samples.at
    gap = vector_length(*(at[side] - at[other_side]).T)
    points, width = (at[side] + at[other_side]) / 2, float(np.median(gap))
    # Neighbouring middles lie on both sides of the centre line where the width changes.
    if closed:
        return _Piece((points + np.roll(points, -1, axis=0)) / 2, width, closed)
    points = np.concatenate([points[:1], (points[1:] + points[:-1]) / 2, points[-1:]])
    is_tip = []
    for last, first, end_gap in (
        (other_side[0], side[0], gap[0]),
        (side[-1], other_side[-1], gap[-1]),
    ):
        points = points[::-1]
        cap = _cap_samples(samples, step, last, first, max(width, end_gap))
        is_tip.append(cap is not None)
        if cap is not None:
            points = _extend_to_tip(points, at[cap], width, end_gap)
    return _Piece(points, width, closed, (is_tip[0], is_tip[1]))


def _cap_samples(
    samples: _OutlineSamples, step: Floats, last: int, first: int, width: float
) -> Indices | None:
    """The samples of the outline between the two sides at the end of a stroke, None at a junction."""
    if samples.first[last] != samples.first[first]:
        return None
    cap = samples.move_on(last, np.arange((first - last) % samples.count[last]))
    return None if step[cap[1:-1]].sum() > _CAP * width else cap[1:]


def _extend_to_tip(points: Floats, cap: Floats, width: float, end_gap: float) -> Floats:
    """A polyline that ends at the tip of a cap, samples (k, 2) of the outline; end_gap: the width there."""
    # Samples on a round end are paired askew.
    is_before = vector_length(*(points - points[-1]).T) > end_gap / 2
    beyond = np.concatenate([cap, points[-1:]])
    points = points[: np.flatnonzero(is_before)[-1] + 1] if is_before[1:].any() else points
    # The parabola through three points continues the bend of the stroke.
    along = np.append(0.0, np.cumsum(vector_length(*np.diff(points, axis=0).T)))
    step = min(2 * _BASE * max(width, end_gap), along[-1]) / 2
    places = along[-1] - step * np.arange(3)
    end, middle, start = np.stack([np.interp(places, along, axis) for axis in points.T], axis=1)
    slope, bend = (3 * end - 4 * middle + start) / 2, (end - 2 * middle + start) / 2
    part = max(0.0, float(((beyond - end) @ slope).max() / max(float(slope @ slope), _TINY)))
    return np.concatenate([points, [end + part * slope + part * part * bend]])


def _end_direction(points: Floats, width: float) -> Floats:
    """The unit vector in which a polyline ends."""
    is_far = vector_length(*(points - points[-1]).T) >= _BASE * width
    way = points[-1] - points[np.flatnonzero(is_far)[-1] if is_far.any() else 0]
    return np.asarray(way / max(float(vector_length(*way)), _TINY))


def _polyline_length(points: Floats) -> float:
    return float(vector_length(*np.diff(points, axis=0).T).sum())


# --- centre lines across junctions --------------------------------------------------------------------------


def _link_pieces(pieces: list[_Piece]) -> list[tuple[Floats, bool]]:
    """Polylines of pieces that continue each other across a junction, and whether each is closed."""
    points = [piece.points for piece in pieces]
    ends = [
        (number, side)
        for number, piece in enumerate(pieces)
        for side in (0, 1)
        if not (piece.closed or piece.is_tip[side])
    ]
    links: dict[_End, _End] = {}
    if ends:
        outward = [points[number][:: 1 if side else -1] for number, side in ends]
        width = np.array([pieces[number].width for number, _ in ends])
        direction = np.array([_end_direction(*end) for end in zip(outward, width, strict=True)])
        at = np.array([polyline[-1] for polyline in outward])
        mate = _match_ends(at, direction, width)
        # A branch that nothing continues ends on the centre line of the other stroke, half a width away.
        for (number, side), other, tip in zip(ends, mate, at + width[:, None] / 2 * direction, strict=True):
            if other < 0:
                points[number] = np.insert(points[number], len(points[number]) * side, tip, axis=0)
        links = {ends[one]: ends[other] for one, other in enumerate(mate) if other >= 0}
    return _join_polylines(points, [piece.closed for piece in pieces], links)


def _match_ends(at: Floats, direction: Floats, width: Floats) -> list[int]:
    """The end that continues each end at a junction, straightest and nearest first; -1 without one."""
    from scipy.spatial import cKDTree

    one, other = cKDTree(at).query_pairs(_REACH * float(width.max()), output_type="ndarray").T
    way = at[other] - at[one]
    mean = (width[one] + width[other]) / 2
    gap = vector_length(*way.T)
    # The way over a gap of hardly any length has no direction of its own.
    way = np.where((gap > mean / 2)[:, None], way, direction[one] - direction[other])
    way /= np.maximum(vector_length(*way.T), _TINY)[:, None]
    ahead = (direction[one] * way).sum(axis=1), -(direction[other] * way).sum(axis=1)
    follows = (np.minimum(*ahead) >= _AHEAD) & (gap <= _REACH * mean)
    mate = [-1] * len(at)
    for pair in np.argsort(gap / mean - sum(ahead), kind="stable"):
        if follows[pair] and mate[one[pair]] < 0 and mate[other[pair]] < 0:
            mate[one[pair]], mate[other[pair]] = int(other[pair]), int(one[pair])
    return mate


def _join_polylines(
    points: list[Floats], closed: list[bool], links: dict[_End, _End]
) -> list[tuple[Floats, bool]]:
    """The polylines joined at their linked ends, and whether each is closed."""
    lines: list[tuple[Floats, bool]] = []
    is_used = [False] * len(points)
    # Chains start at ends without a link; the others are closed.
    free = [(number, side) for number in range(len(points)) for side in (0, 1) if (number, side) not in links]
    for start in [*free, *links]:
        end: _End | None = start
        chain: list[Floats] = []
        while end is not None and not is_used[end[0]]:
            number, side = end
            is_used[number] = True
            chain.append(points[number][:: -1 if side else 1])
            end = links.get((number, 1 - side))
        if chain:
            is_closed = end is not None or closed[start[0]]
            lines.append((np.concatenate([*chain, chain[0][:1]] if is_closed else chain), is_closed))
    return lines


def _smooth_cubics(points: Floats, width: float, *, closed: bool) -> Floats:
    """Cubics (k, 4, 2), about a width long each, that run smoothly through a polyline."""
    along = np.append(0.0, np.cumsum(vector_length(*np.diff(points, axis=0).T)))
    place = np.linspace(0, along[-1], max(2, round(along[-1] / width)) + 1)
    knots = np.stack([np.interp(place, along, axis) for axis in points.T], axis=1)
    if closed:
        tangent = np.roll(knots[:-1], -1, axis=0) - np.roll(knots[:-1], 1, axis=0)
        tangent = np.concatenate([tangent, tangent[:1]]) / 2
    else:
        tangent = np.gradient(knots, axis=0)
    start, end = knots[:-1], knots[1:]
    return np.stack([start, start + tangent[:-1] / 3, end - tangent[1:] / 3, end], axis=1)
