"""Reader of SVG drawings: the outlines of everything that is painted, as cubic Beziers.

svgelements parses path data, transforms and lengths, tinycss2 style sheets and colours. Each element is
parsed once, for any number of uses, and the work is bounded by the limits of `input_limits`. The bytes first
pass defusedxml, which refuses entities. Pictures and `use` of other files are never loaded. Clip paths,
masks, dashes and text are ignored. Shapes that are only filled count as strokes, because drawing programs
export strokes as filled outlines; white (paper) counts as invisible.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, Final
from xml.etree.ElementTree import Element, ParseError

import numpy as np

from ..errors import InputError
from ..input_limits import (
    LEAST_LENGTH,
    MAX_CURVES,
    MAX_DATA,
    MAX_ELEMENTS,
    MAX_LENGTH,
    MAX_TAGS,
    MAX_TRANSFORM,
    MAX_USE_DEPTH,
    MAX_USES,
)
from ..instance.angles import transform_vectors
from ..instance.domain import Floats
from .colour import is_paper, is_red
from .cover import Box
from .curves import Curves, run_numbers
from .labels import LabelMatcher, colour_label
from .path_data import SHAPES, length_in_pixels, shape_curves, too_many_curves
from .style_sheet import KNOWN, PAINT, StyleSheet, style_properties, style_sheet

_GREATEST: Final = 1e9
_SVG: Final = "http://www.w3.org/2000/svg"
_INKSCAPE: Final = "{http://www.inkscape.org/namespaces/inkscape}"
_HREFS: Final = ("href", "{http://www.w3.org/1999/xlink}href")
_CONTAINERS: Final = frozenset({"g", "a", "svg", "switch"})
_START: Final = {"stroke": "none", "fill": "black", "visibility": "visible", "color": "black"}


@dataclass(frozen=True)
class _Visit:
    """An element to visit. chosen: whether it, or an element around it, has a chosen label."""

    element: Element
    style: Mapping[str, str]
    matrix: Any
    uses: tuple[str, ...]
    chosen: bool = False


def read_svg(data: bytes, matcher: LabelMatcher | None = None) -> Curves:
    """Read the strokes of an SVG drawing in the units of its viewBox. Raises InputError.

    matcher: matches the labels of curvature lines; None: colours decide.
    """
    root = _parse_xml(data)
    if _tag(root) != "svg":
        tag = root.tag.split("}")[-1][:30]
        raise InputError(f"its root element is <{tag}>, not <svg>; expected an SVG drawing")
    page = _page_of(root)
    texts = ("".join(element.itertext()) for element in root.iter() if _tag(element) == "style")
    walk = _ElementWalk(style_sheet(texts), page, matcher)
    shapes = list(walk.shapes(root))
    if not sum(len(points) for _, points, _ in shapes):
        raise InputError("draws no stroke: it has no visible path, line or shape; export it again")
    paints, outlines, taken = zip(*shapes, strict=True)
    red, points = is_red(np.array(paints)), np.concatenate(outlines)
    shape = np.repeat(np.arange(len(shapes), dtype=np.int32), [len(points) for points in outlines])
    chosen = None
    if matcher is not None:
        chosen = np.array(taken)[shape]
        matcher.check(any_stroke=bool(chosen.any()))
    return Curves(points, run_numbers(points, shape), red[shape], page, chosen)


def _parse_xml(data: bytes) -> Element:
    from defusedxml.common import DefusedXmlException
    from defusedxml.ElementTree import fromstring

    if data.count(b"<") + data.count(b"=") > MAX_TAGS:
        raise InputError(f"has more than {MAX_TAGS} tags and attributes; simplify the drawing")
    try:
        root: Element = fromstring(data, forbid_dtd=False, forbid_entities=True, forbid_external=True)
    except DefusedXmlException as error:
        raise InputError("declares XML entities, which are unsafe; save it as plain SVG") from error
    except (ParseError, ValueError, LookupError, RecursionError) as error:
        raise InputError(f"is not well-formed XML: {error}; save the drawing again") from error
    return root


@dataclass(eq=False)
class _ElementWalk:
    """A walk through a drawing. Results that depend only on an element are computed once for all its uses."""

    sheet: StyleSheet
    page: Box | None
    matcher: LabelMatcher | None
    styles: dict[Element, tuple[Mapping[str, str], Any, bool]] = field(default_factory=dict)
    outlines: dict[Element, Floats] = field(default_factory=dict)

    visited: int = 0
    used: int = 0
    characters: int = 0
    curves: int = 0

    def shapes(self, root: Element) -> Iterator[tuple[tuple[float, float, float], Floats, bool]]:
        """Every visible shape in drawing order: colour, control points in the root's units, if chosen."""
        from svgelements import Matrix

        named = {element.get("id", ""): element for element in reversed(list(root.iter()))}
        stack = [_Visit(root, _START, Matrix(), ())]
        while stack:
            place = self._apply_style(stack.pop())
            tag, element = _tag(place.element), place.element
            self.visited += 1
            if self.visited > MAX_ELEMENTS:
                raise InputError(f"draws more than {MAX_ELEMENTS} elements; simplify the drawing")
            if place.style.get("display") == "none" or _number(place.style.get("opacity")) == 0:
                continue
            if tag in SHAPES:
                paint = _paint(place.style)
                if not (place.style["visibility"] in ("hidden", "collapse") or is_paper(np.array(paint))):
                    painted = self.matcher is not None and self.matcher.matches([colour_label(paint)])
                    yield paint, self._place_shape(place), painted or place.chosen
            elif tag in _CONTAINERS:
                inner = _view(place, element) if element is not root else place.matrix
                stack += [replace(place, element=child, matrix=inner) for child in reversed(element)]
            elif tag == "use":
                stack += self._follow_use(place, named)

    def _apply_style(self, place: _Visit) -> _Visit:
        """The place with the element's own style and transform applied."""
        element = place.element
        if element not in self.styles:
            self.characters += sum(len(element.get(key, "")) for key in ("d", "points", "style", "transform"))
            if self.characters > MAX_DATA:
                raise InputError(
                    f"has more than {MAX_DATA} characters of paths, styles and transforms; "
                    "simplify the drawing"
                )
            style = _own_style(element, self.sheet)
            taken = self.matcher is not None and self.matcher.matches(_labels(element))
            self.styles[element] = style, _transform(element, style), taken
        changes, transform, taken = self.styles[element]
        inherited = {key: place.style[key] for key in PAINT if key in place.style}
        style = inherited | {key: value for key, value in changes.items() if value != "inherit"}
        matrix = place.matrix if transform is None else transform * place.matrix
        return _Visit(element, style, matrix, place.uses, taken or place.chosen)

    def _follow_use(self, place: _Visit, named: Mapping[str, Element]) -> list[_Visit]:
        """The elements that a `use` refers to; none when it points into another file or at itself."""
        from svgelements import Matrix

        self.used += 1
        if self.used > MAX_USES:
            raise InputError(f"draws more than {MAX_USES} <use> elements; expand them in the drawing program")
        element = place.element
        link = next((element.get(key, "") for key in _HREFS if key in element.attrib), "")
        target = named.get(link[1:]) if link.startswith("#") else None
        if target is None or link in place.uses:
            return []
        if len(place.uses) == MAX_USE_DEPTH:
            raise InputError(f"has <use> elements nested more than {MAX_USE_DEPTH} deep; expand them")
        moved = Matrix.translate(_length(element, "x", 0.0), _length(element, "y", 0.0)) * place.matrix
        uses = (*place.uses, link)
        used = replace(place, matrix=moved, uses=uses)
        if _tag(target) != "symbol":
            return [replace(used, element=target)]
        inner = _view(used, target)
        return [replace(used, element=child, matrix=inner) for child in reversed(target)]

    def _place_shape(self, place: _Visit) -> Floats:
        """Control points (k, 4, 2) of a shape in the units of the root."""
        if place.element not in self.outlines:
            size = self.page[2:] if self.page else (100.0, 100.0)
            try:
                points = shape_curves(_tag(place.element), place.element.attrib, size)
            except InputError as error:
                raise InputError(f"{_name_of(place.element)}: {error}") from error
            self.outlines[place.element] = points
        points, m = self.outlines[place.element], place.matrix
        self.curves += len(points)
        if self.curves > MAX_CURVES:
            raise too_many_curves()
        with np.errstate(over="ignore", invalid="ignore"):
            turn, shift = np.array([[m.a, m.c], [m.b, m.d]], dtype=float), np.array([m.e, m.f], dtype=float)
            placed: Floats = transform_vectors(points, turn) + shift
        if not (np.abs(placed) <= _GREATEST).all():
            raise InputError(
                f"{_name_of(place.element)}: a coordinate is not a finite number below {_GREATEST:g}"
            )
        return np.asarray(placed[(placed != placed[:, :1]).any(axis=(1, 2))])


