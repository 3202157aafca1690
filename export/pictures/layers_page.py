"""The visible layers of a field on one page by matplotlib, for PNG and PDF."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from .drawing import ink_colours
from .layers import Lines, Sheet

_SIDE: Final = 400.0
"""Points of the longer side of the page."""
_TIP: Final = 1e-3  # of a pixel, lest a side is rounded down to the pixel before


def page_of(sheet: Sheet) -> Any:
    """A matplotlib figure that is the page of the layers, to its edges."""
    from matplotlib.figure import Figure

    x, y, width, height = sheet.page
    scale = _SIDE / max(width, height)
    figure = Figure(figsize=(scale * width / 72, scale * height / 72), facecolor="white")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(x, x + width)
    axes.set_ylim(y + height, y)
    axes.set_axis_off()
    axes.set_autoscale_on(False)
    _ink(axes, sheet)
    for layer in sheet.layers:
        for part in layer.parts if layer.shown else ():
            if isinstance(part, Lines):
                _lines(axes, part, scale, layer.opacity)
            else:
                _dots(axes, part, scale)
    return figure


def pixels_of(sheet: Sheet, width: int, height: int) -> NDArray[np.uint8]:
    """Red, green, blue and opacity (height, width, 4) of the layers on a page without paper."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure = page_of(sheet)
    figure.patch.set_visible(False)
    dots = 72 * max(width, height) / _SIDE
    figure.set_dpi(dots)
    figure.set_size_inches((width + _TIP) / dots, (height + _TIP) / dots)
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    return np.array(canvas.buffer_rgba(), dtype=np.uint8)


def _ink(axes: Any, sheet: Sheet) -> None:
    """The ink of a bitmap, smooth at any size."""
    if sheet.drawing is None or sheet.drawing.ink is None:
        return
    ink, side = sheet.drawing.ink, sheet.drawing.scale
    high, wide = ink.shape
    axes.imshow(
        ink_colours()[ink],
        extent=(0.0, side * wide, side * high, 0.0),
        interpolation="hanning",
        interpolation_stage="rgba",
    )
    axes.set_aspect("auto")


def _lines(axes: Any, part: Lines, scale: float, opacity: float) -> None:
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    if not part.lines:
        return
    vertices, codes = [], []
    for line in part.lines:
        vertices += [line[0, :1], line[:, 1:].reshape(-1, 2)]
        curve = Path.LINETO if line.shape[1] == 2 else Path.CURVE4
        codes += [np.array([Path.MOVETO]), np.full(len(vertices[-1]), curve)]
    path = Path(np.concatenate(vertices), np.concatenate(codes))
    axes.add_patch(
        PathPatch(
            path, fill=False, edgecolor=part.colour, linewidth=scale * part.width, alpha=opacity,
            capstyle="round", joinstyle="round", clip_on=False,
        )
    )  # fmt: skip


def _dots(axes: Any, part: Any, scale: float) -> None:
    axes.scatter(
        *part.centres.T,
        s=(2 * scale * part.radii) ** 2,
        c=part.colour,
        edgecolors="white",
        linewidths=scale * part.rim,
        zorder=3,
        clip_on=False,
    )
