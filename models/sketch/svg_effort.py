"""The work of a renderer on an SVG drawing: its limits, and the resolution that keeps it within them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Final
from xml.etree.ElementTree import Element

import numpy as np

from ..errors import InputError
from ..input_limits import MAX_DEPTH, MAX_ELEMENTS, MAX_LAYERS
from ..instance.domain import Floats
from .cover import Box, box_around
from .svg_elements import HREFS, tag_of
from .visible import RENDERED_SIDE, PaintedShape

_EASY: Final = 100  # layers of the size of the page that are drawn at full resolution
_LEAST_SIDE: Final = 256  # pixels on the longer side of a picture
_LAYERED: Final = ("clip-path", "mask", "opacity")


def choose_side(root: Element, window: Box, shapes: Sequence[PaintedShape]) -> int:
    """Pixels on the longer side of the pictures of a drawing: fewer for many clips, masks and opacities.

    A renderer draws the content of each of them on a layer of its own. Raises InputError if they draw too
    many elements or layers, or nest them too deep.
    """
    named = {element.get("id", ""): element for element in reversed(list(root.iter()))}
    boxes = {shape.element: _corners_of(shape, window) for shape in shapes if len(shape.points)}
    efforts: dict[Element, tuple[int, int]] = {}
    layers = 0.0
    stack, around = [(root, False)], set[Element]()
    while stack:
        element, is_left = stack.pop()
        inner = [*element, *_drawn_references(element, named)]
        if is_left:
            around.discard(element)
            known = [efforts[part] for part in inner if part in efforts]
            count, depth = 1 + sum(one for one, _ in known), 1 + max((deep for _, deep in known), default=0)
            if count > MAX_ELEMENTS or depth > 2 * MAX_DEPTH:
                raise InputError(
                    f"draws more than {MAX_ELEMENTS} elements, or more than {2 * MAX_DEPTH} inside of one "
                    "another, by its clips, masks and patterns; flatten it in the drawing program"
                )
            efforts[element] = count, depth
            if inside := [boxes[part] for part in (element, *element) if part in boxes]:
                boxes[element] = np.reshape(box_around(np.array(inside)), (2, 2))
            if _is_layered(element) and inside:
                layers += float(np.prod(boxes[element][1] - boxes[element][0]))
                if layers > MAX_LAYERS:
                    raise InputError(
                        f"has more than {MAX_LAYERS} clips, masks and opacities of the size of the page; "
                        "flatten it in the drawing program"
                    )
        elif element not in efforts and element not in around:
            around.add(element)
            stack += [(element, True), *((part, False) for part in inner)]
    return max(_LEAST_SIDE, round(RENDERED_SIDE * min(1.0, math.sqrt(_EASY / max(layers, 1.0)))))


def _corners_of(shape: PaintedShape, window: Box) -> Floats:
    """Top left and bottom right corner (2, 2) of a shape as shares of the window, within it."""
    corners = (np.reshape(box_around(shape.points), (2, 2)) - window[:2]) / window[2:]
    room = shape.width / max(window[2:])
    return np.asarray(np.clip([corners[0] - room, corners[1] + room], 0, 1))


def _is_layered(element: Element) -> bool:
    style = element.get("style", "")
    return any(name in style or name in element.attrib for name in _LAYERED)


def _drawn_references(element: Element, named: Mapping[str, Element]) -> Iterator[Element]:
    """The clips, masks, patterns and copies that an element draws."""
    texts = [element.get(key, "") for key in ("style", "clip-path", "mask", "fill", "stroke")]
    if tag_of(element) == "use":
        texts += [f"url({element.get(key, '')})" for key in HREFS]
    for text in texts:
        for name in re.findall(r"url\(\s*['\"]?#([^'\")]*)", text) if "url(" in text else ():
            target = named.get(name)
            if target is not None and not tag_of(target).endswith("Gradient"):
                yield target
