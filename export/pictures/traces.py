"""A plot of what solvers came to over time, as SVG in the reader's light or dark mode.

Same input, same bytes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import cycle
from typing import Final

from .scheme import label, number, opening, style

Point = tuple[float, float]

_WIDTH: Final = 300.0  # of the plot itself
_HEIGHT: Final = 180.0
_LEFT: Final = 52.0  # margins
_ABOVE: Final = 10.0
_BELOW: Final = 34.0
_RIGHT: Final = 14.0
_LEGEND: Final = 16.0  # of a line of the legend
_LEAST: Final = 4.0  # length of a line, so that a single point is seen
_TICKS: Final = 4
_HUES: Final = {
    "c0": ("#00798c", "#41b3c5"),
    "c1": ("#b5179e", "#f07be0"),
    "c2": ("#a35c00", "#f0a35e"),
    "c3": ("#2f6b2f", "#7ccf7c"),
    "c4": ("#4361ee", "#8fa2ff"),
    "c5": ("#9b2226", "#ff8a8f"),
}
_STYLE: Final = style(
    _HUES | {"grid": ("#e4e6ea", "#30363d"), "edge": ("#8b929c", "#7d8590"), "name": ("#555e68", "#a3acb6")},
    ("name",),
    "path{fill:none;stroke-width:1.6;stroke-linejoin:round}.grid,.edge{stroke-width:.8}"
    ".upper{stroke-dasharray:4 3}text{font:10.5px system-ui,sans-serif}",
)


@dataclass(frozen=True)
class Curve:
    """What one solver came to: its bounds and its best objectives, each as (seconds, value), in order."""

    name: str
    bounds: tuple[Point, ...]
    objectives: tuple[Point, ...]

    @property
    def end(self) -> float:
        """When the last of them was known."""
        return max(seconds for seconds, _ in (*self.bounds, *self.objectives))


def curve(name: str, trace: Iterable[Iterable[float | None]]) -> Curve:
    """The curve of a trace, whose lines are seconds, bound and objective, None where there is none."""
    rows = [tuple(row) for row in trace]
    return Curve(name, _points((row[0], row[1]) for row in rows), _points((row[0], row[2]) for row in rows))


def _points(pairs: Iterable[tuple[float | None, float | None]]) -> tuple[Point, ...]:
    """The pairs of which both are finite numbers."""
    return tuple(
        (float(x), float(y))
        for x, y in pairs
        if x is not None and y is not None and math.isfinite(x) and math.isfinite(y)
    )


def trace_picture(curves: list[Curve]) -> bytes:
    """The plot of curves with a point at least: bounds as lines, objectives dashed, a hue for each solver."""
    points = [point for each in curves for point in (*each.bounds, *each.objectives)]
    seconds, values = _axis([0.0, *(x for x, _ in points)]), _axis(_worth(curves))
    down = _HEIGHT + _ABOVE + _BELOW

    def line(points: tuple[Point, ...], end: float) -> str:
        """Steps: what is known stays until it is replaced, and to the end of the run."""
        places = [(_at(x, seconds) * _WIDTH, _HEIGHT * (1 - _at(y, values))) for x, y in points]
        steps = "".join(f"H{number(x)}V{number(y)}" for x, y in places[1:])
        last = max(_at(end, seconds) * _WIDTH, places[0][0] + _LEAST)
        return f"M{number(places[0][0])} {number(places[0][1])}{steps}H{number(last)}"

    parts = [
        opening(-_LEFT, -_ABOVE, _WIDTH + _LEFT + _RIGHT, down + _LEGEND * len(curves)),
        _STYLE,
        *_scales(seconds, values),
    ]
    for place, (each, hue) in enumerate(zip(curves, cycle(_HUES), strict=False)):
        if each.bounds:
            parts.append(f'<path class="{hue}" d="{line(each.bounds, each.end)}"/>')
        if each.objectives:
            parts.append(f'<path class="{hue} upper" d="{line(each.objectives, each.end)}"/>')
        y = _HEIGHT + _BELOW + _LEGEND * (place + 0.3)
        parts += [f'<path class="{hue}" d="M0 {number(y)}h22"/>', label(30, y + 3.5, each.name)]
    return "\n".join([*parts, "</svg>", ""]).encode()


def _worth(curves: list[Curve]) -> list[float]:
    """The values, cut to what lies round those at the ends: first ones may be larger by powers of ten."""
    values = [y for each in curves for _, y in (*each.bounds, *each.objectives)]
    last = [points[-1][1] for each in curves for points in (each.bounds, each.objectives) if points]
    low, high = min(last), max(last)
    room = 2 * max(high - low, 0.5 * max(abs(low), abs(high)))
    return [min(max(value, low - room), high + room) for value in values]


@dataclass(frozen=True)
class _Axis:
    """A scale from the first tick to the last."""

    ticks: tuple[float, ...]


def _axis(values: list[float]) -> _Axis:
    """A scale with round ticks that holds all values."""
    low, high = min(values), max(values)
    if high - low <= 1e-9 * max(1.0, abs(high)):
        low, high = low - 0.5 * max(abs(low), 1e-3), high + 0.5 * max(abs(high), 1e-3)
    raw = (high - low) / _TICKS
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(each * power for each in (1, 2, 5, 10) if each * power >= raw * (1 - 1e-9))
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return _Axis(tuple(number * step for number in range(first, last + 1)))


def _at(value: float, axis: _Axis) -> float:
    """Where a value lies on a scale, from 0 to 1; one beyond it lies at its end."""
    return min(max((value - axis.ticks[0]) / (axis.ticks[-1] - axis.ticks[0]), 0.0), 1.0)


def _scales(seconds: _Axis, values: _Axis) -> list[str]:
    """Grid, ticks and their numbers."""
    heights = [(_HEIGHT * (1 - _at(tick, values)), tick) for tick in values.ticks]
    places = [(_WIDTH * _at(tick, seconds), tick) for tick in seconds.ticks]
    grid = [f"M0 {number(y)}H{_WIDTH:g}" for y, _ in heights]
    grid += [f"M{number(x)} 0V{_HEIGHT:g}" for x, _ in places]
    return [
        f'<path class="grid" d="{"".join(grid)}"/>',
        f'<path class="edge" d="M0 0V{_HEIGHT:g}H{_WIDTH:g}"/>',
        *(label(-6, y + 3.5, _told(tick), anchor="end") for y, tick in heights),
        *(label(x, _HEIGHT + 14, _told(tick), anchor="middle") for x, tick in places),
        label(_WIDTH, _HEIGHT + 27, "seconds", anchor="end"),
    ]


def _told(value: float) -> str:
    return f"{value + 0.0:.6g}".replace("-", "\N{MINUS SIGN}")
