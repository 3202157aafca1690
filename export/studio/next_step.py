"""The next step of a drawing on the page, until its strokes determine a field."""

from __future__ import annotations

from typing import Final, Literal

import numpy as np
from scipy.spatial import KDTree

from ...models.instance.angles import line_difference
from ...models.instance.domain import Floats, Ints
from ...models.sketch.cover import CUT, cover_by_segments, fit_frame
from ...models.sketch.outline import find_inside
from .document import Document

NextStep = Literal["outline", "line", "across", ""]

_SIZE: Final = 48  # pixels of the longer side of the grid that decides, for fields of every size
_NEAR: Final = 1.5  # pixels between two lines that meet
_CROWD: Final = 4  # points of one direction in a pixel: more of them meet nothing else
_APART: Final = np.radians(30)  # least angle between lines of two families; strokes tremble by less


def find_next_step(document: Document) -> NextStep:
    """The next step of a drawing: a closed outline, a curvature line, a line across the others, or none.

    Lines of one family leave the other family free: turning it by any angle costs nothing, so many fields
    have the least energy. Where two lines cross, both lines of the cross are given, and smoothness carries
    them on. So a field counts as determined once two curvature lines meet at a clear angle.
    """
    segments = document.segments()[0]
    if not len(segments):
        return "outline"
    corners = segments.reshape(-1, 2)
    frame = fit_frame((*corners.min(axis=0), *corners.max(axis=0)), _SIZE, margin=True)
    is_line = np.array([stroke.mark == "line" for stroke in document.strokes])
    lines = [
        (document.strokes[number].points - (frame.x, frame.y)) / frame.pixel
        for number in document.visible[is_line[document.visible]]
    ]
    if _do_lines_meet(lines):
        return ""
    if not document.mask and find_inside(cover_by_segments(segments, frame).amount >= CUT).all():
        return "outline"
    return "across" if lines else "line"


def _do_lines_meet(lines: list[Floats]) -> bool:
    """Whether two polylines, in pixels, come near each other at a clear angle."""
    if not lines:
        return False
    lines = [_resample(line) for line in lines]
    owner = np.repeat(np.arange(len(lines)), [len(line) for line in lines])
    points = np.concatenate(lines)
    right, down = np.concatenate([np.gradient(line, axis=0) for line in lines]).T
    direction = np.arctan2(down, right) % np.pi
    kept = _thin_crowds(np.column_stack([points, direction / _APART * 3]))
    points, owner, direction = points[kept], owner[kept], direction[kept]
    first, second = KDTree(points).query_pairs(_NEAR, output_type="ndarray").T
    apart = line_difference(direction[first], direction[second]) > _APART
    return bool((apart & (owner[first] != owner[second])).any())


def _thin_crowds(values: Floats) -> Ints:
    """Numbers of rows, all but those with _CROWD others before them in the same unit cell."""
    cell = np.unique(np.floor(values), axis=0, return_inverse=True)[1]
    order = np.argsort(cell, kind="stable")
    rank = np.arange(len(order)) - np.searchsorted(cell[order], cell[order])
    return order[rank < _CROWD].astype(np.int32)


def _resample(line: Floats) -> Floats:
    """Points of a polyline about a pixel apart, at least two: shorter steps would follow a trembling hand."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    at = np.linspace(0, along[-1], max(2, int(along[-1]) + 1))
    return np.stack([np.interp(at, along, side) for side in line.T], axis=1)
