"""Middle lines of the strokes in a picture, by thinning."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..instance.domain import Bools, Floats

_SMOOTH: Final = 2.0  # pixels over which a traced line is smoothed
_SHORTEST: Final = 6  # pixels of a traced line; shorter ones, or than a stroke is wide, are burrs
_SHORTEST_LINK: Final = 4  # pixels of a traced line between two junctions
_LINK: Final = 2.0  # pens that a link inside a junction is long
_REACH: Final = 5.0  # pens from the end of a way to that of another one across a junction
_TURN: Final = np.radians(35)  # greatest angle between a way and its continuation
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


def join_ways(ways: Sequence[NDArray[np.int64]], pen: float) -> list[NDArray[np.int64]]:
    """Traced lines, joined where one continues another one across a junction, the straightest first.

    pen: width of the strokes in pixels. Lines that are shorter than two pens lie inside a junction.
    """
    from scipy.spatial import KDTree

    sides = [side for way in ways for side in (way, way[::-1])]
    far = [side[min(int(4 * pen) + 4, len(side) - 1)] for side in sides]
    # Thinned strokes turn aside in a junction.
    inward = np.subtract(far, [side[int(pen) if len(side) > 2 * pen + 3 else 0] for side in sides])
    inward = inward / np.maximum(np.hypot(*inward.T), 1)[:, None]
    ends, is_long = (
        np.array([side[0] for side in sides]),
        np.array([len(side) > _LINK * pen for side in sides]),
    )
    pairs = KDTree(ends).query_pairs(_REACH * pen, output_type="ndarray")
    pairs = pairs[is_long[pairs].all(axis=1) & (pairs[:, 0] // 2 != pairs[:, 1] // 2)]
    (first, second), gap = pairs.T, np.diff(ends[pairs], axis=1)[:, 0]
    length = np.hypot(*gap.T)
    ahead = np.sum(gap * (inward[second] - inward[first]), axis=1) / 2 / np.maximum(length, 1)
    straight = -np.sum(inward[first] * inward[second], axis=1)
    straight = np.where(length > _LINK * pen, np.minimum(straight, ahead), straight)
    after = np.full(len(sides), -1)
    for pair in pairs[np.argsort(-straight, kind="stable")][: np.sum(straight > np.cos(_TURN))]:
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
