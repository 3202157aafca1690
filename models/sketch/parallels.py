"""Families of parallels in a drawing that are hatching or ruled paper rather than lines on a surface.

The lines of a family are straight, side by side and evenly spaced. Hatching has many of them, close to each
other. The lines of ruled or squared paper go beyond the rest of the drawing on both sides. A few parallels on
a surface, such as the rulings of a cylinder, are neither.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from ..instance.angles import vector_length
from ..instance.domain import Floats
from .curves import Curves

HATCHED: Final = 10  # least lines of a hatching
CLOSE: Final = 0.03  # greatest spacing of a hatching as a share of the drawing's longer side
RULED: Final = 6  # least lines of ruled paper
_BEYOND: Final = 0.01  # of the longer side: least length of a ruled line beyond the drawing at each end
_STRAIGHT: Final = 0.99  # least chord of a straight line as a share of its length
_BIN: Final = np.radians(2.0)  # of the directions in the search for families
_PARALLEL: Final = np.radians(4.0)  # greatest angle between a line and its family
_BESIDE: Final = 0.5  # least part of a line beside its neighbour; greatest spacing as a share of their length
_NEXT: Final = 8  # lines on each side with which a line is compared
_TWICE: Final = 0.3  # of the spacing: closer lines are one line drawn twice
_UNEVEN: Final = 0.4  # greatest deviation from an even spacing as a share of it
_EXACT: Final = 0.02  # of the spacing: pieces of ruled lines lie on the lines, unlike the drawing
_MOSTLY: Final = 0.75  # least share of even spacings, and of ruled lines that go beyond the drawing

Indices = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class ParallelFamily:
    """Parallels of one kind. curve: numbers of their curves. count: of the lines, those drawn twice once."""

    curve: Indices
    count: int
    kind: Literal["hatching", "ruled paper"]
    middle: Floats

    def __str__(self) -> str:
        return f"{self.count} parallel lines round ({self.middle[0]:.4g}, {self.middle[1]:.4g})"


@dataclass(frozen=True, eq=False)
class _Lines:
    """Straight lines: their curves (n,), and their ends (n, 2) each."""

    curve: Indices
    start: Floats
    end: Floats

    @property
    def angle(self) -> Floats:
        return np.asarray(np.arctan2(*(self.end - self.start).T[::-1]))

    def at(self, which: Indices) -> _Lines:
        return _Lines(self.curve[which], self.start[which], self.end[which])


@dataclass(frozen=True, eq=False)
class _Row:
    """Evenly spaced parallels: numbers of the lines, those drawn twice once in `count`."""

    members: Indices
    direction: float
    count: int
    spacing: float


def leave_out_parallels(curves: Curves) -> Curves:
    """The curves without hatching and ruled paper, except for curvature lines, and notes on both."""
    kept = np.ones(len(curves.curve), dtype=bool)
    notes = []
    for family in find_parallels(curves):
        members = np.isin(curves.curve, family.curve)
        if curves.line[members].mean() > 0.5:  # a red margin makes no curvature lines of ruled paper
            notes.append(
                f"{family} look like {family.kind}, but count as curvature lines; "
                "hide them in the drawing, or ignore them in crossfield studio"
            )
        else:
            kept &= ~members
            notes.append(
                f"{family} are left out as {family.kind}; "
                "choose them with --curvature if they are curvature lines"
            )
    return replace(
        curves,
        points=curves.points[kept],
        curve=curves.curve[kept],
        red=curves.red[kept],
        chosen=None if curves.chosen is None else curves.chosen[kept],
        notes=(*curves.notes, *notes),
    )


def find_parallels(curves: Curves) -> list[ParallelFamily]:
    """The families of hatching and of ruled paper."""
    lines = _straight_lines(curves)
    rows = list(_even_rows(lines))
    if not rows:
        return []
    left, top, right, bottom = curves.box
    side = max(right - left, bottom - top)
    printed = [_printed_lines(lines, row) for row in rows]
    others = curves.points[~np.isin(curves.curve, lines.curve[np.concatenate(printed)])].reshape(-1, 2)
    families = []
    for row, numbers in zip(rows, printed, strict=True):
        members = lines.at(row.members)
        middle = (members.start + members.end).mean(axis=0) / 2
        if len(others) and _goes_beyond(members, row.direction, others, _BEYOND * side):
            families.append(ParallelFamily(lines.curve[numbers], row.count, "ruled paper", middle))
        elif row.count >= HATCHED and row.spacing <= CLOSE * side:
            families.append(ParallelFamily(members.curve, row.count, "hatching", middle))
    return families


def _straight_lines(curves: Curves) -> _Lines:
    """The curves that are straight lines."""
    first = np.flatnonzero(np.diff(curves.curve, prepend=-1))
    last = np.append(first[1:], len(curves.curve)) - 1
    legs = vector_length(*np.moveaxis(np.diff(curves.points, axis=1), -1, 0)).sum(axis=1)
    start, end = curves.points[first, 0], curves.points[last, 3]
    chord = vector_length(*(end - start).T)
    straight = (chord >= _STRAIGHT * np.add.reduceat(legs, first)) & (chord > 0)
    return _Lines(curves.curve[first][straight].astype(np.intp), start[straight], end[straight])


def _even_rows(lines: _Lines) -> Iterator[_Row]:
    """The evenly spaced rows of parallels."""
    angle = lines.angle
    is_waiting = np.ones(len(angle), dtype=bool)
    bins = round(np.pi / _BIN)
    while is_waiting.sum() >= RULED:
        count = np.bincount((angle[is_waiting] / _BIN).astype(np.int64) % bins, minlength=bins)
        wide = count + np.roll(count, 1) + np.roll(count, -1)
        best = int(np.argmax(wide))
        if wide[best] < RULED:
            break
        off = _turn(angle, (best + 0.5) * _BIN)
        parallel = np.flatnonzero(is_waiting & (np.abs(off) <= _PARALLEL))
        is_waiting[parallel] = False
        yield from _rows_of_parallels(lines, parallel, (best + 0.5) * _BIN + float(np.median(off[parallel])))


def _rows_of_parallels(lines: _Lines, parallel: Indices, direction: float) -> Iterator[_Row]:
    """The evenly spaced rows among lines of one direction."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    offset = _project((lines.start[parallel] + lines.end[parallel]) / 2, direction + np.pi / 2)
    order = np.argsort(offset, kind="stable")
    parallel, offset = parallel[order], offset[order]
    low, high = _extents(lines.at(parallel), direction)
    pairs = []
    for step in range(1, min(_NEXT, len(parallel) - 1) + 1):
        lengths = (high - low)[step:], (high - low)[:-step]
        shorter, longer = np.minimum(*lengths), np.maximum(*lengths)
        common = np.minimum(high[step:], high[:-step]) - np.maximum(low[step:], low[:-step])
        beside = (common >= _BESIDE * longer) & (offset[step:] - offset[:-step] <= _BESIDE * shorter)
        pairs.append(np.flatnonzero(beside)[:, None] + [0, step])
    one, other = np.concatenate(pairs).T
    links = coo_array((np.ones(len(one)), (one, other)), shape=(len(parallel),) * 2)
    count, row = connected_components(links, directed=False)
    for number in np.flatnonzero(np.bincount(row, minlength=count) >= RULED):
        members = np.flatnonzero(row == number)
        gaps = np.diff(offset[members])
        gaps = gaps[gaps > _TWICE * np.quantile(gaps, 0.75)]
        if len(gaps) + 1 < RULED:
            continue
        spacing = float(np.median(gaps))
        if (np.abs(gaps - spacing) <= _UNEVEN * spacing).mean() >= _MOSTLY:
            yield _Row(parallel[members], direction, len(gaps) + 1, spacing)


