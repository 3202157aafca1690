"""Documents of the page from files: saved sessions, curves, and pictures by their thinned ink."""

from __future__ import annotations

import base64
import io
import json
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...models.errors import InputError
from ...models.instance.domain import Bools, Floats
from ...models.instance.instance import name_from_text
from ...models.sketch.bitmap import Bitmap
from ...models.sketch.cover import Box, block_means
from ...models.sketch.curves import Curves, flatten, run_numbers
from ...models.sketch.drawing_file import detect_file_kind, parse_drawing
from ...models.sketch.parallels import find_non_edges
from ...models.sketch.thinning import join_ways, smooth_way, trace_shape
from .document import MOST_SENT, PICTURE_SIDE, Document, Mark, digest_of, read_strokes

_FINE: Final = 1 / 2000  # greatest distance of a polyline from its curve, as a share of the drawing
_THINNED: Final = 700  # pixels on the longer side of a picture while it is traced
_INK: Final = 0.3
_RED: Final = 0.5
_QUALITY: Final = 80  # of a JPEG


def open_drawing(data: bytes, file_name: str, view: str | None = None) -> dict[str, Any]:
    """A session under `document`, or else name, page and strokes of a drawing. Raises InputError.

    A picture is added as `picture`, upright and reduced, as JPEG in base64; it lies on the page. A flat file
    is added as `source`, because the page computes from the file itself until a stroke is changed.

    view: direction of a .curves file, as for `read_sketch`. Without it, such a file is added as `file` with
    name and data in base64, because the page reads it again from other sides. `notes` are lines on what was
    left out, or is ignored at first.
    """
    if not data:
        raise InputError("the file is empty; save the drawing again")
    if data.lstrip().startswith(b"{"):
        Document.from_bytes(data)
        return {"document": json.loads(data)}
    stem, dot, suffix = file_name.rpartition(".")
    suffix = f".{suffix.lower()}" if dot else ""
    spatial = detect_file_kind(data, suffix) == "curves"
    drawing = parse_drawing(data, suffix, _THINNED // 4, view=view if spatial else None)
    notes = list(drawing.notes)
    if isinstance(drawing, Bitmap):
        page, strokes = _trace_picture(drawing)
    else:
        is_left_out, reasons = find_non_edges(drawing)
        page, strokes = _strokes_of_curves(drawing, is_left_out)
        notes += reasons
    opened: dict[str, Any] = {
        "name": name_from_text(stem or file_name),
        "page": list(page),
        "strokes": strokes,
        "notes": notes,
    }
    if isinstance(drawing, Bitmap):
        opened["picture"] = _encode_picture(drawing.pixels)
    if spatial and view is None:
        opened["file"] = {"name": file_name, "data": base64.b64encode(data).decode()}
    if not spatial and len(data) <= MOST_SENT:
        opened["source"] = {
            "name": file_name,
            "data": base64.b64encode(data).decode(),
            "digest": digest_of(read_strokes(opened)),
        }
    return opened


def _encode_picture(pixels: NDArray[np.uint8]) -> str:
    from PIL import Image

    image = Image.fromarray(pixels if pixels.shape[-1] == 3 else pixels[..., 0])
    image.thumbnail((PICTURE_SIDE, PICTURE_SIDE))
    stream = io.BytesIO()
    image.save(stream, "JPEG", quality=_QUALITY)
    return base64.b64encode(stream.getvalue()).decode()


def _stroke_document(points: Floats, mark: Mark) -> dict[str, Any]:
    return {"points": np.round(points, 3).ravel().tolist(), "mark": mark, "weight": 1}


def _strokes_of_curves(curves: Curves, ignored: Bools) -> tuple[Box, list[dict[str, Any]]]:
    """Page and strokes of curves, some (k,) of them ignored: their unbroken runs as polylines."""
    left, top, right, bottom = curves.box
    page = curves.page or (left, top, max(right - left, 1e-6), max(bottom - top, 1e-6))
    segments, owner = flatten(curves.points, _FINE * max(right - left, bottom - top, 1e-6))
    run = run_numbers(curves.points, curves.curve)[owner]
    starts = np.flatnonzero(np.diff(run, prepend=-1))
    marks = np.where(ignored, "ignored", np.where(curves.line, "line", "cut"))[owner[starts]].tolist()
    strokes = [
        _stroke_document(np.concatenate([part[:, 0], part[-1:, 1]]), mark)
        for part, mark in zip(np.split(segments, starts[1:]), marks, strict=True)
    ]
    return page, strokes


def _trace_picture(picture: Bitmap) -> tuple[Box, list[dict[str, Any]]]:
    """Page and strokes of a picture: the middle lines of its ink, straight on across junctions."""
    reduced = max(1.0, max(picture.ink.shape) / _THINNED)
    rows, columns = (np.arange(int(side / reduced) + 1) * reduced for side in picture.ink.shape)
    small = block_means(picture.ink, rows, columns)
    red = block_means(picture.red * picture.ink, rows, columns) / np.maximum(small, 1e-6)
    ink = small * max(1.0, reduced / picture.stroke_width) > _INK
    ways = trace_shape(ink)
    is_red = np.array([np.median(red[tuple(way.T)]) > _RED for way in ways], dtype=bool)
    as_lines = is_red if picture.has_two_colours and is_red.any() else np.ones(len(ways), dtype=bool)
    pen = max(1.0, picture.stroke_width / reduced)
    marks: tuple[tuple[Mark, Bools], ...] = (("cut", ~as_lines), ("line", as_lines))
    traced = [
        (mark, smooth_way(way))
        for mark, chosen in marks
        if chosen.any()
        for way in join_ways([ways[number] for number in np.flatnonzero(chosen)], pen, ink)
    ]
    # Middle lines end half a pen before their ink. On the box of the ink, they are read on the same grid.
    low, high = (end(np.concatenate([line for _, line in traced]), axis=0) for end in (np.min, np.max))
    box = np.reshape(picture.box, (2, 2))
    scale = (box[1] - box[0]) / np.where(high > low, high - low, np.inf)
    middle = box.mean(axis=0) - scale * (low + high) / 2
    strokes = [_stroke_document(scale * line + middle, mark) for mark, line in traced]
    return (0.0, 0.0, float(picture.width), float(picture.height)), strokes
