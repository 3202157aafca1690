"""From a document of the page to its instance, field and surface. Functions of the document alone.

They run in child processes. A process keeps its last fields and surfaces for requests that repeat them.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np
from scipy import ndimage

from ...models.errors import CrossfieldError
from ...models.field.field import CrossField
from ...models.instance.domain import Bools, Floats, Ints
from ...models.instance.instance import SKEW_WEIGHT, Instance
from ...models.processes.child_program import is_stopped
from ...models.sketch.cover import Frame, fit_frame, pixels_along
from ...models.sketch.curves import Curves
from ...models.sketch.drawing_file import Drawing, parse_drawing
from ...models.sketch.parallels import leave_out_non_edges
from ...models.sketch.read import drop_silhouette, find_mask, instance_of_mask
from ...models.smooth.bend import surface_field
from ...models.surface.hints import Hint, pixel_at
from ...models.surface.lift import surface
from ...models.surface.surface import Surface
from ..pictures.underlay import Underlay, parse_underlay, underlay_of_curves
from ..shading.raster import Outline
from ..surfaces.outline import find_outline
from .document import SIZES, Document, MaskEdit, Source, digest_of

_Result = TypeVar("_Result")

_MOST_KEPT: Final = 4
OUT, IN, LEFT_OUT, STROKE = range(4)
"""Kinds of pixels: outside, solved for, enclosed but left out, and covered by a stroke that cuts."""


class OvertakenError(CrossfieldError):
    """Work that ended early because a newer edit replaced it."""


@dataclass(frozen=True, eq=False)
class DrawnInstance:
    """An instance of a document, the kind (h, w) of each pixel, and its strokes.

    strokes: number of the stroke and of the stroke pixel for each pair of them, (k, 2).
    """

    document: Document
    instance: Instance
    kinds: Ints
    strokes: Ints


def read_drawn(document: Document, size: int | None = None) -> DrawnInstance:
    """The instance of a document. size: instead of that of the document. Raises InputError.

    Until a stroke is changed, it is the instance that `read_sketch` reads from the file that was opened.
    """
    curves, source = document.curves(), document.source
    drawing = _read_source(source) if source else curves
    frame = fit_frame(drawing.box, size or document.size, margin=True)
    covers = drawing.covers(frame)
    mask, reading = find_mask(drawing, covers, frame)
    edited = _edit_mask(document.mask, mask, covers.walls, frame)
    left_out = edited | _enclosed_parts(~edited & ~covers.walls)
    mask = edited & ~covers.cuts
    if document.silhouette == "outer":
        covers, mask = drop_silhouette(covers, mask)
    instance = instance_of_mask(
        frame,
        covers.lines,
        mask,
        reading,
        name=document.name,
        source=source.name if source else f"{document.name}.svg",
    ).with_weights(stroke_weight=document.stroke_weight, skew_weight=SKEW_WEIGHT)
    pixels = (curves.covers(frame) if source else covers).pixels
    assert pixels is not None  # of curves
    owner, row, column = pixels
    number = np.full(frame.shape, -1)
    number[tuple(instance.stroke_pixels.T)] = np.arange(len(instance.theta))
    pairs = np.stack([owner, number[row, column]], axis=1)
    pairs = pairs[pairs[:, 1] >= 0].astype(np.int32)
    kinds = np.select([covers.cuts, mask, left_out], [STROKE, IN, LEFT_OUT], OUT).astype(np.int32)
    return DrawnInstance(document, _scale_weights(instance, document.weights, pairs), kinds, pairs)


def _read_source(source: Source) -> Drawing:
    """The drawing in the file that was opened, as `read_sketch` reads it for every size of the page."""

    def read() -> Drawing:
        drawing = parse_drawing(source.data, Path(source.name).suffix, SIZES[1])
        return leave_out_non_edges(drawing) if isinstance(drawing, Curves) else drawing

    return _DRAWINGS.get_or_compute((hashlib.sha256(source.data).digest(), source.name), read)


def _scale_weights(instance: Instance, weights: Floats, pairs: Ints) -> Instance:
    """The instance with reliabilities scaled by the mean weight of the strokes in each pixel."""
    if (weights == 1).all():
        return instance
    count = np.maximum(np.bincount(pairs[:, 1], minlength=len(instance.w)), 1)
    mean = np.bincount(pairs[:, 1], weights[pairs[:, 0]], len(instance.w)) / count
    return replace(instance, w=instance.w * np.where(mean > 0, mean, 1.0))


def _edit_mask(edits: tuple[MaskEdit, ...], mask: Bools, walls: Bools, frame: Frame) -> Bools:
    """The mask after the edits in their order."""
    left = np.zeros_like(mask)
    cells, _ = ndimage.label(~walls)
    for edit in edits:
        if edit.kind == "toggle":
            cell = _find_cell(cells, edit.points[0], frame)
            gone = (mask & cell).any()
            mask, left = (
                (mask & ~cell, left | cell) if gone else (mask | cell | _find_rim(cell, walls), left & ~cell)
            )
        else:
            brushed = _brushed_pixels(edit, frame)
            mask = mask | brushed if edit.kind == "paint" else mask & ~brushed
    # Strokes that only bound areas without a field would be thin parts of their own.
    return mask & ~(_find_rim(left, walls) & ~_find_rim(mask & ~walls, walls))


def _find_rim(area: Bools, walls: Bools) -> Bools:
    """The pixels of strokes next to an area."""
    return np.asarray(ndimage.binary_dilation(area, np.ones((3, 3), dtype=bool)) & walls)


def _find_cell(cells: Ints, point: Floats, frame: Frame) -> Bools:
    """The area between strokes that contains a point; nothing for the outside and on a stroke."""
    column, row = np.floor((point - (frame.x, frame.y)) / frame.pixel).astype(int)
    inside = 0 <= row < frame.height and 0 <= column < frame.width and cells[row, column] > 0
    cell: Bools = cells == (cells[row, column] if inside else -1)
    return cell if _enclosed_parts(cell).any() else np.zeros_like(cell)


def _enclosed_parts(area: Bools) -> Bools:
    """The parts of an area that do not reach the edge of the grid."""
    label, count = ndimage.label(area)
    free = np.ones(count + 1, dtype=bool)
    free[[0, *label[0], *label[-1], *label[:, 0], *label[:, -1]]] = False
    return np.asarray(free[label])


def _brushed_pixels(edit: MaskEdit, frame: Frame) -> Bools:
    """The pixels whose middles a brush passes over, at least the pixels under its path."""
    ends = np.concatenate([edit.points[1:], edit.points[-1:]])
    under = pixels_along(np.stack([edit.points, ends], axis=1), frame)
    if not under.any():
        return under
    return np.asarray(ndimage.distance_transform_edt(~under) <= edit.radius / frame.pixel)


class _ResultCache(OrderedDict[object, Any]):
    """The last few results of work that no edit has ended."""

    def get_or_compute(self, key: object, work: Callable[[], _Result]) -> _Result:
        """The result for a key, computed if it is new. Raises OvertakenError."""
        if key not in self:
            result = work()
            if is_stopped():
                raise OvertakenError("a newer edit replaced this one")
            self[key] = result
            while len(self) > _MOST_KEPT:
                self.popitem(last=False)
        latest: _Result = self[key]
        return latest


_DRAWINGS: Final = _ResultCache()
_FIELDS: Final = _ResultCache()
_SURFACES: Final = _ResultCache()
_OUTLINES: Final = _ResultCache()


def compute_field(document: Document, size: int | None = None) -> tuple[DrawnInstance, CrossField]:
    """The instance of a document and its bend field. Raises OvertakenError."""
    drawn = read_drawn(document, size)
    instance = drawn.instance
    return drawn, _FIELDS.get_or_compute(
        instance.sha256,
        lambda: surface_field(instance, stop=is_stopped),
    )


def hints_on_mask(document: Document, instance: Instance) -> list[Hint]:
    """The hints of a document at pixels of the mask; those outside have no effect."""
    placed = ((pixel_at(hint.x, hint.y, instance), hint) for hint in document.hints)
    return [Hint(*pixel, np.radians(hint.slant), np.radians(hint.tilt)) for pixel, hint in placed if pixel]


def compute_surface(document: Document, field: CrossField) -> Surface:
    """The surface of a document's field, with its hints. Raises OvertakenError."""
    hints, flip = tuple(hints_on_mask(document, field.instance)), document.flip
    concave = tuple(place for place in document.concave if pixel_at(*place, field.instance))
    return _SURFACES.get_or_compute(
        (field.instance.sha256, hints, flip, concave),
        lambda: surface(field, hints, flip=flip, concave=concave, stop=is_stopped),
    )


def underlay_of(document: Document, instance: Instance) -> Underlay:
    """The drawing below pictures of a document's field and surface, which show its page."""
    source = document.source
    drawing = (
        parse_underlay(source.data, Path(source.name).suffix, on=instance)
        if source
        else underlay_of_curves(document.curves())
    )
    return replace(drawing, declared=document.page)


def compute_outline(document: Document, instance: Instance) -> Outline:
    """The outline of a document's surface, as in its files. Raises OvertakenError."""
    return _OUTLINES.get_or_compute(
        (instance.sha256, digest_of(document.strokes)),
        lambda: find_outline(instance, underlay_of(document, instance)),
    )
