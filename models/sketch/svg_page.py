"""The page of an SVG drawing: its units, and what of them is shown."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from ..errors import InputError
from ..input_limits import LEAST_LENGTH
from .cover import Box, box_around
from .svg_elements import GROUP, SVG, chosen_attributes, length_of, name_of
from .visible import PaintedShape

GREATEST: Final = 1e9
"""Greatest coordinate."""
UNPAGED: Final = (0.0, 0.0, 100.0, 100.0)
"""The page to which percentages refer where there is none."""
_OWN_MARGIN: Final = 0.05  # of the drawing, around the picture of a drawing without a page


@dataclass(frozen=True)
class DrawingPage:
    """The page of a drawing.

    view: its viewBox, or width and height from (0, 0). box: the same in the units of the result, which differ
    where a page is stretched. window: what of these units is shown.
    """

    view: Box
    box: Box
    window: Box


def page_of(root: Element) -> DrawingPage | None:
    """The page of a drawing; None if it states neither a viewBox nor a width and height."""
    view = view_box(root)
    wide, high = (length_of(root.get(key, ""), 0.0) for key in ("width", "height"))
    has_size = min(wide, high) >= LEAST_LENGTH
    if view is None:
        box = (0.0, 0.0, wide, high)
        return DrawingPage(box, box, box) if has_size else None
    if not has_size:
        return DrawingPage(view, view, view)
    across, down, right, below = fit_view(view, wide, high, root.get("preserveAspectRatio", ""))
    stretch = down / across
    box = (view[0], view[1] * stretch, view[2], view[3] * stretch)
    window = (box[0] - right / across, box[1] - below / across, wide / across, high / across)
    return DrawingPage(view, box, window)


def window_around(shapes: Sequence[PaintedShape]) -> Box:
    """The box of all shapes with a margin, for a drawing without a page."""
    left, top, right, bottom = box_around(np.concatenate([shape.points for shape in shapes]))
    margin = _OWN_MARGIN * max(right - left, bottom - top, LEAST_LENGTH)
    return left - margin, top - margin, right - left + 2 * margin, bottom - top + 2 * margin


def frame_drawing(root: Element, page: DrawingPage | None, window: Box, side: int) -> Element:
    """The drawing in a root that shows the window, with `side` pixels along its longer side."""
    view, box = (page.view, page.box) if page else (UNPAGED, UNPAGED)
    wide, high = (str(max(1, round(side * length / max(window[2:])))) for length in window[2:])
    shown = {"viewBox": _join(window), "preserveAspectRatio": "none", "width": wide, "height": high}
    frame = Element(SVG + "svg", shown)
    placed = {key: f"{value!r}" for key, value in zip(("x", "y", "width", "height"), box, strict=True)}
    placed |= {"viewBox": _join(view), "preserveAspectRatio": "none", "overflow": "visible"}
    inner = SubElement(frame, SVG + "svg", placed)
    SubElement(inner, SVG + "g", chosen_attributes(root, GROUP)).extend(list(root))
    return frame


def fit_view(view: Box, wide: float, high: float, rule: str) -> tuple[float, float, float, float]:
    """Scales across and down, and shifts, that fit a viewBox into a width and height; rule: its aspect."""
    across, down = wide / view[2], high / view[3]
    if rule.strip().startswith("none"):
        return across, down, 0.0, 0.0
    scale = max(across, down) if "slice" in rule else min(across, down)
    shares = [
        next((share for word, share in (("Min", 0.0), ("Max", 1.0)) if axis + word in rule), 0.5)
        for axis in ("x", "Y")
    ]
    return scale, scale, shares[0] * (wide - scale * view[2]), shares[1] * (high - scale * view[3])


def view_box(element: Element) -> Box | None:
    """The viewBox of an element, None without one. Raises InputError for one without an area."""
    text = element.get("viewBox", "")
    if not text.strip():
        return None
    start = f"{name_of(element)}: its viewBox {text[:40]!r}"
    try:
        x, y, width, height = map(float, re.split(r"[\s,]+", text.strip()))
    except ValueError as error:
        raise InputError(f"{start} is not four numbers") from error
    if not (np.abs([x, y, width, height]) <= GREATEST).all() or min(width, height) < LEAST_LENGTH:
        raise InputError(f"{start} has no area")
    return x, y, width, height


def _join(box: Box) -> str:
    return " ".join(f"{value!r}" for value in box)
