"""Smooth curves through dense points: cubic Beziers that join without a corner.

After P. J. Schneider, An algorithm for automatically fitting digitized curves (Graphics Gems, 1990): least
squares for the lengths of the two arms, parameters improved by Newton's method, a cut where the misfit is
greatest. A line of hundreds of points becomes a few curves that a drawing program can edit.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from ...models.instance.grid import Floats
from ...models.sketch.curves import lines_as_cubics

_ROUNDS: Final = 3  # of improved parameters before a piece is cut
_SHORTEST_ARM: Final = 0.05  # of the chord: shorter ones make a corner of a bend


def fitted(points: Floats, tolerance: float) -> Floats:
    """Control points (m, 4, 2) of cubics, end to end, that pass points (k, 2) within the tolerance."""
    apart = np.concatenate([[True], (np.diff(points, axis=0) != 0).any(axis=1)])
    points = points[apart]
    if len(points) < 3:  # no bend
        return lines_as_cubics(points[:-1], points[1:])
    tangents = _tangents(points)
    pieces: dict[int, Floats] = {}
    open_pieces = [(0, len(points) - 1)]
    while open_pieces:
        first, last = open_pieces.pop()
        piece, cut = _piece(points[first : last + 1], tangents[first], tangents[last], tolerance)
        if cut:
            open_pieces += [(first, first + cut), (first + cut, last)]
        else:
            pieces[first] = piece
    return np.stack([pieces[first] for first in sorted(pieces)])


def _tangents(points: Floats) -> Floats:
    """Unit tangents (k, 2): those of parabolas through three points, on closed lines across the end."""
    closed = bool((points[0] == points[-1]).all())
    around = np.concatenate([points[-2:-1], points, points[1:2]]) if closed else points
    tangents = np.gradient(around, _along(around), axis=0, edge_order=2)[int(closed) :][: len(points)]
    unit: Floats = tangents / np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), 1e-12)
    return unit


def _along(points: Floats) -> Floats:
    """Length of the way to each point (k,)."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def _piece(points: Floats, start: Floats, end: Floats, tolerance: float) -> tuple[Floats, int]:
    """The cubic (4, 2) of some points with these end tangents, and where to cut it, 0 where it fits."""
    t = _along(points)
    t /= t[-1]
    for _ in range(_ROUNDS):
        cubic = _least_squares(points, t, start, end)
        off = np.linalg.norm(_at(cubic, t) - points, axis=1)
        if off.max() <= tolerance or len(points) == 2:
            return cubic, 0
        t = _nearer(cubic, points, t)
    return cubic, int(np.clip(np.argmax(off), 1, len(points) - 2))


def _least_squares(points: Floats, t: Floats, start: Floats, end: Floats) -> Floats:
    """The cubic (4, 2) with ends and end tangents given whose values at t are nearest to the points."""
    first, last = points[0], points[-1]
    weights = _weights(t)
    arms = np.stack([weights[1][:, None] * start, -weights[2][:, None] * end], axis=-1).reshape(-1, 2)
    rest = points - (weights[0] + weights[1])[:, None] * first - (weights[2] + weights[3])[:, None] * last
    lengths = np.linalg.lstsq(arms, rest.ravel(), rcond=None)[0]
    chord = float(np.linalg.norm(last - first))
    if lengths.min() < _SHORTEST_ARM * chord or lengths.max() > 3 * chord:
        lengths = np.full(2, chord / 3)
    return np.stack([first, first + lengths[0] * start, last - lengths[1] * end, last])


def _nearer(cubic: Floats, points: Floats, t: Floats) -> Floats:
    """Parameters of the places on the curve nearest to the points, improved by a step of Newton's method."""
    velocity, acceleration = 3 * np.diff(cubic, axis=0), 6 * np.diff(cubic, n=2, axis=0)
    off = _at(cubic, t) - points
    back = 1 - t
    speed = np.stack([back**2, 2 * back * t, t**2], axis=1) @ velocity
    change = np.stack([back, t], axis=1) @ acceleration
    slope = np.sum(speed * speed + off * change, axis=1)
    step = np.sum(off * speed, axis=1) / np.where(slope > 0, slope, np.inf)
    return np.maximum.accumulate(np.clip(t - step, 0.0, 1.0))


def _weights(t: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    back = 1 - t
    return back**3, 3 * back**2 * t, 3 * back * t**2, t**3


def _at(cubic: Floats, t: Floats) -> Floats:
    at: Floats = np.stack(_weights(t), axis=1) @ cubic
    return at
