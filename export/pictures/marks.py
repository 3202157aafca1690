"""Marks of a picture (lines, dots, areas, images, words), and those of an instance and its field."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from ...models.field.field import CrossField
from ...models.instance.domain import Bools, Floats
from ...models.instance.instance import Instance
from ...models.sketch.cover import Box
from .palette import LIGHT
from .streamlines import Streamline, align_labels, streamlines

FAMILIES: Final = (LIGHT["u"], LIGHT["v"])
POSITIVE, NEGATIVE, STROKE = LIGHT["plus"], LIGHT["minus"], LIGHT["stroke"]
FAINT: Final = "#c9c9c9"
BORDER: Final = "#9a9a9a"
PAPER: Final = "#ffffff"

_LEVELS: Final = 5  # shades of strokes by their reliability
_CROWD: Final = 16.0  # root of the number of dots from which on they are drawn smaller


@dataclass(frozen=True, eq=False)
class Lines:
    """Lines of one colour and width: each (m, 4, 2) cubics or (m, 2, 2) straight pieces, end to end.

    single: whether each line is an object of its own for a designer.
    """

    colour: str
    width: float
    lines: list[Floats]
    single: bool = False
    opacity: float = 1.0


@dataclass(frozen=True, eq=False)
class Dots:
    """Discs of one colour with a white rim: centres (k, 2) and radii (k,)."""

    colour: str
    centres: Floats
    radii: Floats
    rim: float


@dataclass(frozen=True, eq=False)
class Area:
    """Filled boxes of one colour: left, top, right, bottom, shape (k, 4)."""

    colour: str
    boxes: Floats
    opacity: float = 1.0


@dataclass(frozen=True, eq=False)
class Polygons:
    """Polygons (k, 2), the lowest first, each with the colours of its inside and its rim (or "none")."""

    shapes: list[Floats]
    colours: list[tuple[str, str]]
    rim: float


@dataclass(frozen=True, eq=False)
class ImageMark:
    """An image in a box x, y, width, height: red, green, blue and opacity, (h, w, 4)."""

    box: Box
    colours: NDArray[np.uint8]


@dataclass(frozen=True)
class TextMark:
    """A line of text, its place (x, y) on its base line, at its start or in its middle, and its height."""

    text: str
    place: tuple[float, float]
    size: float
    colour: str = "#444444"
    anchor: Literal["start", "middle"] = "middle"


Mark = Lines | Dots | Area | Polygons | ImageMark | TextMark


@dataclass(frozen=True, eq=False)
class Layer:
    """A named layer; one without a name is no group of its own. shown: whether it is visible at first."""

    name: str
    parts: tuple[Mark, ...]
    shown: bool = True
    opacity: float = 1.0


@dataclass(frozen=True, eq=False)
class Sheet:
    """Layers on a page (x, y, width, height), the lowest first; size: width and height with their units."""

    page: Box
    layers: tuple[Layer, ...]
    size: tuple[str, str] | None = None


@dataclass(frozen=True)
class GridFrame:
    """Coordinates of a picture, y down: where the grid's top left corner is, and the side of a pixel."""

    instance: Instance
    corner: tuple[float, float]
    pixel: float

    def at(self, points: Floats) -> Floats:
        """Points (..., 2) of the field's plane, y up and pixel centres at whole numbers, on the picture."""
        inside: Floats = points * np.array([1.0, -1.0]) + 0.5
        return np.array(self.corner) + self.pixel * inside

    def strokes(self, colour: str, width: float, opacity: float = 1.0) -> list[Lines]:
        """A piece of line at each pixel that has a direction, the more opaque the more reliable."""
        instance = self.instance
        row, column = instance.stroke_pixels.T
        arm = 0.5 * np.stack([np.cos(instance.theta), np.sin(instance.theta)], axis=1)
        pieces = self._pieces(np.stack([column, -row], axis=1), arm)
        level = np.ceil(_LEVELS * instance.w).astype(int)
        return [
            Lines(
                colour, width, list(pieces[level == grade]), opacity=opacity * (0.2 + 0.8 * grade / _LEVELS)
            )
            for grade in np.unique(level).tolist()
        ]

    def crosses(self, field: CrossField, width: float, every: int = 1) -> list[Lines]:
        """A cross on each pixel, or on one in several in both directions; u and v keep their colours."""
        field = align_labels(field)
        grid = field.instance.grid
        chosen = (grid.rows % every == every // 2) & (grid.columns % every == every // 2)
        centre = np.stack([grid.columns, -grid.rows], axis=1)[chosen]
        return [
            Lines(colour, width, list(self._pieces(centre, 0.42 * every * vectors[chosen])))
            for vectors, colour in zip((field.u, field.v), FAMILIES, strict=True)
        ]

    def streamlines(self, field: CrossField, width: float, spacing: float) -> list[Lines]:
        """Lines of both families, evenly spaced; lengths in units of the picture."""
        lines = streamlines(field, spacing / self.pixel)
        return [
            Lines(
                colour,
                width,
                [straight_line(self.at(run)) for line in lines for run in split_runs(line, family)],
            )
            for family, colour in enumerate(FAMILIES)
        ]

    def singularities(self, field: CrossField, radius: float) -> list[Dots]:
        """Red (+) and blue (-) dots, larger from an index of 1/2 on, smaller where there are many."""
        singular = field.singularities
        centre = self.at(np.stack([singular.column + 0.5, -singular.row - 0.5], axis=1))
        crowd = float(np.clip(_CROWD / np.sqrt(max(len(singular.index), 1)), 0.4, 1.0))
        radii = np.where(np.abs(singular.index) < 0.5, 1.0, 1.4) * crowd * radius
        return [
            Dots(colour, centre[some], radii[some], 0.25 * crowd * radius)
            for colour, some in ((POSITIVE, singular.index > 0), (NEGATIVE, singular.index < 0))
            if some.any()
        ]

    def sides(self, colour: str, width: float, *, between: bool = False) -> Lines:
        """The outline of the mask along the sides of pixels, or the sides between its pixels."""
        ends = np.array(self.corner) + self.pixel * _sides(np.pad(self.instance.mask, 1), between=between)
        return Lines(colour, width, list(ends[:, None]))

    def area(self, colour: str, chosen: Bools) -> Area:
        """The chosen pixels, bool [height, width]."""
        return Area(colour, cover_by_boxes(chosen) * self.pixel + np.tile(self.corner, 2))

    def _pieces(self, centre: Floats, arm: Floats) -> Floats:
        return self.at(np.stack([centre - arm, centre + arm], axis=1))[:, None]


def straight_line(points: Floats) -> Floats:
    """The pieces (k - 1, 2, 2) of a polyline (k, 2)."""
    return np.stack([points[:-1], points[1:]], axis=1)


def cover_by_boxes(chosen: Bools) -> Floats:
    """The chosen cells of an image as boxes (k, 4): left, top, right, bottom; neighbours in a row are one."""
    row, column = np.nonzero(np.diff(np.pad(chosen, ((0, 0), (1, 1))).astype(np.int8), axis=1))
    return np.stack([column[::2], row[::2], column[1::2], row[::2] + 1], axis=1).astype(np.float64)


def split_runs(line: Streamline, family: int) -> list[Floats]:
    """The stretches of a line on which it belongs to a family; neighbouring stretches share a point."""
    limits = np.concatenate([[0], np.flatnonzero(np.diff(line.families)) + 1, [len(line.points)]])
    stretches = (
        (line.points[first : stop + 1], line.families[first]) for first, stop in pairwise(limits.tolist())
    )
    return [points for points, family_of_run in stretches if family_of_run == family and len(points) > 1]


def _sides(mask: Bools, *, between: bool) -> Floats:
    """Sides of pixels as segments (k, 2, 2), y down: between pixels of the padded mask, or at its border."""
    sides = []
    for pixels, neighbours, step in (
        (mask[1:, :], mask[:-1, :], (1, 0)),
        (mask[:, 1:], mask[:, :-1], (0, 1)),
    ):
        end = np.argwhere(pixels & neighbours if between else pixels != neighbours)[:, ::-1]
        sides.append(np.stack([end - step, end], axis=1))
    return np.concatenate(sides).astype(np.float64)
