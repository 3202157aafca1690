"""Where lines of a drawing meet at a clear angle."""

from __future__ import annotations

from typing import Final

import numpy as np

from ..instance.angles import line_difference
from ..instance.domain import Bools, Floats, Ints

GRID: Final = (
    48  # pixels of the longer side of the grid on which lines are compared, for fields of every size
)
_NEAR: Final = 1.5  # pixels between two lines that meet
_CROWD: Final = 4  # points of one direction in a pixel: more of them meet nothing else
_APART: Final = np.radians(30)  # least angle between lines of two families; strokes tremble by less
_STEADY: Final = 3  # pixels to either side over which a direction is measured, for the same reason
_END: Final = 8.0  # pixels from the end of a line, at most a quarter of it, where all lines meet at a pole


def resample(line: Floats) -> Floats:
    """Points of a polyline about a pixel apart, at least two: shorter steps would follow a trembling hand."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    at = np.linspace(0, along[-1], max(2, int(along[-1]) + 1))
    return np.stack([np.interp(at, along, side) for side in line.T], axis=1)


def find_meetings(lines: list[Floats], *, most_ends: int = 2) -> tuple[Ints, Floats]:
    """Pairs of lines, with points as from `resample`, that come near each other at a clear angle.

    Returns their numbers (k, 2), the lower one first, and the places (k, 2) where they are nearest.
    most_ends: how many of the two lines may be near an end there.
    """
    from scipy.spatial import KDTree

    if not lines:
        return np.empty((0, 2), dtype=np.int32), np.empty((0, 2))
    owner = np.repeat(np.arange(len(lines), dtype=np.int32), [len(line) for line in lines])
    points = np.concatenate(lines)
    right, down = np.concatenate([_directions(line) for line in lines]).T
    direction = np.arctan2(down, right) % np.pi
    is_end = np.concatenate([_is_end(line) for line in lines])
    kept = _thin_crowds(np.column_stack([points, direction / _APART * 3]))
    near = kept[KDTree(points[kept]).query_pairs(_NEAR, output_type="ndarray")]
    first, second = near.T
    apart = line_difference(direction[first], direction[second]) > _APART
    near = near[apart & (owner[first] != owner[second]) & (is_end[near].sum(axis=1) <= most_ends)]
    closest = np.argsort(np.hypot(*np.diff(points[near], axis=1)[:, 0].T), kind="stable")
    near = near[closest]
    low, high = np.sort(owner[near].astype(np.int64), axis=1).T
    key, first = np.unique(low * len(lines) + high, return_index=True)
    return np.stack(np.divmod(key, len(lines)), axis=1), points[near[first]].mean(axis=1)


def _directions(line: Floats) -> Floats:
    """Vectors along a line at its points."""
    at = np.arange(len(line))
    return line[np.minimum(at + _STEADY, len(line) - 1)] - line[np.maximum(at - _STEADY, 0)]


def _is_end(line: Floats) -> Bools:
    """Which points of a line are near one of its ends; none of a closed line."""
    at = np.arange(len(line))
    closed = np.hypot(*(line[0] - line[-1])) < _NEAR
    return np.asarray((np.minimum(at, at[::-1]) < min(_END, len(line) / 4)) & ~closed)


def _thin_crowds(values: Floats) -> Ints:
    """Numbers of rows, all but those with _CROWD others before them in the same unit cell."""
    cell = np.unique(np.floor(values), axis=0, return_inverse=True)[1].ravel()  # NumPy 2.0 adds an axis
    order = np.argsort(cell, kind="stable")
    rank = np.arange(len(order)) - np.searchsorted(cell[order], cell[order])
    return order[rank < _CROWD].astype(np.int32)
