"""A field as layers in the coordinates of its drawing, so that it fits on top of it.

Lengths are in units of the drawing, y down; widths and distances follow the longer side of the grid, so that
fields of 24 and of 96 pixels look alike. Streamlines are smooth curves, with few nodes each.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from ...models.field.field import CrossField
from ...models.instance.domain import Floats
from ...models.instance.instance import Instance
from ...models.sketch.cover import Box
from ...models.sketch.curves import lines_as_cubics
from ..shading.raster import border_width
from .marks import FAMILIES, GridFrame, ImageMark, Layer, Lines, Sheet, split_runs
from .streamlines import streamlines
from .underlay import INK, Underlay

UNITS: Final = 400.0  # parts of the longer side of the grid in which the lengths below are given
_SPACING: Final = 7.6  # of streamlines of one family
_LINE: Final = 0.95
_CROSS: Final = 0.7
_BELOW: Final = 1.7  # strokes under a field
_DOT: Final = 3.2
_TOLERANCE: Final = 0.12  # of a smooth curve
_LEAST: Final = 5.0  # length of a streamline
_MUCH: Final = 12.0  # sides of the grid that strokes are long before they are drawn thinner
_BLUR: Final = 1.0  # pixels by which the stairs of the mask are smoothed
_BORDER: Final = 0.5  # of the blurred mask at a straight border
_DRAWN_BORDER: Final = 0.15  # more where strokes are the border: they run through the middle of its pixels
_MOST_CROSSES: Final = 64  # along a side; of more, one in several


def field_sheet(field: CrossField, drawing: Underlay | None = None) -> Sheet:
    """The layers of a field, over its drawing if given; crosses are hidden at first."""
    frame, unit = _frame_and_unit(field.instance)
    every = int(np.ceil(max(field.instance.mask.shape) / _MOST_CROSSES))
    layers = (
        *(() if drawing is None else (_drawing_layer(drawing, unit),)),
        Layer("strokes", _stroke_lines(frame, unit), shown=drawing is None, opacity=0.45),
        Layer("crosses", tuple(frame.crosses(field, _CROSS * unit, every)), shown=False),
        *_streamline_layers(field, frame, unit),
        Layer("singularities", tuple(frame.singularities(field, _DOT * unit))),
    )
    return (
        Sheet(page_of(field.instance), layers)
        if drawing is None
        else Sheet(drawing.page, layers, drawing.size)
    )


def strokes_sheet(instance: Instance, page: Box, drawing: Underlay | None = None) -> Sheet:
    """The strokes of the drawing, or of the instance, on a page that is moved to the origin.

    Renderers compute in single precision, too coarse for a page far away.
    """
    x, y, wide, high = page
    frame, unit = _frame_and_unit(instance)
    if drawing is None:
        moved = replace(frame, corner=(frame.corner[0] - x, frame.corner[1] - y))
        layer = Layer("strokes", _stroke_lines(moved, unit))
    else:
        layer = _drawing_layer(drawing, unit, (x, y))
    return Sheet((0.0, 0.0, wide, high), (layer,))


def page_of(instance: Instance) -> Box:
    """The page without a drawing: from zero, or from a mask beyond zero, to the far sides of the mask."""
    inside, size = np.argwhere(instance.mask)[:, ::-1], instance.pixel_size
    low, high = (
        np.array(instance.origin) + size * end for end in (inside.min(axis=0), inside.max(axis=0) + 1)
    )
    if (low >= -size).all():
        low = np.zeros(2)
    (x, y), (width, height) = low.tolist(), (high - low).tolist()
    return x, y, width, height


def _frame_and_unit(instance: Instance) -> tuple[GridFrame, float]:
    """The coordinates of the drawing, and the length of a unit of the pictures in them."""
    frame = GridFrame(instance, instance.origin, instance.pixel_size)
    return frame, float(instance.pixel_size * max(instance.mask.shape) / UNITS)


def _drawing_layer(drawing: Underlay, unit: float, origin: tuple[float, float] = (0.0, 0.0)) -> Layer:
    """The ink of a drawing, or its curves with a line width; many over each other are thinner."""
    if drawing.ink is not None:
        high, wide = (drawing.scale * side for side in drawing.ink.shape[:2])
        return Layer("drawing", (ImageMark((-origin[0], -origin[1], wide, high), drawing.ink),))
    every = [piece for curves in drawing.curves.values() for piece in curves]
    length = sum(float(np.linalg.norm(np.diff(line, axis=1), axis=-1).sum()) for line in every)
    width = _BELOW * unit / np.sqrt(max(length / (_MUCH * UNITS * unit), 1.0))
    lines = (
        Lines(INK[name], width, [curve - origin for curve in curves])
        for name, curves in drawing.curves.items()
        if curves
    )
    return Layer("drawing", tuple(lines))


def _stroke_lines(frame: GridFrame, unit: float) -> tuple[Lines, ...]:
    return tuple(frame.strokes(INK["black"], _BELOW * unit))


def _streamline_layers(field: CrossField, frame: GridFrame, unit: float) -> list[Layer]:
    """Evenly spaced lines, a layer for each family; u is above."""
    from scipy import ndimage

    scale = max(field.instance.mask.shape) / UNITS
    lines_of_field = streamlines(field, _SPACING * scale)
    blurred = ndimage.gaussian_filter(np.pad(field.instance.mask, 1).astype(np.float64), _BLUR)
    depth = blurred - _BORDER - _DRAWN_BORDER * border_width(field.instance)
    layers = []
    for family, name in ((1, "streamlines-v"), (0, "streamlines-u")):
        inside = [
            part
            for line in lines_of_field
            for run in split_runs(line, family)
            for part in cut_at_border(run, depth)
        ]
        smooth = [fit_cubics(part, _TOLERANCE * scale) for part in inside if _length(part) >= _LEAST * scale]
        lines = Lines(FAMILIES[family], _LINE * unit, list(map(frame.at, smooth)), single=True)
        layers.append(Layer(name, (lines,)))
    return layers


def cut_at_border(line: Floats, depth: Floats) -> list[Floats]:
    """The parts of a line (k, 2), y up, where the depth is positive: they end on a smooth border."""
    from scipy import ndimage

    at = ndimage.map_coordinates(depth, [1 - line[:, 1], 1 + line[:, 0]], order=1, mode="nearest")
    cut = np.flatnonzero((at[1:] > 0) != (at[:-1] > 0))
    share = (at[cut] / (at[cut] - at[cut + 1]))[:, None]
    ends = line[cut] + share * (line[cut + 1] - line[cut])
    points = np.insert(line, np.repeat(cut + 1, 2), np.repeat(ends, 2, axis=0), axis=0)
    parts = np.split(points, cut + 1 + 2 * np.arange(len(cut)) + 1)
    return parts[0 if at[0] > 0 else 1 :: 2]


def fit_cubics(points: Floats, tolerance: float) -> Floats:
    """Control points (m, 4, 2) of smooth cubics, end to end, that pass points (k, 2) within the tolerance.

    They are a smoothing spline, periodic for a closed line, that begins and ends at the first and last point.
    """
    from scipy.interpolate import BPoly, PPoly, splev, splprep

    points = points[np.concatenate([[True], (np.diff(points, axis=0) != 0).any(axis=1)])]
    if len(points) < 3:  # no bend
        return lines_as_cubics(points[:-1], points[1:])
    if len(points) == 3:  # a cubic spline needs more
        points = np.insert(points, [1, 2], (points[1:] + points[:-1]) / 2, axis=0)
    weights = np.ones(len(points))
    weights[[0, -1]] = 1e3
    closed = bool((points[0] == points[-1]).all())
    smoothing = len(points) * (tolerance / 2) ** 2
    while True:
        (spline, along), *_ = splprep(points.T, w=weights, s=smoothing, per=closed, full_output=True)
        off = np.linalg.norm(np.transpose(splev(along, spline)) - points, axis=1)
        if off.max() <= tolerance:
            break
        smoothing /= 4
    knots, coordinates, degree = spline
    pieces = [
        BPoly.from_power_basis(PPoly.from_spline((knots, values, degree))).c.T for values in coordinates
    ]
    curves: Floats = np.stack(pieces, axis=-1)[np.diff(knots) > 0]
    curves[0, 1] += points[0] - curves[0, 0]
    curves[-1, 2] += points[-1] - curves[-1, 3]
    curves[:, 0] = np.concatenate([points[:1], curves[:-1, 3]])
    curves[-1, 3] = points[-1]
    return curves


def _length(line: Floats) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
