"""Strokes on the pixel grid: their cover of each pixel, y down, and its direction, y up."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Final, NamedTuple

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
_AT_ONCE: Final = 1_000_000  # points along segments
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


class CurvePixels(NamedTuple):
    """Curve, row and column (k,) of each pixel that a curve covers, in the order of the curves.

    A curve covers a pixel over LEAST_WEIGHT pixel sides and more; without such a curve, the longest counts.
    """

    curve: Indices
    row: Indices
    column: Indices


@dataclass(frozen=True, eq=False)
class Covers:
    """Covers by curvature lines and by the other strokes, which cut the field.

    stroke_width: typical width of the strokes in pixels, 0 for curves.
    pixels: those of curvature lines, None for the ink of a picture.
    """

    lines: Cover
    others: Cover
    stroke_width: float = 0.0
    pixels: CurvePixels | None = None

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


def box_around(points: Floats) -> Box:
    """Left, top, right and bottom of points (..., 2)."""
    x, y = points[..., 0], points[..., 1]
    return float(x.min()), float(y.min()), float(x.max()), float(y.max())


def fit_frame(box: Box, size: int, *, margin: bool) -> Frame:
    """The frame of `size` pixels on its longer side centred on a box (left, top, right, bottom).

    Raises InputError for a point, and for a grid that needs more memory than there is.
    """
    left, top, right, bottom = box
    longer = max(right - left, bottom - top)
    if longer <= 0:
        raise InputError("draws no stroke: everything is one point")
    share, least = (MARGIN if margin else 0.0), (1 if margin and size > 4 else 0)
    pixel = max(longer * (1 + 2 * share) / size, longer / (size - 2 * least))
    border = max(share * longer, least * pixel)
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
    return cut_segments(segments, frame).cover()


def pixels_along(segments: Floats, frame: Frame) -> Bools:
    """The pixels [height, width] under points along segments (m, 2, 2), at most a row and a column apart.

    Unlike a cover, they leave out pixels whose corners a segment cuts off.
    """
    segments, _ = _clip_segments((segments - (frame.x, frame.y)) / frame.pixel, frame)
    step = segments[:, 1] - segments[:, 0]
    count = np.ceil(np.maximum(*np.abs(step).T)).astype(np.int64) + 1
    step /= np.maximum(count - 1, 1)[:, None]
    pixels = np.zeros(frame.height * frame.width, dtype=bool)
    for part in np.array_split(np.arange(len(segments)), 1 + count.sum() // _AT_ONCE):
        owner, before = np.repeat(part, count[part]), np.cumsum(count[part]) - count[part]
        number = np.arange(len(owner)) - np.repeat(before, count[part])
        points = segments[owner, 0] + number[:, None] * step[owner]
        pixels[_cells_of_points(points, frame)[0]] = True
    return pixels.reshape(frame.shape)


@dataclass(frozen=True, eq=False)
class Pieces:
    """Segments cut at the pixel edges, in pixels: segment, middle, length and unit vector of each piece."""

    frame: Frame
    segment: Indices
    middle: Floats
    covered: Floats
    unit: Floats

    def cover(self) -> Cover:
        """The cover by these pieces."""
        x, y = self.unit.T
        values = self.covered / 4 * np.stack([np.ones(len(x)), x**2 - y**2, -2 * x * y])
        size = self.frame.height * self.frame.width
        sums = np.zeros((3, size))
        for nudge in product((-_NUDGE, _NUDGE), repeat=2):
            cell, on_grid = _cells_of_points(self.middle + nudge, self.frame)
            for number, value in enumerate(values):
                sums[number] += np.bincount(cell, value[on_grid], size)
        amount, cosine, sine = sums.reshape(3, *self.frame.shape)
        direction = np.stack([cosine, sine], axis=-1) / np.where(amount > 0, amount, 1)[..., None]
        return Cover(amount, direction)

    def pixels(self, curve: Ints) -> CurvePixels:
        """The pixels of curves. curve: int (m,), 0 or more, the curve of each segment."""
        number, size = curve[self.segment].astype(np.int64), self.frame.height * self.frame.width
        low, high = (np.floor(self.middle + nudge) for nudge in (-_NUDGE, _NUDGE))
        is_shared = (low[:, 0] != high[:, 0]) | (low[:, 1] != high[:, 1])
        some, share = np.arange(len(number)), np.where(is_shared, self.covered / 4, self.covered)
        keys, lengths = [], []
        for nudge in product((-_NUDGE, _NUDGE), repeat=2):
            cell, on_grid = _cells_of_points(self.middle[some] + nudge, self.frame)
            keys.append(number[some][on_grid] * size + cell)
            lengths.append(share[some][on_grid])
            some = np.flatnonzero(is_shared)  # the others lie in the same pixel with every nudge
        key, place = np.unique(np.concatenate(keys), return_inverse=True)
        owner, pixel = np.divmod(key, size)
        amount = np.bincount(place, np.concatenate(lengths), len(key))
        most = np.zeros(size)
        np.maximum.at(most, pixel, amount)
        covers = amount >= np.minimum(LEAST_WEIGHT, most[pixel])
        return CurvePixels(owner[covers], *np.divmod(pixel[covers], self.frame.width))


def cut_segments(segments: Floats, frame: Frame) -> Pieces:
    """The pieces of straight segments (m, 2, 2) between pixel edges. Raises InputError for too many."""
    segments, number = _clip_segments((segments - (frame.x, frame.y)) / frame.pixel, frame)
    step = segments[:, 1] - segments[:, 0]
    length = vector_length(*step.T)
    long = length > 0
    segments, step, length, number = segments[long], step[long], length[long], number[long]
    owner, start, end = _piece_ends(segments, step)
    middle = segments[owner, 0] + ((start + end) / 2)[:, None] * step[owner]
    unit = (step / length[:, None])[owner]
    return Pieces(frame, number[owner], middle, (end - start) * length[owner], unit)


def _clip_segments(segments: Floats, frame: Frame) -> tuple[Floats, Indices]:
    """The parts of segments (in pixels) that lie on the grid, and their numbers; others are dropped."""
    start, step = segments[:, 0], segments[:, 1] - segments[:, 0]
    limit = np.array([frame.width, frame.height], dtype=float)
    with np.errstate(divide="ignore", invalid="ignore"):
        walls = -start / step, (limit - start) / step
    along = np.where((start >= 0) & (start <= limit), -np.inf, np.inf)  # for a segment along the walls
    low = np.maximum(*np.where(step == 0, along, np.minimum(*walls)).T).clip(0, None)
    high = np.minimum(*np.where(step == 0, -along, np.maximum(*walls)).T).clip(None, 1)
    inside = low < high
    start, step, low, high = start[inside], step[inside], low[inside, None], high[inside, None]
    return np.stack([start + low * step, start + high * step], axis=1), np.nonzero(inside)[0]


def _piece_ends(segments: Floats, step: Floats) -> tuple[Indices, Floats, Floats]:
    """Segment number and the parameters of both ends of each piece between pixel edges."""
    count = len(segments)
    low, high = np.minimum(segments[:, 0], segments[:, 1]), np.maximum(segments[:, 0], segments[:, 1])
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
    order = np.argsort(all_owners, kind="stable")
    several = np.flatnonzero((crossings[:, 0] + crossings[:, 1] > 1)[all_owners[order]])
    few = order[several]
    order[several] = few[np.lexsort((all_cuts[few], all_owners[few]))]
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