def _printed_lines(lines: _Lines, row: _Row) -> Indices:
    """Numbers of the lines of a row, of pieces of such lines, and of margins, which cross the whole row."""
    across = row.direction + np.pi / 2
    low, high = _extents(lines, across)
    offset = np.sort(((low + high) / 2)[row.members])
    offset = np.concatenate([[offset[0] - row.spacing], offset, [offset[-1] + row.spacing]])
    place = np.searchsorted(offset, low).clip(1, len(offset) - 1)
    off = np.minimum(np.abs(low - offset[place]), np.abs(low - offset[place - 1])) + high - low
    turn = np.abs(_turn(lines.angle, row.direction))
    is_long = vector_length(*(lines.end - lines.start).T) >= row.spacing
    is_piece = is_long & (turn <= _PARALLEL) & (off <= _EXACT * row.spacing)
    is_margin = (np.pi / 2 - turn <= _PARALLEL) & (low <= offset[1]) & (high >= offset[-2])
    is_piece[row.members] = True
    return np.flatnonzero(is_piece | is_margin)


def _goes_beyond(lines: _Lines, direction: float, others: Floats, least: float) -> bool:
    """Whether most lines of one direction go beyond other points (k, 2) at both ends."""
    low, high = _extents(lines, direction)
    along = _project(others, direction)
    beyond = (low <= along.min() - least) & (high >= along.max() + least)
    return bool(beyond.mean() >= _MOSTLY)


def _turn(angle: Floats, direction: float) -> Floats:
    """The angles from a direction to lines, in [-pi / 2, pi / 2)."""
    return (angle - direction + np.pi / 2) % np.pi - np.pi / 2


def _extents(lines: _Lines, direction: float) -> tuple[Floats, Floats]:
    """Where lines start and end along a direction, (n,) each."""
    ends = np.stack([_project(lines.start, direction), _project(lines.end, direction)])
    return ends.min(axis=0), ends.max(axis=0)


def _project(points: Floats, direction: float) -> Floats:
    along: Floats = points @ np.array([np.cos(direction), np.sin(direction)])
    return along
