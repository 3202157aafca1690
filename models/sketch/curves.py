"""Curves of a vector sketch: cubic Beziers, and their flattening into straight segments."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..input_limits import MAX_SEGMENTS
from ..instance.domain import Bools, Floats, Ints
from .cover import Box, Covers, Frame, box_around, cut_segments

STRAIGHT: Final = 0.99
"""Least chord of a straight line as a share of its length."""
_FLATNESS: Final = 0.02  # of a pixel
_BOX_TOLERANCE: Final = 1e-4  # of the longer side: far below a pixel of any grid that can be solved


@dataclass(frozen=True, eq=False)
class Curves:
    """The strokes of a vector sketch in its own units, x to the right and y **down**.

    points: float (k, 4, 2), control points of cubic Beziers; straight lines have theirs at the thirds.
    curve: int (k,), number of the curve that contains each of them, from 0 in the order of the file.
    red: bool (k,), True where a stroke is drawn in red.
    page: x, y, width and height of the page, or None if the file does not state it.
    chosen: bool (k,), True where a stroke was chosen as a curvature line, or None without a choice.
    notes: what was left out or changed while reading, one line each.
    faint: bool (k,), True where a line is much paler or thinner than the others, or None if no line is.
    """

    points: Floats
    curve: Ints
    red: Bools
    page: Box | None
    chosen: Bools | None = None
    notes: tuple[str, ...] = ()
    faint: Bools | None = None

    @property
    def line(self) -> Bools:
        """Which (k,) are curvature lines: the chosen ones, else red ones among others, else all."""
        if self.chosen is not None:
            return self.chosen
        mixed = self.red.any() and not self.red.all()
        return self.red if mixed else np.ones(len(self.red), dtype=bool)

    @property
    def box(self) -> Box:
        """Left, top, right, bottom of the curves, not of their control points."""
        left, top, right, bottom = box_around(self.points)
        span = max(right - left, bottom - top)
        return box_around(flatten(self.points, _BOX_TOLERANCE * span)[0] if span > 0 else self.points)

    def segments(self, frame: Frame) -> tuple[Floats, Ints, Bools]:
        """Segments (m, 2, 2), the number (m,) of each segment's curve, and which (m,) are curvature lines."""
        segments, owner = flatten(self.points, _FLATNESS * frame.pixel)
        return segments, self.curve[owner], self.line[owner]

    def covers(self, frame: Frame) -> Covers:
        """The covers by curvature lines and by other strokes."""
        segments, curve, line = self.segments(frame)
        pieces, others = cut_segments(segments[line], frame), cut_segments(segments[~line], frame)
        return Covers(pieces.cover(), others.cover(), pixels=pieces.pixels(curve[line]))


def lines_as_cubics(start: Floats, end: Floats) -> Floats:
    """Control points (k, 4, 2) of the straight lines from start (k, 2) to end (k, 2)."""
    thirds = np.arange(4.0).reshape(1, 4, 1) / 3
    return start[:, None] * (1 - thirds) + end[:, None] * thirds


def are_straight(cubics: Floats) -> Bools:
    """Which (k,) of cubics (k, 4, 2) are straight lines with even steps."""
    lines = lines_as_cubics(cubics[:, 0], cubics[:, 3])
    return np.isclose(cubics, lines, rtol=1e-9, atol=0).all(axis=(1, 2))


def run_numbers(points: Floats, shape: Ints) -> Ints:
    """The number (k,), from 0, of the unbroken run of one shape (k,) that contains each cubic (k, 4, 2)."""
    apart = (points[1:, 0] != points[:-1, 3]).any(axis=1) | (np.diff(shape) != 0)
    return np.concatenate([[0], np.cumsum(apart)]).astype(np.int32)


def flatten(points: Floats, tolerance: float) -> tuple[Floats, NDArray[np.intp]]:
    """Segments (m, 2, 2) within `tolerance` of the curves (k, 4, 2), and the curve (m,) of each.

    Raises InputError for more than MAX_SEGMENTS segments.
    """
    # In n equal steps a cubic deviates by at most 3/4 M / n^2, M the longer second difference of its points.
    turns = np.diff(points, n=2, axis=1) ** 2
    bend = np.sqrt(np.maximum(*(turns[:, at, 0] + turns[:, at, 1] for at in (0, 1))))
    steps = np.clip(np.ceil(np.sqrt(0.75 * bend / tolerance)), 1, MAX_SEGMENTS + 1).astype(np.int64)
    if steps.sum() > MAX_SEGMENTS:
        raise InputError(f"has more than {MAX_SEGMENTS} segments; simplify it, or choose a smaller size")
    owner = np.repeat(np.arange(len(points)), steps)
    step = np.arange(len(owner)) - np.repeat(np.cumsum(steps) - steps, steps)
    segments, bent = points[:, [0, 3]][owner], np.flatnonzero(steps[owner] > 1)
    for side in (0, 1):
        at = owner[bent]
        segments[bent, side] = evaluate_cubics(points[at], (step[bent] + side) / steps[at])
    return segments, owner


def cut_cubics(points: Floats, start: Floats, end: Floats) -> Floats:
    """The parts of cubics (k, 4, 2) between two parameters (k,) each; whole ones unchanged."""
    pairs = np.stack([start, end], axis=1)
    # A control point of the part is the polar form at its two parameters, taken 3 - i and i times.
    corners = []
    for ends in range(4):
        level = points
        for step in range(3):
            t = pairs[:, int(step < ends)][:, None, None]
            level = level[:, :-1] * (1 - t) + level[:, 1:] * t
        corners.append(level[:, 0])
    return np.where(((start == 0) & (end == 1))[:, None, None], points, np.stack(corners, axis=1))


def evaluate_cubics(points: Floats, t: Floats) -> Floats:
    """The points (k, 2) of cubics (k, 4, 2) at their parameters t (k,)."""
    t = t[:, None]
    back = 1 - t
    start, first, second, end = points.swapaxes(0, 1)
    at: Floats = (
        back * back * back * start + 3 * back * back * t * first + 3 * back * t * t * second + t * t * t * end
    )
    return at
