"""Strokes of the page from a file: SVG, .scap and .curves by their curves."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from ...models.errors import InputError
from ...models.instance.domain import Floats
from ...models.sketch.bitmap import Bitmap
from ...models.sketch.cover import Box
from ...models.sketch.curves import Curves, flatten, run_numbers
from ...models.sketch.drawing_file import detect_file_kind, parse_drawing
from ...models.sketch.read import DEFAULT_SIZE, name_from_text

_FINE: Final = 1 / 2000  # greatest distance of a polyline from its curve, as a share of the drawing


def open_drawing(data: bytes, file_name: str, view: str | None = None) -> dict[str, Any]:
    """Name, page and strokes of a drawing, as in a document. Raises InputError.

    view: direction of a .curves file, as for `read_sketch`. `spatial` states whether it has one.
    """
    if not data:
        raise InputError("the file is empty; save the drawing again")
    stem, dot, suffix = file_name.rpartition(".")
    suffix = f".{suffix.lower()}" if dot else ""
    spatial = detect_file_kind(data, suffix) == "curves"
    drawing = parse_drawing(data, suffix, DEFAULT_SIZE, view=view if spatial else None)
    if isinstance(drawing, Bitmap):
        raise InputError(
            "a picture has no strokes to edit; trace it in a drawing program, or read it with "
            "`crossfield instance`"
        )
    page, strokes = _strokes_of_curves(drawing)
    return {
        "name": name_from_text(stem or file_name),
        "page": list(page),
        "strokes": strokes,
        "spatial": spatial,
    }


def _stroke_document(points: Floats, *, line: bool) -> dict[str, Any]:
    rounded = np.round(points, 3).ravel().tolist()
    return {"points": rounded, "mark": "line" if line else "cut", "weight": 1}


def _strokes_of_curves(curves: Curves) -> tuple[Box, list[dict[str, Any]]]:
    """Page and strokes of curves: their unbroken runs as polylines."""
    left, top, right, bottom = curves.box
    page = curves.page or (left, top, max(right - left, 1e-6), max(bottom - top, 1e-6))
    segments, owner = flatten(curves.points, _FINE * max(right - left, bottom - top, 1e-6))
    run = run_numbers(curves.points, curves.curve)[owner]
    starts = np.flatnonzero(np.diff(run, prepend=-1))
    strokes = [
        _stroke_document(np.concatenate([part[:, 0], part[-1:, 1]]), line=bool(line))
        for part, line in zip(np.split(segments, starts[1:]), curves.line[owner[starts]], strict=True)
    ]
    return page, strokes
