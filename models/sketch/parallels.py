"""Straight parallels in a drawing that are hatching or ruled paper rather than edges.

Only strokes that would cut the field can be either: parallels among curvature lines, such as the rulings of a
cylinder, stay.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from ..instance.angles import vector_length
from ..instance.domain import Bools
from .curves import Curves

MANY: Final = 8  # least lines of a family
_CLOSE: Final = 0.03  # greatest spacing of a hatching as a share of the drawing's longer side
_LONG: Final = 0.5  # least length of ruled lines, likewise
_BESIDE: Final = 0.5  # greatest shift along a neighbour, as a share of the shorter one
_STRAIGHT: Final = 0.99  # least chord of a straight line as a share of its length
_BIN: Final = np.radians(2.0)  # of directions; a family takes three neighbouring ones


def leave_out_parallels(curves: Curves) -> Curves:
    """The curves without hatching and ruled paper, and notes on both."""
    is_parallel, notes = find_parallels(curves)
    kept = ~is_parallel
    return replace(
        curves,
        points=curves.points[kept],
        curve=curves.curve[kept],
        red=curves.red[kept],
        chosen=None if curves.chosen is None else curves.chosen[kept],
        notes=(*curves.notes, *notes),
    )


def find_parallels(curves: Curves) -> tuple[Bools, tuple[str, ...]]:
    """Which parts of curves (k,) are hatching or ruled paper, and a note on each family of them."""
    first = np.flatnonzero(np.diff(curves.curve, prepend=-1))
    last = np.append(first[1:], len(curves.curve)) - 1
    legs = vector_length(*np.moveaxis(np.diff(curves.points, axis=1), -1, 0)).sum(axis=1)
    start, way = curves.points[first, 0], curves.points[last, 3] - curves.points[first, 0]
    chord = vector_length(*way.T)
    is_straight = (chord >= _STRAIGHT * np.add.reduceat(legs, first)) & (chord > 0)
    is_cut = is_straight & ~curves.line[first]
    bins = round(np.pi / _BIN)
    direction = np.round(np.arctan2(way[:, 1], way[:, 0]) / _BIN).astype(int) % bins
    left, top, right, bottom = curves.box
    side = max(right - left, bottom - top)
    is_parallel = np.zeros(len(first), dtype=bool)
    notes = []
    for best in np.argsort(-np.bincount(direction[is_cut], minlength=bins), kind="stable"):
        turn = (direction - best + 1) % bins
        members = np.flatnonzero(is_cut & (turn <= 2) & ~is_parallel)
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
        apart = np.abs(np.diff(middle[order] @ along))
        is_row = (
            np.median(apart / np.minimum(chord[members][order][1:], chord[members][order][:-1])) < _BESIDE
        )
        if is_row and (is_ruled or np.median(np.diff(offset[order])) <= _CLOSE * side):
            is_parallel[members] = True
            if is_ruled:  # the margin of a page crosses all lines, in any colour
                is_parallel |= is_straight & (turn == bins // 2 + 1) & (chord >= np.ptp(offset))
            x, y = middle.mean(axis=0)
            notes.append(
                f"{len(members)} parallel lines round ({x:.4g}, {y:.4g}) are left out as hatching or ruled "
                "paper; if they are curvature lines, mark them as such (in commands: --curvature)"
            )
    return np.repeat(is_parallel, last + 1 - first), tuple(notes)