def _labels(element: Element) -> Iterator[str]:
    """Labels of the strokes in an element: its id, its classes, its name as a layer of Inkscape."""
    if identifier := element.get("id"):
        yield f"id={identifier}"
    for name in element.get("class", "").split():
        yield f"class={name}"
    if element.get(_INKSCAPE + "groupmode") == "layer":
        yield f"layer={element.get(_INKSCAPE + 'label', '').strip()}"


def _own_style(element: Element, sheet: StyleSheet) -> dict[str, str]:
    """The element's own style: attributes, style sheets and its `style`, of increasing priority."""
    attributes = element.attrib
    presentation = {key: value.strip() for key, value in attributes.items() if key in KNOWN}
    by_sheet = sheet.properties(_tag(element), attributes.get("id", ""), attributes.get("class", ""))
    return {**presentation, **by_sheet, **style_properties(attributes.get("style", ""))}


def _transform(element: Element, style: Mapping[str, str]) -> Any:
    """The matrix of an element's own transform, None without one. Raises InputError."""
    from svgelements import Matrix

    text = style.get("transform", "")
    if not text:
        return None
    if len(text) > MAX_TRANSFORM:
        raise InputError(
            f"{_name_of(element)}: its transform has more than {MAX_TRANSFORM} characters; simplify it"
        )
    try:
        return Matrix(text)
    except (ValueError, TypeError, IndexError, AttributeError, ArithmeticError) as error:
        raise InputError(f"{_name_of(element)}: its transform {text[:40]!r} cannot be read") from error


