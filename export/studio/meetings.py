"""Strokes that cannot be curvature lines, because of where these meet."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from ...models.instance.domain import Floats, Ints
from ...models.sketch.cover import Frame, box_around, fit_frame
from ...models.sketch.meetings import GRID, find_meetings, resample
from .document import Document

_LONG: Final = 8  # pixels of a stroke that can be suspected; links in junctions of a picture are shorter
_SPOT: Final = 2.0  # pixels between meetings at one place
_THICKET: Final = 20_000  # pairs of lines that meet, from which on no net can be told
_MISFIT: Final = np.radians(15)  # from which a stroke does not fit the surface
_MOST: Final = 5  # suspects at a time


def frame_of(segments: Floats) -> Frame:
    """The grid on which strokes are compared, around their segments (k, 2, 2)."""
    return fit_frame(box_around(segments), GRID, margin=True)


def lines_of(document: Document, frame: Frame) -> tuple[Floats, Ints]:
    """Points of the visible curvature lines in pixels, and the stroke of each, as from `resample`."""
    segments, stroke = document.segments
    is_line = np.array([stroke.mark == "line" for stroke in document.strokes], dtype=bool)[stroke]
    return resample((segments[is_line] - (frame.x, frame.y)) / frame.pixel, stroke[is_line])


def find_suspects(document: Document, misfit: Floats) -> list[int]:
    """Numbers of the strokes, at most a few, that are probably no curvature lines.

    Curvature lines of one family never cross, so one of three lines that all cross each other is none. The
    stroke in most such triples is suspected if it alone is in all of them, or if it does not fit the surface;
    of several, the one that fits least. Lines may meet at a pole, in one place or at their ends.

    misfit: mean deviation of the crosses at each stroke from a right angle on the surface, in radians.
    """
    points, owner = lines_of(document, frame_of(document.segments[0]))
    long = np.bincount(owner)[owner] > _LONG
    pairs, places = find_meetings(points[long], owner[long], most_ends=1)
    suspects: list[int] = []
    if not 0 < len(pairs) < _THICKET:
        return suspects
    spot = _join_places(places)
    while len(suspects) < _MOST and len(pairs):
        triples = _count_triples(pairs, len(misfit))
        at_spot, where = np.unique(spot[:, None] * len(misfit) + pairs, return_inverse=True)
        at_poles = _count_triples(where.reshape(pairs.shape), len(at_spot))
        triples -= np.bincount(at_spot % len(misfit), at_poles, len(misfit))
        most = np.flatnonzero(triples == triples.max())
        worst = most[np.argmax(misfit[most])]
        is_sole = len(most) == 1 and 3 * triples[worst] == triples.sum()
        if triples[worst] <= 0 or not (is_sole or misfit[worst] > _MISFIT):
            break
        suspects.append(int(worst))
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
