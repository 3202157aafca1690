"""The data of an instance, a field and a surface for the page, as JSON with arrays in base64."""

from __future__ import annotations

import base64
from typing import Any, Final

import numpy as np

from ...models.field.field import CrossField
from ...models.instance.instance import Instance
from ...models.processes.child_program import is_stopped
from ...models.surface.trust import right_angle_deviation
from ..pictures.draw import count_singularities
from ..pictures.marks import split_runs
from ..pictures.streamlines import streamlines
from ..shading.raster import View, grid_box, view_of_box
from ..surfaces.files import raster_surface
from .document import Document
from .meetings import find_suspects
from .next_step import find_next_step
from .session import DrawnInstance, OvertakenError, compute_field, compute_outline, compute_surface

_SIDE: Final = 640  # pixels, about, of the longer side of the grid in a shaded picture
_MOST_SIDE: Final = 8000  # pixels of a page with a small drawing, of which the page gets a part
_RIM: Final = 2  # pixels of the grid round it that the picture shows: strokes may be wide
_FINE: Final = 32767  # steps of a part of a normal: 8 bits would show as bands
_FEW: Final = 2  # curvature lines whose crosses say nothing of the depth: the next one can bend
_SPACING: Final = 44  # streamlines of one family across the longer side of the grid


def load_module() -> None:
    """Do nothing: this module is imported where the call arrives."""


def encode_array(values: np.ndarray[Any, Any], kind: str) -> str:
    """The numbers in little-endian order as base64."""
    return base64.b64encode(values.astype(np.dtype(kind).newbyteorder("<")).tobytes()).decode()


def field_step(data: bytes, size: int | None = None) -> tuple[dict[str, Any], DrawnInstance, CrossField]:
    """Instance and field of a document, and what the page shows of them. Raises InputError."""
    drawn, field = compute_field(Document.from_bytes(data), size)
    return _field_view(drawn, field), drawn, field


def next_step(data: bytes) -> dict[str, Any]:
    """The next step of a drawing, for documents without a field. Raises InputError."""
    return {"next": find_next_step(Document.from_bytes(data))}


def _field_view(drawn: DrawnInstance, field: CrossField) -> dict[str, Any]:
    instance, (x, y), spots = drawn.instance, drawn.instance.origin, field.singularities
    pixel = instance.pixel_size
    facts = field.facts()
    return {
        "stage": "field",
        "size": max(instance.mask.shape),
        "frame": {"x": x, "y": y, "pixel": pixel, "rows": len(drawn.kinds), "columns": drawn.kinds.shape[1]},
        "kinds": encode_array(drawn.kinds, "u1"),
        "warnings": list(instance.reading.warnings) if instance.reading else [],
        "mask": encode_array(instance.mask, "u1"),
        "u": encode_array(field.u_angle, "f4"),
        "v": encode_array(field.v_angle, "f4"),
        "singularities": [
            [x + pixel * (column + 1.0), y + pixel * (row + 1.0), index]
            for row, column, index in zip(
                spots.row.tolist(), spots.column.tolist(), spots.index.tolist(), strict=True
            )
        ],
        "next": find_next_step(drawn.document),
        "numbers": {
            "pixels": instance.grid.size,
            "strokes": len(instance.theta),
            "deviation": facts["stroke_deviation_mean_degrees"],
            "most_deviation": facts["stroke_deviation_90_percent_degrees"],
            "energy": facts["energy_2_norm"],
            "singularities": count_singularities(field),
        },
    }


def lines_step(field: CrossField) -> dict[str, Any]:
    """Streamlines of a field in the units of the drawing, as flat lists x, y, x, y, ... of each family."""
    (x, y), pixel = field.instance.origin, field.instance.pixel_size
    lines = streamlines(field, max(max(field.instance.mask.shape) / _SPACING, 0.8))
    families = [
        [
            np.round([x, y] + pixel * (points * [1, -1] + 0.5), 3).ravel().tolist()
            for line in lines
            for points in split_runs(line, family)
        ]
        for family in (0, 1)
    ]
    if is_stopped():
        raise OvertakenError("a newer edit replaced this one")
    return {"stage": "lines", "size": max(field.instance.mask.shape), "families": families}


def surface_step(drawn: DrawnInstance, field: CrossField) -> dict[str, Any]:
    """The data of the surface of a field for the page."""
    document, instance = drawn.document, drawn.instance
    lifted = compute_surface(document, field)
    view = _view_on_page(document, instance)
    bands = [part for _, part in raster_surface(lifted, compute_outline(document, instance), view)]
    normals = np.concatenate([part.normals[..., :2] for part in bands])
    opacity = np.concatenate([part.opacity for part in bands])
    off, (stroke, at) = right_angle_deviation(field, lifted.heights), drawn.strokes.T
    strokes = len(document.strokes)
    misfit = np.bincount(stroke, off[instance.stroke_index[at]], strokes)
    misfit = misfit / np.maximum(np.bincount(stroke, minlength=strokes), 1)
    is_begun = sum(document.strokes[number].mark == "line" for number in document.visible) <= _FEW
    return {
        "stage": "surface",
        "size": max(instance.mask.shape),
        "box": view.box,
        "width": view.width,
        "height": view.height,
        "normals": encode_array(np.round(_FINE * normals), "i2"),
        "opacity": encode_array(np.round(255 * opacity), "u1"),
        "freedom": [choice.document() for choice in lifted.freedom if not (choice.hint and is_begun)],
        "suspects": find_suspects(document, misfit),
    }


def _view_on_page(document: Document, instance: Instance) -> View:
    """The pixels of a picture of the page that show the grid."""
    x, y, width, height = grid_box(instance)
    rim = _RIM * instance.pixel_size
    side = round(_SIDE * max(document.page[2:]) / max(width, height))
    page = view_of_box(document.page, max(1, min(side, _MOST_SIDE)))
    return page.around((x - rim, y - rim, width + 2 * rim, height + 2 * rim))
