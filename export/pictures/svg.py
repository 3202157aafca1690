"""Pictures of a site as SVG in the reader's light or dark mode; same input, same bytes.

`draw` makes pictures with captions on white paper; a browser wants them bare, scalable and on its own
background. Lines and colours are those of `panels`. The longer side of the mask is 320 units; pixel [row,
column] is the square round (column, row) times the unit, y down.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Final

import numpy as np

from ...models.field.field import CrossField
from ...models.instance.grid import Floats, Ints
from ...models.instance.instance import Instance
from .combing import combed
from .panels import FAMILIES, NEGATIVE, POSITIVE, STROKE, runs, sides
from .scheme import style
from .streamlines import streamlines

SIDE: Final = 320.0
CROSSES_UP_TO: Final = 12
"""Longer side of a grid, in pixels, up to which its crosses are drawn one by one; beyond, streamlines."""

_EDGE: Final = 7.0
_SPACING: Final = 10.0  # between streamlines of one family
_CELLS_FROM: Final = 9.0  # units of a pixel from which on its sides are drawn
_LEVELS: Final = 5  # shades of strokes by their reliability
_COLOURS: Final = {
    "paper": ("#ffffff", "#1d2126"),
    "shade": ("#e1e4e9", "#3a424c"),
    "cells": ("#e4e6ea", "#30363d"),
    "border": ("#8b929c", "#7d8590"),
    "stroke": (STROKE, "#ff7b72"),
    "faint": ("#d3d6db", "#3d444d"),
    "u": (FAMILIES[0], "#41b3c5"),
    "v": (FAMILIES[1], "#f0a35e"),
    "positive": (POSITIVE, "#ff6b70"),
    "negative": (NEGATIVE, "#7c9cff"),
}
"""Of each part: in light mode, in dark mode."""


def instance_picture(instance: Instance) -> bytes:
    """Mask, pixels and strokes: the more reliable a stroke, the stronger its line."""
    sheet = _Sheet(instance)
    return sheet.document(
        [*sheet.ground(), *sheet.strokes("stroke", float(np.clip(0.2 * sheet.unit, 2.0, 6.0)))]
    )


def thumbnail(instance: Instance) -> bytes:
    """Silhouette and strokes with lines that are seen at the height of a line of text."""
    sheet = _Sheet(instance)
    paper, *_ = sheet.ground()
    return sheet.document([paper.replace('"paper"', '"shade"'), *sheet.strokes("stroke", 12.0)])


def field_picture(field: CrossField) -> bytes:
    """Crosses or, of a larger grid, streamlines over faint strokes; singularities red (+) and blue (-)."""
    sheet = _Sheet(field.instance)
    few = max(field.instance.mask.shape) <= CROSSES_UP_TO
    lines = _crosses(sheet, field) if few else _streamlines(sheet, field)
    faint = sheet.strokes("faint", float(np.clip(0.3 * sheet.unit, 2.6, 9.0)))
    return sheet.document([*sheet.ground(), *faint, *lines, *_singularities(sheet, field)])


def told(field: CrossField) -> str:
    """The singularities of a field in words."""
    index = np.round(4 * field.singularities.index).astype(int)
    if not len(index):
        return "no singularities"
    values, counts = (found.tolist() for found in np.unique(-index, return_counts=True))
    if len(values) == 1:
        return f"{len(index)} singularit{'y' if len(index) == 1 else 'ies'} of index {_turns(-values[0])}"
    each = [f"{count} of index {_turns(-value)}" for value, count in zip(values, counts, strict=True)]
    return f"{len(index)} singularities: {', '.join(each)}"


def _turns(quarters: int) -> str:
    return f"{'+' if quarters > 0 else '−'}{Fraction(abs(quarters), 4)}"


@dataclass(frozen=True)
class _Sheet:
    """Where the parts of an instance lie on a picture of it."""

    instance: Instance

    @cached_property
    def unit(self) -> float:
        """Length of a pixel."""
        return SIDE / int(self._frame[1].max())

    @cached_property
    def _frame(self) -> tuple[Ints, Ints]:
        """First column and row of the mask, and its width and height, in pixels."""
        inside = np.argwhere(self.instance.mask)[:, ::-1]
        low = inside.min(axis=0)
        return low, inside.max(axis=0) + 1 - low

    def document(self, parts: Iterable[str]) -> bytes:
        """The picture of these elements."""
        low, sides = self._frame
        left, top, width, height = map(
            _text, _rounded(np.array([[*(low * self.unit - _EDGE), *(sides * self.unit + 2 * _EDGE)]]))[0]
        )
        opening = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{left} {top} {width} {height}" '
            f'width="{width}" height="{height}">'
        )
        return "\n".join([opening, _STYLE, *(part for part in parts if part), "</svg>", ""]).encode()

    def ground(self) -> list[str]:
        """The mask, its pixels where they are large enough, and its outline."""
        mask = np.pad(self.instance.mask, 1)
        rows, columns = np.nonzero(np.diff(mask.astype(np.int8), axis=1))
        starts, stops, row = columns[::2], columns[1::2], rows[::2] - 1
        runs = _moves(
            np.stack([starts, row], axis=1) * self.unit,
            ["h", "v", "h"],
            np.stack([stops - starts, np.ones_like(row), starts - stops], axis=1) * self.unit,
        )
        inside = sides(mask, between=True) if self.unit >= _CELLS_FROM else np.zeros((0, 2, 2))
        return [
            f'<path class="paper" d="{runs}"/>',
            _path("cells", self._segments(inside), 0.8),
            _path("border", self._segments(sides(mask, between=False)), 1.2),
        ]

    def strokes(self, name: str, width: float) -> list[str]:
        """A short segment at each stroke pixel."""
        pixels, theta, w = self.instance.stroke_pixels, self.instance.theta, self.instance.w
        arm = 0.44 * np.stack([np.cos(theta), -np.sin(theta)], axis=1)
        centre = pixels[:, ::-1] + 0.5
        ends = np.stack([centre - arm, centre + arm], axis=1)
        level = np.ceil(w * _LEVELS).astype(int)
        return [
            _path(name, self._segments(ends[level == each]), width, opacity=0.25 + 0.75 * each / _LEVELS)
            for each in np.unique(level).tolist()
        ]

    def _segments(self, ends: Floats) -> str:
        """Path data of straight lines, shape (k, 2, 2), in pixels."""
        return "".join(
            f"M{_text(a)} {_text(b)}L{_text(c)} {_text(d)}"
            for a, b, c, d in _rounded(ends.reshape(-1, 4) * self.unit)
        )

    def place(self, points: Floats) -> Floats:
        """Points (x, y) of the field's plane, y up and centres at whole numbers, as picture pixels."""
        placed: Floats = points * np.array([1.0, -1.0]) + 0.5
        return placed

    def lines(self, name: str, lines: Iterable[Floats], width: float) -> str:
        """Polylines, each (k, 2) in pixels, as one path."""
        return _path(name, "".join(_polyline(_rounded(line * self.unit)) for line in lines), width)


