"""Strokes on the pixel grid: their cover of each pixel, y down, and its direction, y up."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..input_limits import MAX_PIECES
from ..instance.angles import vector_length
from ..instance.domain import Bools, Floats, Ints
from ..memory import check_memory

Box = tuple[float, float, float, float]
Indices = NDArray[np.intp]
Pixels = NDArray[np.float64] | NDArray[np.float32] | NDArray[np.uint8]

MARGIN: Final = 0.04  # empty border round a drawing, as a share of its longer side; at least one pixel
LEAST_R: Final = 0.5  # least R of a pixel with a direction: |cos d| at an angle d, 0.64 for a bend by 90
LEAST_WEIGHT: Final = 0.1  # stroke pixels with a smaller w have no direction: grazed corners, crossings
CUT: Final = 0.5 - 1e-9  # least length at which another stroke cuts a pixel out; more would leave gaps
_NUDGE: Final = 1e-9  # of a pixel: a line exactly along a pixel edge is shared by both sides


@dataclass(frozen=True)
class Frame:
    """Position of the grid on the sketch: top left (x, y), side of a pixel, rows, columns; y down."""

    x: float
    y: float
    pixel: float
    height: int
    width: int

    @property
    def shape(self) -> tuple[int, int]:
        """Rows, columns."""
        return self.height, self.width

    @property
    def edges(self) -> tuple[Floats, Floats]:
        """Edges of the rows in y, shape (height + 1,), and of the columns in x, shape (width + 1,)."""
        rows: Floats = self.y + np.arange(self.height + 1.0) * self.pixel
        columns: Floats = self.x + np.arange(self.width + 1.0) * self.pixel
        return rows, columns


@dataclass(frozen=True, eq=False)
class Cover:
    """Cover of each pixel by one kind of stroke.

    amount: [height, width], length of stroke in pixel sides. direction: [height, width, 2], mean double-angle
    vector (y up) weighted by length; its length R is 1 for one direction and near 0 at crossings and corners.
    """

    amount: Floats
    direction: Floats

    @property
    def weight(self) -> Floats:
        """Weight [height, width], min(1, amount) R or 0 where R < LEAST_R (docs/mathematics.md, 1)."""
        single = np.minimum(1.0, vector_length(*np.moveaxis(self.direction, -1, 0)))
        return np.where(single >= LEAST_R, np.minimum(1.0, self.amount) * single, 0.0)


@dataclass(frozen=True, eq=False)
class Covers:
    """Covers by curvature lines and by the other strokes, which cut the field.

    stroke_width: typical width of the strokes in pixels, 0 for curves.
    """

    lines: Cover
    others: Cover
    stroke_width: float = 0.0

    @property
    def cuts(self) -> Bools:
        """The pixels [height, width] that strokes cut out of the field."""
        return self.others.amount >= CUT

    @property
    def walls(self) -> Bools:
        """The pixels [height, width] of all strokes, which may bound the field."""
        return (self.lines.amount >= LEAST_WEIGHT) | self.cuts

    @property
    def filled(self) -> Bools:
        """The pixels [height, width] that are covered over half of their side or more."""
        return self.lines.amount + self.others.amount >= CUT


def fit_frame(box: Box, size: int, *, margin: bool) -> Frame:
    """The frame of `size` pixels on its longer side centred on a box (left, top, right, bottom).

    Raises InputError for a point, and for a grid that needs more memory than there is.
    """
    left, top, right, bottom = box
    longer = max(right - left, bottom - top)
    if longer <= 0:
        raise InputError("draws no stroke: everything is one point")
    border = MARGIN if margin else 0.0
    pixel = longer * (1 + 2 * border) / size
    if margin and size > 4:
        pixel = max(pixel, longer / (size - 2))
    border = max(border * longer, pixel if margin and size > 4 else 0.0)
    width, height = (
        min(size, max(1, int(np.ceil((side + 2 * border) / pixel - 1e-6))))
        for side in (right - left, bottom - top)
    )
    check_memory(height * width, "read")
    return Frame(
        (left + right - width * pixel) / 2, (top + bottom - height * pixel) / 2, pixel, height, width
    )


def cover_by_segments(segments: Floats, frame: Frame) -> Cover:
    """The cover by straight segments (m, 2, 2), each cut exactly at the pixel edges. Raises InputError."""
    pieces = _cut_segments(segments, frame)
    unit = pieces.unit
    double = np.stack([np.ones(len(unit)), unit[:, 0] ** 2 - unit[:, 1] ** 2, -2 * unit[:, 0] * unit[:, 1]])
    amount, cosine, sine = np.zeros((3, *frame.shape))
    for nudge in product((-_NUDGE, _NUDGE), repeat=2):
        cell, on_grid = _cells_of_points(pieces.middle + nudge, frame)
        amount, cosine, sine = (
            total + np.bincount(cell, value[on_grid], total.size).reshape(frame.shape)
            for total, value in zip((amount, cosine, sine), pieces.covered / 4 * double, strict=True)
        )
    return Cover(amount, np.stack([cosine, sine], axis=-1) / np.where(amount > 0, amount, 1)[..., None])


def curve_pixels(segments: Floats, curve: Ints, frame: Frame) -> tuple[Indices, Indices, Indices]:
    """Curve, row and column (k,) of each pixel that a curve covers, in the order of the curves.

    curve: int (m,), 0 or more, the curve of each segment (m, 2, 2). A curve covers a pixel over LEAST_WEIGHT
    pixel sides and more; without such a curve the longest one counts.
    """
    pieces = _cut_segments(segments, frame)
    number, size = curve[pieces.segment].astype(np.int64), frame.height * frame.width
    keys, lengths = [], []
    for nudge in product((-_NUDGE, _NUDGE), repeat=2):
        cell, on_grid = _cells_of_points(pieces.middle + nudge, frame)
        keys.append(number[on_grid] * size + cell)
        lengths.append(pieces.covered[on_grid] / 4)
    key, place = np.unique(np.concatenate(keys), return_inverse=True)
    owner, pixel = np.divmod(key, size)
    amount = np.bincount(place, np.concatenate(lengths), len(key))
    most = np.zeros(size)
    np.maximum.at(most, pixel, amount)
    covers = amount >= np.minimum(LEAST_WEIGHT, most[pixel])
    return owner[covers], *np.divmod(pixel[covers], frame.width)


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Segments cut at the pixel edges, in pixels: segment, middle, length and unit vector of each piece."""

    segment: Indices
    middle: Floats
    covered: Floats
    unit: Floats


