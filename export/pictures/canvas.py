"""Marks and sheets with matplotlib, for PNG and PDF."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import numpy as np

from .marks import Area, Dots, Lines, Mark, Sheet
from .underlay import ink_colours

_SIDE: Final = 400.0  # points of the longer side of the page


def draw_sheet(sheet: Sheet) -> Any:
    """A matplotlib figure that is the page of the layers, to its edges."""
    from matplotlib.figure import Figure

    x, y, width, height = sheet.page
    scale = _SIDE / max(width, height)
    figure = Figure(figsize=(scale * width / 72, scale * height / 72), facecolor="white")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    set_coordinates(axes, x, y, width, height)
    if sheet.drawing is not None and sheet.drawing.ink is not None:
        (high, wide), side = sheet.drawing.ink.shape, sheet.drawing.scale
        draw_smooth_image(axes, ink_colours()[sheet.drawing.ink], (0.0, side * wide, side * high, 0.0))
    for layer in sheet.layers:
        if layer.shown:
            paint(axes, layer.parts, scale, layer.opacity)
    return figure


def set_coordinates(axes: Any, x: float, y: float, width: float, height: float) -> None:
    """Give axes the coordinates of a picture, y down, without frame and ticks."""
    axes.set_xlim(x, x + width)
    axes.set_ylim(y + height, y)
    axes.set_axis_off()
    axes.set_autoscale_on(False)


def paint(
    axes: Any, marks: Iterable[Mark], scale: float = 1.0, opacity: float = 1.0, *, snap: bool = False
) -> None:
    """Draw lines, dots and areas in the coordinates of the axes.

    scale: points per unit of the axes. snap: move lines to whole pixels of a bitmap, for upright ones.
    """
    for mark in marks:
        if isinstance(mark, Lines):
            _paint_lines(axes, mark, scale, opacity, snap=snap)
        elif isinstance(mark, Dots):
            axes.scatter(
                *mark.centres.T,
                s=(2 * scale * mark.radii) ** 2,
                c=mark.colour,
                edgecolors="white",
                linewidths=scale * mark.rim,
                zorder=3,
                clip_on=False,
            )
        elif isinstance(mark, Area):
            _paint_area(axes, mark)


def draw_smooth_image(axes: Any, image: Any, extent: tuple[float, float, float, float]) -> None:
    """Draw colours with opacity (h, w, 4), smooth at any size. extent: left, right, bottom, top."""
    axes.imshow(image, extent=extent, aspect="auto", interpolation="hanning", interpolation_stage="rgba")


def _paint_lines(axes: Any, part: Lines, scale: float, opacity: float, *, snap: bool) -> None:
    from matplotlib.path import Path

    vertices, codes = [], []
    for line in part.lines:
        vertices += [line[0, :1], line[:, 1:].reshape(-1, 2)]
        curve = Path.LINETO if line.shape[1] == 2 else Path.CURVE4
        codes += [np.array([Path.MOVETO]), np.full(len(vertices[-1]), curve)]
    if codes:
        _add_path(
            axes, Path(np.concatenate(vertices), np.concatenate(codes)), fill=False, edgecolor=part.colour,
            linewidth=scale * part.width, alpha=opacity * part.opacity, capstyle="round",
            joinstyle="round", snap=snap,
        )  # fmt: skip


def _paint_area(axes: Any, part: Area) -> None:
    from matplotlib.path import Path

    corners = part.boxes[:, [[0, 1], [2, 1], [2, 3], [0, 3], [0, 1]]].reshape(-1, 2)
    codes = np.tile([Path.MOVETO, *[Path.LINETO] * 3, Path.CLOSEPOLY], len(part.boxes))
    if len(corners):
        _add_path(
            axes, Path(corners, codes), facecolor=part.colour, linewidth=0, alpha=part.opacity, zorder=0.5
        )


def _add_path(axes: Any, path: Any, **style: Any) -> None:
    from matplotlib.patches import PathPatch

    # Unlike `add_patch`, it does not compute limits of the axes, which are fixed.
    axes.add_artist(PathPatch(path, clip_on=False, **style))
