"""Where curvature lines meet, and which strokes therefore cannot be curvature lines."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from ...models.instance.angles import line_difference
from ...models.instance.domain import Bools, Floats, Ints
from ...models.sketch.cover import Frame, fit_frame
from ...models.surface.trust import OFF
from .document import Document

_SIZE: Final = 48  # pixels of the longer side of the grid that decides, for fields of every size
_NEAR: Final = 1.5  # pixels between two lines that meet
_CROWD: Final = 4  # points of one direction in a pixel: more of them meet nothing else
_APART: Final = np.radians(30)  # least angle between lines of two families; strokes tremble by less
_STEADY: Final = 3  # pixels to either side over which a direction is measured, for the same reason
_LONG: Final = 8  # pixels of a stroke that can be suspected; links in junctions of a picture are shorter
_END: Final = 8.0  # pixels from the end of a line, at most a quarter of it, where all lines meet at a pole
_SPOT: Final = 2.0  # pixels between meetings at one place
_THICKET: Final = 20_000  # pairs of lines that meet, from which on no net can be told
_MOST: Final = 5  # suspects at a time


def frame_of(segments: Floats) -> Frame:
    """The grid on which strokes are compared, around their segments (k, 2, 2)."""
    corners = segments.reshape(-1, 2)
    return fit_frame((*corners.min(axis=0), *corners.max(axis=0)), _SIZE, margin=True)


def lines_of(document: Document, frame: Frame) -> tuple[Ints, list[Floats]]:
    """Numbers of the visible curvature lines, and their points about a pixel apart, in pixels."""
    is_line = np.array([stroke.mark == "line" for stroke in document.strokes], dtype=bool)
    numbers = document.visible[is_line[document.visible]]
    return numbers, [
        _resample((document.strokes[number].points - (frame.x, frame.y)) / frame.pixel) for number in numbers
    ]


def _resample(line: Floats) -> Floats:
    """Points of a polyline about a pixel apart, at least two: shorter steps would follow a trembling hand."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    at = np.linspace(0, along[-1], max(2, int(along[-1]) + 1))
    return np.stack([np.interp(at, along, side) for side in line.T], axis=1)


def find_meetings(lines: list[Floats], *, at_ends: bool = True) -> tuple[Ints, Floats]:
    """Pairs of lines, as from `lines_of`, that come near each other at a clear angle.

    Returns their numbers (k, 2), the lower one first, and the places (k, 2) where they are nearest.
    at_ends: whether places count that are near an end of both.
    """
    if not lines:
        return np.empty((0, 2), dtype=np.int32), np.empty((0, 2))
    owner = np.repeat(np.arange(len(lines), dtype=np.int32), [len(line) for line in lines])
    points = np.concatenate(lines)
    right, down = np.concatenate([_directions(line) for line in lines]).T
    direction = np.arctan2(down, right) % np.pi
    inner = np.concatenate([~_is_end(line) for line in lines]) | at_ends
    kept = _thin_crowds(np.column_stack([points, direction / _APART * 3]))
    near = kept[KDTree(points[kept]).query_pairs(_NEAR, output_type="ndarray")]
    first, second = near.T
    apart = line_difference(direction[first], direction[second]) > _APART
    near = near[apart & (owner[first] != owner[second]) & (inner[first] | inner[second])]
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


def find_suspects(document: Document, misfit: Floats) -> list[int]:
    """Numbers of the strokes, at most a few, that are probably no curvature lines.

    Curvature lines of one family never cross, so one of three lines that all cross each other is none. The
    stroke in most such triples is suspected; of several, the one that fits the surface least, unless even
    that fits. Lines may meet at a pole, in one place or at their ends.

    misfit: mean deviation of the crosses at each stroke from a right angle on the surface, in radians.
    """
    numbers, lines = lines_of(document, frame_of(document.segments()[0]))
    long = np.array([len(line) > _LONG for line in lines], dtype=bool)
    numbers, lines = numbers[long], [line for line in lines if len(line) > _LONG]
    pairs, places = find_meetings(lines, at_ends=False)
    suspects: list[int] = []
    if not 0 < len(pairs) < _THICKET:
        return suspects
    spot = _join_places(places)
    while len(suspects) < _MOST and len(pairs):
        triples = _count_triples(pairs, len(lines))
        at_spot, where = np.unique(spot[:, None] * len(lines) + pairs, return_inverse=True)
        at_poles = _count_triples(where.reshape(pairs.shape), len(at_spot))
        triples -= np.bincount(at_spot % len(lines), at_poles, len(lines))
        most = np.flatnonzero(triples == triples.max())
        worst = most[np.argmax(misfit[numbers[most]])]
        if triples[worst] <= 0 or (len(most) > 1 and misfit[numbers[worst]] <= OFF):
            break
        suspects.append(int(numbers[worst]))
        others = (pairs != worst).all(axis=1)
        pairs, spot = pairs[others], spot[others]
    return sorted(suspects)


def _join_places(places: Floats) -> Ints:
    """The number of the spot of each place (k, 2): places that are near each other are one spot."""
    near = KDTree(places).query_pairs(_SPOT, output_type="ndarray").T
    graph = sparse.coo_array((np.ones(near.shape[1]), near), shape=2 * places.shape[:1])
    return np.asarray(connected_components(graph, directed=False)[1])


def _count_triples(pairs: Ints, count: int) -> Floats:
    """The number (count,) of the triples with all three pairs in which each line is."""
    meet = sparse.coo_array((np.ones(len(pairs)), pairs.T), shape=(count, count)).tocsr()
    meet = meet + meet.T
    return np.asarray((meet @ meet).multiply(meet).sum(axis=1)) / 2
