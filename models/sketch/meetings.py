"""Where lines of a drawing meet at a clear angle."""

from __future__ import annotations

from typing import Final

import numpy as np

from ..instance.angles import line_difference
from ..instance.domain import Floats, Ints

GRID: Final = 48  # pixels of the longer side of the grid on which lines of any field are compared
_NEAR: Final = 1.5  # pixels between two lines that meet
_CROWD: Final = 4  # points of one direction in a pixel: more of them meet nothing else
_APART: Final = np.radians(30)  # least angle between lines of two families; strokes tremble by less
_STEADY: Final = 3  # pixels to either side over which a direction is measured, for the same reason
_TINY: Final = 1e-300
_END: Final = 8.0  # pixels from the end of a line, at most a quarter of it, where all lines meet at a pole


def resample(segments: Floats, owner: Ints) -> tuple[Floats, Ints]:
    """Points (k, 2) of lines about a pixel apart, at least two on each, and the line (k,) of each point.

    Shorter steps would follow a trembling hand. segments: (m, 2, 2) in pixels, one line after the other.
    owner: the number (m,) of the line of each, ascending.
    """
    numbers, first, parts = np.unique(owner, return_index=True, return_counts=True)
    step = segments[:, 1] - segments[:, 0]
    along = np.concatenate([[0.0], np.cumsum(np.hypot(step[:, 0], step[:, 1]))])
    length = along[first + parts] - along[first]
    count = np.maximum(2, length.astype(np.int64) + 1)
    line = np.repeat(np.arange(len(numbers)), count)
    share = (np.arange(len(line)) - (np.cumsum(count) - count)[line]) / (count - 1)[line]
    at = along[first][line] + share * length[line]
    part = np.searchsorted(along, at, side="right") - 1
    part = part.clip(first[line], (first + parts - 1)[line])
    rest = (at - along[part]) / np.maximum(along[part + 1] - along[part], _TINY)
    return segments[part, 0] + rest.clip(0, 1)[:, None] * step[part], numbers[line]


def find_meetings(points: Floats, owner: Ints, *, most_ends: int = 2) -> tuple[Ints, Floats]:
    """Pairs of lines, as from `resample`, that come near each other at a clear angle.

    Returns their numbers (k, 2), the lower one first, and the places (k, 2) where they are nearest.
    most_ends: how many of the two lines may be near an end there.
    """
    from scipy.spatial import KDTree

    if not len(points):
        return np.empty((0, 2), dtype=np.int32), np.empty((0, 2))
    at = np.arange(len(points))
    begin, end = (np.searchsorted(owner, owner, side) for side in ("left", "right"))
    way = points[np.minimum(at + _STEADY, end - 1)] - points[np.maximum(at - _STEADY, begin)]
    direction = np.arctan2(way[:, 1], way[:, 0]) % np.pi
    gap = points[begin] - points[end - 1]
    is_closed = np.hypot(gap[:, 0], gap[:, 1]) < _NEAR
    is_end = (np.minimum(at - begin, end - 1 - at) < np.minimum(_END, (end - begin) / 4)) & ~is_closed
    kept = _thin_crowds(np.column_stack([points, direction / _APART * 3]))
    near = kept[KDTree(points[kept]).query_pairs(_NEAR, output_type="ndarray")]
    first, second = near.T
    apart = line_difference(direction[first], direction[second]) > _APART
    ends = is_end[first].astype(np.int64) + is_end[second]
    near = near[apart & (owner[first] != owner[second]) & (ends <= most_ends)]
    gap = points[near[:, 0]] - points[near[:, 1]]
    near = near[np.argsort(np.hypot(gap[:, 0], gap[:, 1]), kind="stable")]
    first, second = owner[near].astype(np.int64).T
    count = owner[-1] + 1
    key, place = np.unique(np.minimum(first, second) * count + np.maximum(first, second), return_index=True)
    return np.stack(np.divmod(key, count), axis=1), points[near[place]].mean(axis=1)


def _thin_crowds(values: Floats) -> Ints:
    """Numbers of rows, all but those with _CROWD others before them in the same unit cell."""
    place = np.floor(values).astype(np.int64)
    cell = (place - place.min(axis=0)) @ np.array([1 << 40, 1 << 20, 1])
    order = np.argsort(cell, kind="stable")
    rank = np.arange(len(order)) - np.searchsorted(cell[order], cell[order])
    return np.asarray(order[rank < _CROWD], dtype=np.int32)