def _cut_segments(segments: Floats, frame: Frame) -> _Pieces:
    segments, number = _clip_segments((segments - (frame.x, frame.y)) / frame.pixel, frame)
    step = segments[:, 1] - segments[:, 0]
    length = vector_length(*step.T)
    long = length > 0
    segments, step, length, number = segments[long], step[long], length[long], number[long]
    owner, start, end = _piece_ends(segments, step)
    middle = segments[owner, 0] + ((start + end) / 2)[:, None] * step[owner]
    return _Pieces(number[owner], middle, (end - start) * length[owner], (step / length[:, None])[owner])


def _clip_segments(segments: Floats, frame: Frame) -> tuple[Floats, Indices]:
    """The parts of segments (in pixels) that lie on the grid, and their numbers; others are dropped."""
    start, step = segments[:, 0], segments[:, 1] - segments[:, 0]
    limit = np.array([frame.width, frame.height], dtype=float)
    with np.errstate(divide="ignore", invalid="ignore"):
        walls = np.stack([-start / step, (limit - start) / step])
    along = np.where((start >= 0) & (start <= limit), -np.inf, np.inf)  # for a segment along the walls
    low = np.where(step == 0, along, walls.min(axis=0)).max(axis=1).clip(0, None)
    high = np.where(step == 0, -along, walls.max(axis=0)).min(axis=1).clip(None, 1)
    inside = low < high
    start, step, low, high = start[inside], step[inside], low[inside, None], high[inside, None]
    return np.stack([start + low * step, start + high * step], axis=1), np.nonzero(inside)[0]


def _piece_ends(segments: Floats, step: Floats) -> tuple[Indices, Floats, Floats]:
    """Segment number and the parameters of both ends of each piece between pixel edges."""
    count = len(segments)
    low, high = segments.min(axis=1), segments.max(axis=1)
    first = np.floor(low) + 1
    crossings = np.maximum(np.ceil(high) - first, 0).astype(np.int64)
    if count + crossings.sum() > MAX_PIECES:
        raise InputError(f"has more than {MAX_PIECES} pieces of strokes; choose a smaller size")
    owners, cuts = [np.arange(count)], [np.zeros(count)]
    for axis in (0, 1):
        many = crossings[:, axis]
        owner = np.repeat(np.arange(count), many)
        line = first[owner, axis] + np.arange(len(owner)) - np.repeat(np.cumsum(many) - many, many)
        owners.append(owner)
        cuts.append((line - segments[owner, 0, axis]) / step[owner, axis])
    all_owners, all_cuts = np.concatenate(owners), np.concatenate(cuts).clip(0, 1)
    order = np.lexsort((all_cuts, all_owners))
    number, start = all_owners[order], all_cuts[order]
    end = np.ones(len(start))
    end[:-1] = np.where(number[1:] == number[:-1], start[1:], 1.0)
    return number, start, end


def _cells_of_points(points: Floats, frame: Frame) -> tuple[Indices, Bools]:
    """Numbers of the pixels, row by row, at the points (m, 2) on the grid, and which points these are."""
    column, row = np.floor(points).astype(np.int64).T
    on_grid = (row >= 0) & (column >= 0) & (row < frame.height) & (column < frame.width)
    return row[on_grid] * frame.width + column[on_grid], on_grid


def block_means(image: Pixels, rows: Floats, columns: Floats) -> Floats:
    """Area means of a picture [h, w, ...], 0 outside, over cells between fractional row and column edges."""
    means = _strip_means(np.moveaxis(_strip_means(image, rows), 1, 0), columns)
    return np.moveaxis(means, 1, 0)


def _strip_means(image: Pixels, edges: Floats) -> Floats:
    sums = np.concatenate([np.zeros((1, *image.shape[1:])), np.cumsum(image, axis=0, dtype=np.float64)])
    place = np.clip(edges, 0, len(image))
    below = np.minimum(place.astype(np.int64), len(image) - 1)
    part = (place - below).reshape(-1, *[1] * (image.ndim - 1))
    at = sums[below] * (1 - part) + sums[below + 1] * part
    return np.asarray(np.diff(at, axis=0) / np.diff(edges).reshape(-1, *[1] * (image.ndim - 1)))
