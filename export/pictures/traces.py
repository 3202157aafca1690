"""A plot of bounds and objectives over time, in the reader's light or dark mode; same input, same bytes."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import cycle
from typing import Final

import numpy as np

from .marks import Lines, Mark, Text, segments, straight
from .web import EDGE, GRID, HUES, picture, wide

Point = tuple[float, float]

_WIDTH: Final = 300.0  # of the plot itself
_HEIGHT: Final = 180.0
_ABOVE: Final = 10.0  # margins
_BELOW: Final = 34.0
_RIGHT: Final = 14.0
_LEGEND: Final = 16.0  # of a line of the legend
_LEAST: Final = 4.0  # length of a line, so that a single point is seen
_TICKS: Final = 4
_PEN: Final = 1.6


@dataclass(frozen=True)
class Curve:
    """Bounds and best objectives of one solver, each as (seconds, value), in order of time."""

    name: str
    bounds: tuple[Point, ...]
    objectives: tuple[Point, ...]

    @property
    def end(self) -> float:
        """Seconds of the last bound or objective."""
        return max(seconds for seconds, _ in (*self.bounds, *self.objectives))


def curve(name: str, trace: Iterable[Iterable[float | None]]) -> Curve:
    """The curve of a trace, whose lines are seconds, bound and objective, or None."""
    rows = np.array([tuple(row) for row in trace], dtype=np.float64).reshape(-1, 3)
    bounds, objectives = (rows[:, [0, value]] for value in (1, 2))
    points = [pairs[np.isfinite(pairs).all(axis=1)].tolist() for pairs in (bounds, objectives)]
    return Curve(name, *(tuple((x, y) for x, y in pairs) for pairs in points))


def trace_picture(curves: list[Curve]) -> bytes:
    """The plot of curves with a point at least: bounds as lines, objectives dashed, a hue for each solver."""
    seconds, values = _axis([0.0, *(each.end for each in curves)]), _axis(_worth(curves))
    marks = _scales(seconds, values)

    def line(colour: str, points: tuple[Point, ...], end: float, *, dashed: bool) -> Lines:
        """Steps: a value holds until the next one, the last to the end of the run."""
        x = _WIDTH * np.array([*(_at(x, seconds) for x, _ in points), _at(end, seconds)])
        y = _HEIGHT * (1 - np.array([_at(y, values) for _, y in points]))
        x[-1] = max(x[-1], x[0] + _LEAST)
        steps = np.stack([np.repeat(x, 2)[1:-1], np.repeat(y, 2)], axis=1)
        return Lines(colour, _PEN, [straight(steps)], dashed=dashed)

    for place, (each, hue) in enumerate(zip(curves, cycle(HUES), strict=False)):
        for points, dashed in ((each.bounds, False), (each.objectives, True)):
            if points:
                marks.append(line(hue, points, each.end, dashed=dashed))
        y = _HEIGHT + _BELOW + _LEGEND * (place + 0.3)
        marks += [Lines(hue, _PEN, segments([(0, y, 22, y)])), Text(each.name, 30, y + 3.5)]
    bottom = _HEIGHT + _BELOW + _LEGEND * len(curves)
    left = 8 + max(wide(_written(tick)) for tick in values)
    return picture(-left, -_ABOVE, _WIDTH + _RIGHT, bottom, marks)


def _worth(curves: list[Curve]) -> list[float]:
    """The values, cut to a range around the last ones: the first may be larger by powers of ten."""
    values = [y for each in curves for _, y in (*each.bounds, *each.objectives)]
    last = [points[-1][1] for each in curves for points in (each.bounds, each.objectives) if points]
    low, high = min(last), max(last)
    room = 2 * max(high - low, 0.5 * max(abs(low), abs(high)))
    return [min(max(value, low - room), high + room) for value in values]


def _axis(values: list[float]) -> list[float]:
    """Round ticks of a scale that holds all values."""
    low, high = min(values), max(values)
    if high - low <= 1e-9 * max(1.0, abs(high)):
        low, high = low - 0.5 * max(abs(low), 1e-3), high + 0.5 * max(abs(high), 1e-3)
    raw = (high - low) / _TICKS
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(each * power for each in (1, 2, 5, 10) if each * power >= raw * (1 - 1e-9))
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return [place * step for place in range(first, last + 1)]


def _at(value: float, ticks: list[float]) -> float:
    """The place of a value on a scale, from 0 to 1; one beyond it lies at its end."""
    return min(max((value - ticks[0]) / (ticks[-1] - ticks[0]), 0.0), 1.0)


def _scales(seconds: list[float], values: list[float]) -> list[Mark]:
    """Grid, ticks and their numbers, and the keys of both kinds of lines."""
    heights = [(_HEIGHT * (1 - _at(tick, values)), tick) for tick in values]
    places = [(_WIDTH * _at(tick, seconds), tick) for tick in seconds]
    grid = [(0.0, y, _WIDTH, y) for y, _ in heights] + [(x, 0.0, x, _HEIGHT) for x, _ in places]
    corner = straight(np.array([(0.0, 0.0), (0.0, _HEIGHT), (_WIDTH, _HEIGHT)]))
    return [
        Lines(GRID, 0.8, segments(grid)),
        Lines(EDGE, 0.8, [corner]),
        *(Text(_written(tick), -6, y + 3.5, "end") for y, tick in heights),
        *(Text(_written(tick), x, _HEIGHT + 14, "middle") for x, tick in places),
        Text("seconds", _WIDTH, _HEIGHT + 27, "end"),
        Text("line: bound, dashed: objective", 0, _HEIGHT + 27),
    ]


def _written(value: float) -> str:
    return f"{value + 0.0:.6g}".replace("-", "\N{MINUS SIGN}")
