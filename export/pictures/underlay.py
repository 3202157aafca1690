"""The drawing that a field is laid over: what a reader found in a file, never the file itself.

Of a vector drawing these are its curves, of a bitmap its ink. So no script, link, font or entity of a file
can reach a picture, and one sees what the reader saw.
"""

from __future__ import annotations

import io
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from xml.etree.ElementTree import ParseError

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ...models.errors import InputError, naming
from ...models.instance.domain import Floats
from ...models.instance.instance import Instance
from ...models.sketch.bitmap import Bitmap
from ...models.sketch.cover import Box, Frame
from ...models.sketch.curves import Curves, are_straight, flatten, run_numbers
from ...models.sketch.drawing_file import parse_drawing, read_file
from ...models.sketch.read import DEFAULT_SIZE
from ...models.sketch.samples import SAMPLES, sample_svg
from .palette import LIGHT

INK: Final = {"black": "#4a4a4a", "red": LIGHT["stroke"]}
"""Colours of the strokes below a field; red are those that are drawn in red."""
_LEVELS: Final = 15  # of ink, so that its picture stays small
_LENGTH: Final = re.compile(r"(\d{1,9}(?:\.\d{1,12})?)(px|pt|pc|mm|cm|in|Q)?")
_LOOKS_RED: Final = 0.5
_EDGE: Final = 1e-2  # of the page: strokes that reach less far beyond it do not enlarge it
_SAME: Final = 0.8  # least share of the stroke pixels of a field that lie on its drawing


@dataclass(frozen=True, eq=False)
class Underlay:
    """Curves or ink, in the drawing's own coordinates, y down.

    page: x, y, width, height, larger where strokes lie beyond it. curves: unbroken runs by colours of INK,
    each (k, 4, 2) cubics or (k, 2, 2) straight pieces. size: width and height with the units that the drawing
    declares, as `210mm`. declared: the page as the drawing states it, None without one. ink: uint8 (h, w, 4),
    red, green, blue and opacity; None for curves. scale: side of a pixel of the ink.
    """

    page: Box
    curves: dict[str, list[Floats]]
    size: tuple[str, str]
    declared: Box | None
    ink: NDArray[np.uint8] | None = None
    scale: float = 1.0

    def segments(self, tolerance: float) -> Floats:
        """Straight segments (m, 2, 2) within a tolerance of the curves."""
        runs = [run for runs in self.curves.values() for run in runs]
        return np.concatenate(
            [run if run.shape[1] == 2 else flatten(run, tolerance)[0] for run in runs]
            or [np.empty((0, 2, 2))]
        )


def read_underlay(source: str | Path, *, on: Instance) -> Underlay:
    """The drawing of an instance, from a sketch file or a drawn sample; .curves is seen from the same side.

    Raises InputError for an unreadable file, a computed sample, and a drawing that lies elsewhere.
    """
    path = Path(source)
    sampled = not path.is_file() and str(source) in SAMPLES
    data = sample_svg(str(source)).encode() if sampled else read_file(path)
    with naming(path):
        return parse_underlay(data, path.suffix, on=on)


def parse_underlay(data: bytes, suffix: str, *, on: Instance) -> Underlay:
    """The drawing of an instance from the bytes of a file with this suffix, as in `read_underlay`."""
    content = parse_drawing(data, suffix, DEFAULT_SIZE, view=on.view)
    drawn = content.covers(Frame(*on.origin, on.pixel_size, *on.mask.shape)).walls
    near = ndimage.binary_dilation(drawn, np.ones((3, 3), dtype=bool))
    share = near[tuple(on.stroke_pixels.T)].mean()
    if share < _SAME:
        raise InputError(
            f"the drawing lies elsewhere than the field of {on.name}: {share:.0%} of the stroke pixels "
            "are on its strokes; give the drawing that its instance was read from, from the same side"
        )
    return _underlay_of_ink(content) if isinstance(content, Bitmap) else underlay_of_curves(content, data)


def underlay_of_curves(curves: Curves, data: bytes = b"") -> Underlay:
    """Curves below a field. data: their file, for the size of the page that it declares."""
    low, high = np.reshape(curves.box, (2, 2))
    start, side = np.reshape(curves.page or (0.0, 0.0, 0.0, 0.0), (2, 2))
    low = np.where(low < start - _EDGE * side, low, start)
    high = np.where(high > start + (1 + _EDGE) * side, high, start + side)
    (left, top), (width, height) = low.tolist(), (high - low).tolist()
    page = (left, top, width, height)
    starts = np.flatnonzero(np.diff(run_numbers(curves.points, curves.curve), prepend=-1))
    straight = np.logical_and.reduceat(are_straight(curves.points), starts)
    runs_by_colour: dict[str, list[Floats]] = {name: [] for name in INK}
    runs = np.split(curves.points, starts[1:])
    for run, red, is_straight in zip(runs, curves.red[starts], straight, strict=True):
        runs_by_colour["red" if red else "black"].append(run[:, ::3] if is_straight else run)
    return Underlay(page, runs_by_colour, _page_size(data, curves.page, page), curves.page)


def size_in_units(page: Box) -> tuple[str, str]:
    """Width and height of a page that declares no others."""
    return f"{page[2]:.12g}", f"{page[3]:.12g}"


def _page_size(data: bytes, declared: Box | None, page: Box) -> tuple[str, str]:
    """Width and height of the page of a sketch, at the millimetres per unit that an SVG declares."""
    from defusedxml.ElementTree import iterparse

    try:
        _, root = next(iterparse(io.BytesIO(data), ("start",), forbid_entities=True, forbid_external=True))
    except ParseError:  # pen strokes
        return size_in_units(page)
    width, height = (_LENGTH.fullmatch(root.get(side, "").strip()) for side in ("width", "height"))
    if not (declared and width and height and float(width[1]) and float(height[1])):
        return size_in_units(page)
    scales = [float(side[1]) / whole for side, whole in zip((width, height), declared[2:], strict=True)]
    if width[2] == height[2]:
        scales = [min(scales)] * 2
    return (
        f"{scales[0] * page[2]:.12g}{width[2] or ''}",
        f"{scales[1] * page[3]:.12g}{height[2] or ''}",
    )


def _underlay_of_ink(picture: Bitmap) -> Underlay:
    ink = np.zeros((*picture.ink.shape, 4), dtype=np.uint8)
    for name, some in (("black", picture.red <= _LOOKS_RED), ("red", picture.red > _LOOKS_RED)):
        ink[some, :3] = tuple(bytes.fromhex(INK[name][1:]))
    ink[..., 3] = 255 // _LEVELS * np.round(_LEVELS * picture.ink)
    page = (0.0, 0.0, float(picture.width), float(picture.height))
    return Underlay(page, {}, size_in_units(page), page, ink, float(picture.reduction))
