"""Lines of a drawing that are no edges: hatching, ruled paper, and faint construction lines.

Only strokes that would cut the field can be hatching or ruled paper: parallels among curvature lines, such as
the rulings of a cylinder, stay.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from ..instance.angles import vector_length
from ..instance.domain import Bools, Floats
from .cover import Frame, Indices
from .curves import STRAIGHT, Curves
from .outline import drop_narrow_parts

MANY: Final = 8  # least lines of a family
_CLOSE: Final = 0.03  # greatest spacing of a hatching as a share of the drawing's longer side
_LONG: Final = 0.5  # least length of ruled lines, likewise
_BESIDE: Final = 0.5  # greatest shift along a neighbour, as a share of the shorter one
_SAMPLES: Final = 36  # places along a line that are inside or outside of the outline
_BEYOND: Final = 2  # of these at each end: least part of a line that leaves the outline on both sides
_BIN: Final = np.radians(2.0)  # of directions; a family takes three neighbouring ones


def leave_out_non_edges(curves: Curves) -> Curves:
    """The curves without hatching, ruled paper and faint lines, and notes on these."""
    is_left_out, notes = find_non_edges(curves)
    kept = ~is_left_out
    return replace(
        curves,
        points=curves.points[kept],
        curve=curves.curve[kept],
        red=curves.red[kept],
        chosen=None if curves.chosen is None else curves.chosen[kept],
        notes=(*curves.notes, *notes),
        faint=None,
    )


def find_non_edges(curves: Curves) -> tuple[Bools, tuple[str, ...]]:
    """Which parts of curves (k,) are hatching, ruled paper or faint, and notes on them."""
    first, last, start, way, is_straight = _find_chords(curves)
    chord = vector_length(*way.T)
    is_cut = is_straight & ~curves.line[first]
    bins = round(np.pi / _BIN)
    direction = np.round(np.arctan2(way[:, 1], way[:, 0]) / _BIN).astype(int) % bins
    left, top, right, bottom = curves.box
    side = max(right - left, bottom - top)
    is_left_out = np.zeros(len(first), dtype=bool)
    notes = []
    for best in np.argsort(-np.bincount(direction[is_cut], minlength=bins), kind="stable"):
        turn = (direction - best + 1) % bins
        members = np.flatnonzero(is_cut & (turn <= 2) & ~is_left_out)
        is_long = chord[members] >= _LONG * side
        is_ruled = is_long.sum() >= MANY
        members = members[is_long] if is_ruled else members
        if len(members) < MANY:
            continue
        along = np.array([np.cos(best * _BIN), np.sin(best * _BIN)])
        middle = start[members] + way[members] / 2
        offset = middle @ (-along[1], along[0])
        order = np.argsort(offset, kind="stable")
        # Lines of a row are side by side; pieces of one edge follow each other.
        apart, length = np.abs(np.diff(middle[order] @ along)), chord[members][order]
        is_row = np.median(apart / np.minimum(length[1:], length[:-1])) < _BESIDE
        if is_row and (is_ruled or np.median(np.diff(offset[order])) <= _CLOSE * side):
            is_left_out[members] = True
            if is_ruled:  # the margin of a page crosses all lines, in any colour
                is_left_out |= is_straight & (turn == bins // 2 + 1) & (chord >= np.ptp(offset))
            x, y = middle.mean(axis=0)
            notes.append(
                f"{len(members)} parallel lines round ({x:.4g}, {y:.4g}) are left out as hatching or ruled "
                "paper; if they are curvature lines, mark them as such (in commands: --curvature)"
            )
    if curves.faint is not None and (is_faint := curves.faint[first] & ~is_left_out).any():
        x, y = curves.points[(first + last)[is_faint][0] // 2, 0]
        count = f"{is_faint.sum()} lines are" if is_faint.sum() > 1 else "1 line is"
        notes.append(
            f"{count} much paler or thinner than the others and left out as construction lines, first round "
            f"({x:.4g}, {y:.4g}); if they belong to the object, draw them as strong as the others"
        )
        is_left_out |= is_faint
    return np.repeat(is_left_out, last + 1 - first), tuple(notes)


def _find_chords(curves: Curves) -> tuple[Indices, Indices, Floats, Floats, Bools]:
    """First and last part of each curve, its start and the way to its end (n, 2), and which are straight."""
    first = np.flatnonzero(np.diff(curves.curve, prepend=-1))
    last = np.append(first[1:], len(curves.curve)) - 1
    legs = vector_length(*np.moveaxis(np.diff(curves.points, axis=1), -1, 0)).sum(axis=1)
    start, way = curves.points[first, 0], curves.points[last, 3] - curves.points[first, 0]
    chord = vector_length(*way.T)
    return first, last, start, way, (chord >= STRAIGHT * np.add.reduceat(legs, first)) & (chord > 0)


def describe_lines_across(curves: Curves, region: Bools, frame: Frame) -> str | None:
    """Straight lines that leave a region [height, width] on both sides, unless others are curvature lines."""
    from scipy import ndimage

    first, _, start, way, is_straight = _find_chords(curves)
    share = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    at = (start[:, None] + share[:, None] * way[:, None] - (frame.x, frame.y)) / frame.pixel
    column, row = np.moveaxis(np.floor(at).astype(int).clip(-1, max(frame.shape)), -1, 0)
    body = ndimage.binary_dilation(drop_narrow_parts(region), np.ones((3, 3)))
    around = np.pad(body, (1, max(frame.shape)))
    is_inside = around[row + 1, column + 1]
    is_across = is_straight & ~is_inside[:, [*range(_BEYOND), *range(-_BEYOND, 0)]].any(axis=1)
    is_across &= (is_inside.mean(axis=1) > 1 / 3) & ~(curves.line & ~curves.line.all())[first]
    if not is_across.any():
        return None
    x, y = (start + way / 2)[np.argmax(is_across)]
    count = f"{is_across.sum()} straight lines leave" if is_across.sum() > 1 else "1 straight line leaves"
    return (
        f"{count} the outline on both sides, first round ({x:.4g}, {y:.4g}); remove construction lines, or "
        "draw them much paler or thinner than the others"
    )