def _crosses(sheet: _Sheet, field: CrossField) -> list[str]:
    """A cross in each pixel, its lines coloured alike from pixel to pixel."""
    field = combed(field)
    grid = field.instance.grid
    centre = np.stack([grid.columns, -grid.rows], axis=1)
    return [
        sheet.lines(
            name,
            sheet.place(np.stack([centre - 0.4 * arm, centre + 0.4 * arm], axis=1)),
            min(0.07 * sheet.unit, 2.6),
        )
        for name, arm in (("u", field.u), ("v", field.v))
    ]


def _streamlines(sheet: _Sheet, field: CrossField) -> list[str]:
    """Evenly spaced lines of both families."""
    found = streamlines(field, _SPACING / sheet.unit)
    return [
        sheet.lines(name, (sheet.place(run) for line in found for run in runs(line, family)), 1.3)
        for family, name in enumerate("uv")
    ]


def _singularities(sheet: _Sheet, field: CrossField) -> list[str]:
    found = field.singularities
    radius = np.where(np.abs(found.index) < 0.5, 4.6, 6.2) * np.clip(
        7 / np.sqrt(max(len(found.index), 1)), 0.45, 1.0
    )
    at = np.stack([found.column + 1.0, found.row + 1.0], axis=1) * sheet.unit
    return [
        f'<circle class="{"positive" if index > 0 else "negative"}" cx="{_text(x)}" cy="{_text(y)}" '
        f'r="{_text(r)}"/>'
        for (x, y), index, r in zip(
            _rounded(at), found.index.tolist(), np.round(radius, 2).tolist(), strict=True
        )
    ]


def _moves(starts: Floats, letters: list[str], lengths: Floats) -> str:
    """Path data that goes from each start along the axes and closes."""
    pairs = zip(_rounded(starts), _rounded(lengths), strict=True)
    return "".join(
        f"M{_text(x)} "
        f"{_text(y)}{''.join(f'{letter}{_text(by)}' for letter, by in zip(letters, steps, strict=True))}z"
        for (x, y), steps in pairs
    )


def _polyline(points: list[list[float]]) -> str:
    return "M" + " ".join(f"{_text(x)} {_text(y)}" for x, y in points)


def _path(name: str, data: str, width: float, *, opacity: float = 1.0) -> str:
    faded = f' opacity="{opacity:.2f}"' if opacity < 1 else ""
    return f'<path class="{name}" stroke-width="{_text(width)}"{faded} d="{data}"/>' if data else ""


def _rounded(values: Floats) -> list[list[float]]:
    rounded: list[list[float]] = (np.round(values, 1) + 0.0).tolist()
    return rounded


def _text(value: float) -> str:
    return f"{value:.4g}" if value else "0"


_STYLE: Final = style(
    _COLOURS,
    ("paper", "shade", "positive", "negative"),
    "path{fill:none;stroke-linecap:round;stroke-linejoin:round}circle{stroke:#fff;stroke-width:1.2}",
    "circle{stroke:#1d2126}",
)