def _view(place: _Visit, element: Element) -> Any:
    """The transform inside an inner svg or symbol: its viewBox centred in its width and height."""
    from svgelements import Matrix

    if _tag(element) not in ("svg", "symbol"):
        return place.matrix
    corner = Matrix.translate(_length(element, "x", 0.0), _length(element, "y", 0.0)) * place.matrix
    box = _view_box(element)
    if box is None:
        return corner
    x, y, width, height = box
    wide, high = _length(place.element, "width", width), _length(place.element, "height", height)
    scale = min(wide / width, high / height)
    centre = Matrix.translate((wide - scale * width) / 2, (high - scale * height) / 2)
    return Matrix.translate(-x, -y) * Matrix.scale(scale) * centre * corner


def _paint(style: Mapping[str, str]) -> tuple[float, float, float]:
    """Red, green, blue in [0, 1] of the stroke, else of the fill; white without either."""
    for kind in ("stroke", "fill"):
        colour = style[kind]
        colour = style["color"] if colour.lower() == "currentcolor" else colour
        numbers = ("stroke-opacity", "stroke-width") if kind == "stroke" else ("fill-opacity",)
        seen = all(_number(style.get(name)) != 0 for name in numbers)
        if seen and colour.lower() not in ("none", "transparent"):
            return _colour_on_paper(colour)
    return 1.0, 1.0, 1.0


@lru_cache(maxsize=1024)
def _colour_on_paper(colour: str) -> tuple[float, float, float]:
    """The colour on white paper; black for gradients and for unreadable colours."""
    from tinycss2.color4 import parse_color

    parsed = parse_color(colour) if len(colour) <= MAX_LENGTH else None
    if parsed is None or isinstance(parsed, str):
        return 0.0, 0.0, 0.0
    try:
        channels = parsed.to("srgb").coordinates
    except NotImplementedError:  # of Lab and its kin
        return 0.0, 0.0, 0.0
    red, green, blue = (1 - parsed.alpha * (1 - min(max(channel, 0.0), 1.0)) for channel in channels)
    return red, green, blue


def _page_of(root: Element) -> Box | None:
    """The viewBox, or else width and height from (0, 0), or None."""
    box = _view_box(root)
    if box is not None:
        return box
    width, height = _length(root, "width", 0.0), _length(root, "height", 0.0)
    return (0.0, 0.0, width, height) if min(width, height) >= LEAST_LENGTH else None


def _view_box(element: Element) -> Box | None:
    fields = re.split(r"[\s,]+", element.get("viewBox", "").strip())
    if fields == [""]:
        return None
    try:
        x, y, width, height = (float(field) for field in fields)
    except ValueError as error:
        raise InputError(
            f"{_name_of(element)}: its viewBox {element.get('viewBox', '')[:40]!r} is not four numbers"
        ) from error
    if not (np.abs([x, y, width, height]) <= _GREATEST).all() or min(width, height) < LEAST_LENGTH:
        raise InputError(f"{_name_of(element)}: its viewBox {element.get('viewBox', '')[:40]!r} has no area")
    return x, y, width, height


def _length(element: Element, key: str, default: float) -> float:
    """A length in CSS pixels; `default` when it is missing, a percentage or unreadable."""
    pixels = length_in_pixels(element.get(key, ""))
    return default if pixels is None else pixels


def _number(text: str | None) -> float:
    """The number at the start of a style value; 1 without one."""
    match = re.match(r"[+-]?(?:\d+\.?\d*|\.\d+)", text or "")
    return float(match[0]) if match else 1.0


def _tag(element: Element) -> str:
    """The tag of an SVG element without its namespace; empty for elements of other languages."""
    space, _, tag = element.tag.rpartition("}")
    return tag if space in ("", "{" + _SVG) else ""


def _name_of(element: Element) -> str:
    name = element.get("id")
    return f"<{_tag(element)}" + (f' id="{name[:40]}">' if name else ">")
