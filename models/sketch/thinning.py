"""Middle lines of the strokes in a picture, by thinning."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..instance.angles import vector_length
from ..instance.domain import Bools, Floats, Ints

_SMOOTH: Final = 2.0  # pixels over which a traced line is smoothed
_SHORTEST: Final = 6  # pixels of a traced line; shorter ones, or than a stroke is wide, are burrs
_SHORTEST_LINK: Final = 4  # pixels of a traced line between two junctions
_LINK: Final = 4.5  # pens that a link inside a junction is long, where lines cross at a small angle
_REACH: Final = 6.0  # pens from the end of a way to that of another one across a junction
_TURN: Final = np.radians(30)  # greatest angle between a way and its continuation
_CORNER: Final = np.radians(35)  # least angle at a corner
_APART: Final = 1.5  # pens between their places half-way
_ASIDE: Final = 0.5  # cost of each line by which more leave a junction to one side of a continuation
_INKED: Final = 0.9  # least share of the distance between their ends that has ink
_SKIP: Final = 1.5  # pens at the end of a way, where thinned strokes turn aside
_FAR: Final = 20.0  # pens of a way that show how it goes on
_ARM: Final = 3.0  # pens to either side of a corner, within which a line turns
_AROUND: Final = ((0, 1), (1, 0), (0, -1), (-1, 0), (1, 1), (1, -1), (-1, -1), (-1, 1))

_Pixel = tuple[int, int]
_Way = list[_Pixel]


def trace_shape(shape: Bools, *, trim: bool = False) -> list[NDArray[np.int64]]:
    """The middle lines of a shape [h, w] as rows and columns (k, 2), from one end or junction to the next.

    trim: whether to cut half a pen off their free ends, where thinned strokes turn to a corner.
    """
    line = thin_shape(shape)
    width = float(shape.sum()) / max(float(line.sum()), 1.0)
    ways = [np.array(way) for way in _trace_ways(line)]
    ends = Counter(tuple(end) for way in ways for end in way[[0, -1]].tolist())
    ways = [way for way in ways if len(way) >= max(_SHORTEST, width) or _is_link(way, ends)] or ways
    cut = int(width / 2) if trim else 0
    return [
        way[cut * (ends[tuple(way[0])] == 1) : len(way) - cut * (ends[tuple(way[-1])] == 1)]
        if len(way) > 4 * cut
        else way
        for way in ways
    ]


def join_ways(ways: Sequence[NDArray[np.int64]], pen: float, ink: Bools) -> list[NDArray[np.int64]]:
    """Traced lines from corner to corner, joined where one continues another one, the straightest first.

    pen: width of the strokes in pixels. Short lines between two junctions lie inside one.
    ink: the picture [h, w], which has ink between ends that are joined.
    """
    from scipy.spatial import KDTree

    ways = [part for way in ways for part in _split_at_corners(way, int(_ARM * pen))]
    sides = [side for way in ways for side in (way, way[::-1])]
    ends = np.array([side[0] for side in sides])
    _, place, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    is_free = (count[place.ravel()] == 1).reshape(-1, 2).any(axis=1)  # NumPy 2.0 adds an axis
    is_long = np.repeat([len(way) > _LINK * pen for way in ways] | is_free, 2)
    pairs = KDTree(ends).query_pairs(_REACH * pen, output_type="ndarray")
    pairs = pairs[is_long[pairs].all(axis=1) & (pairs[:, 0] // 2 != pairs[:, 1] // 2)]
    gap = np.diff(ends[pairs], axis=1)
    between = ends[pairs[:, :1]] + np.linspace(0, 1, int(2 * _REACH * pen) + 1)[:, None] * gap
    has_ink = ink[tuple(np.rint(between).astype(int).T)].mean(axis=0) >= _INKED
    # Both curves, as far as the middle of the gap, where one that continues the other has its place and way.
    ended = np.array([_fit_end(side, pen) for side in sides])
    place, slope, bend = np.moveaxis(ended[pairs], 2, 0)
    back = -vector_length(*gap.T).T[..., None] / 2
    apart = vector_length(*np.diff(place + back * slope + back**2 * bend, axis=1)[:, 0].T) / pen
    ahead = slope + 2 * back * bend
    turn = _angle_between(ahead[:, 0], -ahead[:, 1])
    is_smooth = has_ink & (turn < _TURN) & (apart < _APART)
    pairs, cost = pairs[is_smooth], (turn / _TURN + apart)[is_smooth]
    away = np.array([side[min(int(_REACH * pen), len(side) - 1)] for side in sides])
    cost += _ASIDE * _count_aside(pairs, ends, away, is_long, _REACH * pen)
    after = np.full(len(sides), -1)
    for pair in pairs[np.argsort(cost, kind="stable")]:
        if (after[pair] < 0).all():
            after[pair] = pair[::-1]
    joined, used = [], np.zeros(len(ways), dtype=bool)
    for begin in np.argsort(after >= 0, kind="stable"):  # what is left at last are closed lines
        parts, end = [], begin
        while end >= 0 and not used[end // 2]:
            used[end // 2] = True
            parts.append(sides[end])
            end = after[end ^ 1]
        if parts:
            joined.append(np.concatenate([*parts, parts[0][:1]] if end >= 0 else parts))
    return joined


def _count_aside(pairs: Ints, ends: Ints, away: Ints, counts: Bools, reach: float) -> Floats:
    """How many more third lines leave the junction of each pair (k, 2) to one side than to the other; (k,).

    Lines that cross have each other on both sides. ends, away: the end of each line (n, 2) in pixels, and a
    place on it. counts: which lines (n,) count as third ones. reach: pixels from the pair to their ends.
    """
    from scipy.spatial import KDTree

    middle, numbers = ends[pairs].mean(axis=1), np.flatnonzero(counts)
    near = KDTree(ends[numbers]).query_ball_point(middle, reach)
    at = np.repeat(np.arange(len(pairs)), [len(around) for around in near])
    third = numbers[np.concatenate([*near, []]).astype(int)]
    is_apart = (third[:, None] != pairs[at]).all(axis=1)
    at, third = at[is_apart], third[is_apart]
    first, second = (np.arctan2(*(away[side] - middle).T) for side in pairs.T)
    angle = np.arctan2(*(away[third] - middle[at]).T)
    is_between = (angle - first[at]) % (2 * np.pi) < ((second - first) % (2 * np.pi))[at]
    return np.abs(np.bincount(at, np.where(is_between, 1.0, -1.0), len(pairs)))


def _fit_end(side: NDArray[np.int64], pen: float) -> Floats:
    """Coefficients (3, 2) of a parabola along a line from its first point, near which thinned lines turn."""
    skipped = int(_SKIP * pen) if len(side) > 2 * _SKIP * pen + 3 else 0
    part = side[skipped : int(_FAR * pen) + 4]
    steps = vector_length(*np.diff(part, axis=0, prepend=side[:1]).T)
    degree = 2 if len(part) > 4 * pen else 1
    fitted = np.polyfit(np.cumsum(steps), part, degree)[::-1]
    return np.concatenate([fitted, np.zeros((2 - degree, 2))])


def _split_at_corners(way: NDArray[np.int64], arm: int) -> list[NDArray[np.int64]]:
    """The parts of a traced line (k, 2) between its corners, where it turns abruptly."""
    if len(way) <= 2 * arm:
        return [way]
    from scipy import ndimage

    at = np.arange(arm, len(way) - arm)

    def run(begin: int, end: int) -> Floats:
        first, last = (way[np.clip(at + step, 0, len(way) - 1)].astype(np.float64) for step in (begin, end))
        return last - first

    turn = _angle_between(run(-arm, 0), run(0, arm))
    around = _angle_between(run(-3 * arm, -arm), run(arm, 3 * arm))
    turn = np.where(turn > np.maximum(_CORNER, around / 2), turn, 0.0)
    corners = at[(turn > 0) & (turn == ndimage.maximum_filter1d(turn, 2 * arm + 1))]
    corners = corners[np.diff(corners, prepend=-arm) > arm]
    return [way[first : last + 1] for first, last in pairwise([0, *corners.tolist(), len(way) - 1])]


def _angle_between(first: Floats, second: Floats) -> Floats:
    """The angles between vectors (k, 2), in radians."""
    across = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    return np.asarray(np.abs(np.arctan2(across, (first * second).sum(axis=1))))


def thin_shape(shape: Bools) -> Bools:
    """The shape [h, w] thinned to lines one pixel wide, after Zhang and Suen (Commun. ACM 27, 1984)."""
    line = np.pad(shape, 1)
    while True:
        before = int(line.sum())
        for first in (True, False):
            line[1:-1, 1:-1] &= ~_removable_pixels(line, first=first)
        if int(line.sum()) == before:
            return line[1:-1, 1:-1]


def _removable_pixels(line: Bools, *, first: bool) -> Bools:
    """The pixels of a padded shape that one of the two passes of the thinning removes."""
    # Neighbours from the upper one on, clockwise.
    steps = ((0, 1), (0, 2), (1, 2), (2, 2), (2, 1), (2, 0), (1, 0), (0, 0))
    height, width = line.shape
    around = np.stack([line[down : height - 2 + down, right : width - 2 + right] for down, right in steps])
    up, right, down, left = around[::2]
    count = around.sum(axis=0, dtype=np.uint8)
    turns = (~around & np.roll(around, -1, axis=0)).sum(axis=0, dtype=np.uint8)
    sides = (up & right & down) | (right & down & left) if first else (up & right & left) | (up & down & left)
    return np.asarray((count >= 2) & (count <= 6) & (turns == 1) & ~sides)


def _is_link(way: NDArray[np.int64], ends: Counter[_Pixel]) -> bool:
    """Whether a short way lies between two junctions, where it closes a gap."""
    return len(way) >= _SHORTEST_LINK and all(ends[row, column] > 1 for row, column in way[[0, -1]].tolist())


def smooth_way(way: NDArray[np.int64]) -> Floats:
    """A traced line (k, 2) as a smooth one with the same ends and half of its points: columns and rows."""
    from scipy import ndimage

    way = way[:, ::-1]
    even = ndimage.gaussian_filter1d(way.astype(np.float64), _SMOOTH, axis=0, mode="nearest")
    if (way[0] == way[-1]).all():
        even = ndimage.gaussian_filter1d(way[:-1].astype(np.float64), _SMOOTH, axis=0, mode="wrap")
        return np.concatenate([even[::2], even[:1]])
    even[0], even[-1] = way[0], way[-1]
    return np.concatenate([even[:-1:2], even[-1:]])


def _trace_ways(line: Bools) -> list[_Way]:
    """The pixels of a thinned drawing as ways from one end or junction to the next, each link once."""
    there: set[_Pixel] = {(row, column) for row, column in np.argwhere(line).tolist()}
    links = {pixel: _neighbours(pixel, there) for pixel in there}
    used: set[tuple[_Pixel, _Pixel]] = set()

    def walk(first: _Pixel, second: _Pixel) -> _Way:
        way = [first, second]
        used.update({(first, second), (second, first)})
        while len(links[way[-1]]) == 2:
            after = next((pixel for pixel in links[way[-1]] if (way[-1], pixel) not in used), None)
            if after is None:
                break
            used.update({(way[-1], after), (after, way[-1])})
            way.append(after)
        return way

    # Ends and junctions first; what is left are closed ways.
    order = sorted(there, key=lambda pixel: (len(links[pixel]) == 2, pixel))
    return [
        walk(pixel, neighbour)
        for pixel in order
        for neighbour in links[pixel]
        if (pixel, neighbour) not in used
    ]


def _neighbours(pixel: _Pixel, there: set[_Pixel]) -> list[_Pixel]:
    """The neighbours of a pixel; one at a corner counts only if no neighbour at a side is next to it."""
    row, column = pixel
    return [
        (row + down, column + right)
        for down, right in _AROUND
        if (row + down, column + right) in there
        and not (down and right and ((row, column + right) in there or (row + down, column) in there))
    ]
