"""Pictures for web pages; same input, same bytes.

Those of pixels are SVG in the reader's light or dark mode, those of meshes PNG without a background.
"""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import Final

import numpy as np

from ...models.field.field import CrossField
from ...models.instance.instance import Instance
from ...models.instance.mesh import Mesh
from .draw import fixed_settings
from .marks import PAPER, Area, GridFrame, Layer, Lines, Mark, Sheet
from .mesh_view import draw_mesh
from .palette import DARK, LIGHT
from .svg import web_sheet_svg

_SIDE: Final = 320.0
CROSSES_UP_TO: Final = 12  # longer side of a grid with crosses at all pixels; larger ones have streamlines
_GRID: Final = "#e4e6ea"
_EDGE: Final = "#8b929c"
_FAINT: Final = "#d3d6db"
_NIGHT: Final = {LIGHT[mark]: DARK[mark] for mark in LIGHT} | {  # colours in dark mode by those in light mode
    PAPER: "#1d2126",
    _GRID: "#30363d",
    _EDGE: "#7d8590",
    _FAINT: "#3d444d",
}
_MARGIN: Final = 7.0
_SPACING: Final = 10.0  # between streamlines of one family
_CELLS_FROM: Final = 9.0  # units of a pixel from which on its sides are drawn
_MESH_SIDE: Final = 640  # dots per side of a picture of a mesh


def field_picture(field: CrossField) -> bytes:
    """Crosses or, on a larger grid, streamlines over faint strokes; singularities red (+) and blue (-)."""
    if isinstance(field.instance.domain, Mesh):
        return _mesh_picture(field)
    frame = _web_frame(field.instance)
    few = max(field.instance.mask.shape) <= CROSSES_UP_TO
    lines = (
        frame.crosses(field, min(0.07 * frame.pixel, 2.6)) if few else frame.streamlines(field, 1.3, _SPACING)
    )
    strokes = frame.strokes(_FAINT, float(np.clip(0.3 * frame.pixel, 2.6, 9.0)))
    return _page_around_mask(frame, [*_mask_marks(frame), *strokes, *lines, *frame.singularities(field, 4.6)])


def _mesh_picture(field: CrossField) -> bytes:
    from matplotlib.figure import Figure

    stream, inches = io.BytesIO(), 4.0
    with fixed_settings():
        figure = Figure(figsize=(inches, inches))
        draw_mesh(figure.add_axes((0.0, 0.0, 1.0, 1.0)), field)
        figure.savefig(
            stream, format="png", dpi=_MESH_SIDE / inches, transparent=True, metadata={"Software": None}
        )
    return stream.getvalue()


def _web_frame(instance: Instance) -> GridFrame:
    return GridFrame(
        instance, (0.0, 0.0), _SIDE / float(np.ptp(np.argwhere(instance.mask), axis=0).max() + 1)
    )


def _mask_marks(frame: GridFrame) -> list[Area | Lines]:
    """The mask, its pixels where they are large enough, and its outline."""
    cells = [frame.sides(_GRID, 0.8, between=True)] if frame.pixel >= _CELLS_FROM else []
    return [frame.area(PAPER, frame.instance.mask), *cells, frame.sides(_EDGE, 1.2)]


def _page_around_mask(frame: GridFrame, marks: Iterable[Mark]) -> bytes:
    inside = np.argwhere(frame.instance.mask)[:, ::-1]
    left, top = (frame.pixel * inside.min(axis=0) - _MARGIN).tolist()
    right, bottom = (frame.pixel * (inside.max(axis=0) + 1) + _MARGIN).tolist()
    x, y, width, height = (round(value, 1) for value in (left, top, right - left, bottom - top))
    return web_sheet_svg(Sheet((x, y, width, height), (Layer("", tuple(marks)),)), _NIGHT)
