"""Reading SVG drawings: the outlines of everything that is painted, as cubic Beziers.

svgelements knows the grammars of path data, transforms, lengths and colours. The document itself is walked here: what it leaves
to a browser (style sheets at any place and in any order, `use` of symbols, invisible parts) decides which strokes there are. The
bytes first pass defusedxml, which refuses entities; nothing outside the file is ever loaded: pictures and `use` of other files are left
out. Clip paths, masks, dashes and text are not looked at.

What counts as a stroke: the path of every shape with a visible `stroke`; and the outline of a shape that is only filled, since drawing programs
export strokes as filled outlines. White (paper) counts as invisible.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final
from xml.etree.ElementTree import Element, ParseError

import numpy as np

from .curves import Curves, lines_as_cubics
from .elementary import turned
from .errors import InputError
from .grid import Floats
from .ink import is_paper, is_red

MAX_ELEMENTS: Final = 100_000
"""Elements drawn, those repeated by `use` counted each time."""
MAX_USES: Final = 10_000
"""Copies made by `use`."""
MAX_DATA: Final = 10_000_000
"""Characters of path data and point lists."""
_GREATEST: Final = 1e9
_PPI: Final = 96.0  # CSS pixels per inch
_SVG: Final = "http://www.w3.org/2000/svg"
_HREFS: Final = ("href", "{http://www.w3.org/1999/xlink}href")
_CONTAINERS: Final = frozenset({"g", "a", "svg", "switch"})
_SHAPES: Final = {
    "path": "Path",
    "polyline": "Polyline",
    "polygon": "Polygon",
    "line": "SimpleLine",
    "circle": "Circle",
    "ellipse": "Ellipse",
    "rect": "Rect",
}
_INHERITED: Final = (
    "stroke",
    "fill",
    "visibility",
    "color",
    "stroke-width",
    "stroke-opacity",
    "fill-opacity",
)
_START: Final = {"stroke": "none", "fill": "black", "visibility": "visible", "color": "black"}
_COMMENT: Final = re.compile(r"/\*.*?\*/|<!--|-->", re.DOTALL)
_AT_RULE: Final = re.compile(r"@[^{};]*(;|\{(?:[^{}]|\{[^{}]*\})*\})")
_RULE: Final = re.compile(r"([^{}]+)\{([^{}]*)\}")
_SIMPLE_SELECTOR: Final = re.compile(r"(\*|[A-Za-z][\w-]*)?((?:[.#][\w-]+)*)")


@dataclass(frozen=True)
class _Rule:
    """One style rule with a simple selector: tag (or empty), id (or empty), classes."""

    tag: str
    id: str
    classes: frozenset[str]
    properties: Mapping[str, str]

    @property
    def rank(self) -> tuple[bool, int, bool]:
        return bool(self.id), len(self.classes), bool(self.tag)

    def fits(self, tag: str, attributes: Mapping[str, str]) -> bool:
        return (
            self.tag in ("", tag)
            and self.id in ("", attributes.get("id"))
            and (not self.classes or self.classes <= set(attributes.get("class", "").split()))
        )


@dataclass(frozen=True)
class _Place:
    """An element to visit: its inherited style, its transform, and how deep in `use` it is."""

    element: Element
    style: Mapping[str, str]
    matrix: Any
    uses: tuple[str, ...]


def read_svg(data: bytes) -> Curves:
    """The strokes of an SVG drawing in the units of its viewBox.

    Raises InputError for malformed or unsafe XML, damaged path data, too many elements, and when nothing is drawn.
    """
    root = _parsed(data)
    if _tag(root) != "svg":
        raise InputError(
            f"its root element is <{root.tag.split('}')[-1][:30]}>, not <svg>; expected an SVG drawing"
        )
    canvas = _canvas(root)
    shapes = list(_shapes(root))
    cubics = [_cubics(shape, canvas) for shape in shapes]
    count = [len(each) for each in cubics]
    if sum(count) == 0:
        raise InputError(
            "draws no stroke: no visible path, line or shape was found; export the drawing with its strokes"
        )
    red = is_red(np.array([_paint(shape.style) for shape in shapes]))
    return Curves(np.concatenate(cubics), np.repeat(red, count), canvas)


def _parsed(data: bytes) -> Element:
    from defusedxml.common import DefusedXmlException
    from defusedxml.ElementTree import fromstring

    try:
        root: Element = fromstring(data, forbid_dtd=False, forbid_entities=True, forbid_external=True)
    except DefusedXmlException as error:
        raise InputError(
            "declares XML entities, which are not read for safety; save it as plain SVG"
        ) from error
    except (ParseError, ValueError, LookupError, RecursionError) as error:
        raise InputError(f"is not well-formed XML: {error}; save the drawing again") from error
    return root


def _shapes(root: Element) -> Iterator[_Place]:
    """Every visible shape with its final style and transform, in drawing order."""
    from svgelements import Matrix

    rules = _rules(root)
    named = {element.get("id", ""): element for element in reversed(list(root.iter()))}
    stack = [_Place(root, _START, Matrix(), ())]
    visited = used = characters = 0
    while stack:
        place = _styled(stack.pop(), rules)
        tag, element = _tag(place.element), place.element
        visited += 1
        characters += len(element.get("d", "")) + len(element.get("points", ""))
        if visited > MAX_ELEMENTS or characters > MAX_DATA:
            raise InputError(
                f"draws more than {MAX_ELEMENTS} elements or {MAX_DATA} characters of paths; simplify the drawing"
            )
        if _hidden(place.style):
            continue
        if tag in _SHAPES and _painted(place.style):
            yield place
        elif tag in _CONTAINERS:
            inner = _view(place, element) if element is not root else place.matrix
            stack += [_Place(child, place.style, inner, place.uses) for child in reversed(element)]
        elif tag == "use":
            used += 1
            if used > MAX_USES:
                raise InputError(
                    f"draws more than {MAX_USES} <use> elements; expand them in the drawing program"
                )
            stack += _used(place, named)


def _styled(place: _Place, rules: list[_Rule]) -> _Place:
    """The place with the element's own style and transform applied."""
    from svgelements import Matrix

    attributes, tag = place.element.attrib, _tag(place.element)
    own = {
        key: value.strip()
        for key, value in attributes.items()
        if key in (*_INHERITED, "display", "opacity", "transform")
    }
    for rule in rules:
        if rule.fits(tag, attributes):
            own |= rule.properties
    own |= _properties(attributes.get("style", ""))
    inherited = {key: place.style[key] for key in _INHERITED if key in place.style}
    style = inherited | {key: value for key, value in own.items() if value != "inherit"}
    matrix = place.matrix
    if own.get("transform"):
        try:
            matrix = Matrix(own["transform"]) * matrix
        except (ValueError, TypeError, IndexError) as error:
            raise InputError(
                f"{_named(place.element)}: its transform {own['transform'][:40]!r} cannot be read"
            ) from error
    return _Place(place.element, style, matrix, place.uses)


def _used(place: _Place, named: Mapping[str, Element]) -> list[_Place]:
    """What a `use` element stands for; nothing when it points into another file or at itself."""
    from svgelements import Matrix

    element = place.element
    link = next((element.get(key, "") for key in _HREFS if key in element.attrib), "")
    target = named.get(link[1:]) if link.startswith("#") else None
    if target is None or link in place.uses:
        return []
    moved = Matrix.translate(_length(element, "x", 0.0), _length(element, "y", 0.0)) * place.matrix
    uses = (*place.uses, link)
    if _tag(target) != "symbol":
        return [_Place(target, place.style, moved, uses)]
    inner = _view(_Place(element, place.style, moved, uses), target)
    return [_Place(child, place.style, inner, uses) for child in reversed(target)]


def _view(place: _Place, element: Element) -> Any:
    """The transform inside an inner svg or a symbol: its viewBox fitted into its width and height, centred."""
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


def _cubics(place: _Place, canvas: tuple[float, float, float, float] | None) -> Floats:
    """Control points (k, 4, 2) of a shape in the units of the root."""
    path = _path(place.element, canvas)
    lines: list[tuple[complex, ...]] = []
    cubics: list[tuple[complex, ...]] = []
    for segment in path:
        _collect(segment, lines, cubics)
    straight, curved = _as_points(lines, 2), _as_points(cubics, 4)
    m = place.matrix
    with np.errstate(over="ignore", invalid="ignore"):
        points = np.concatenate([lines_as_cubics(straight[:, 0], straight[:, 1]), curved])
        turn, shift = np.array([[m.a, m.c], [m.b, m.d]], dtype=float), np.array([m.e, m.f], dtype=float)
        placed: Floats = turned(points, turn) + shift
    if not (np.abs(placed) <= _GREATEST).all():
        raise InputError(f"{_named(place.element)}: a coordinate is not a finite number below {_GREATEST:g}")
    drawn: Floats = placed[(placed != placed[:, :1]).any(axis=(1, 2))]
    return drawn


def _path(element: Element, canvas: tuple[float, float, float, float] | None) -> Any:
    """The svgelements path of a shape, its own transform left out. Raises InputError when its numbers are damaged."""
    import svgelements

    kind = getattr(svgelements, _SHAPES[_tag(element)])
    values = {
        key: value for key, value in element.attrib.items() if key not in ("transform", "style", "class")
    }
    _, _, width, height = canvas or (0.0, 0.0, 100.0, 100.0)
    try:
        shape = kind(values)
        shape.render(ppi=_PPI, width=width, height=height)
        return svgelements.Path(shape)
    except (ValueError, TypeError, IndexError, AttributeError, ZeroDivisionError, OverflowError) as error:
        raise InputError(
            f"{_named(element)}: its numbers cannot be read; export the drawing again"
        ) from error


def _collect(segment: Any, lines: list[tuple[complex, ...]], cubics: list[tuple[complex, ...]]) -> None:
    """Adds a path segment to the straight or the curved ones."""
    import svgelements

    if isinstance(segment, svgelements.Line | svgelements.Close):
        if segment.start is not None and segment.end is not None:
            lines.append((complex(segment.start), complex(segment.end)))
    elif isinstance(segment, svgelements.CubicBezier):
        cubics.append(
            tuple(complex(p) for p in (segment.start, segment.control1, segment.control2, segment.end))
        )
    elif isinstance(segment, svgelements.QuadraticBezier):
        start, control, end = (complex(p) for p in (segment.start, segment.control, segment.end))
        cubics.append((start, (start + 2 * control) / 3, (end + 2 * control) / 3, end))
    elif isinstance(segment, svgelements.Arc):
        for curve in segment.as_cubic_curves():
            _collect(curve, lines, cubics)


def _as_points(rows: list[tuple[complex, ...]], width: int) -> Floats:
    values = np.array(rows, dtype=complex).reshape(-1, width)
    return np.stack([values.real, values.imag], axis=-1)


def _hidden(style: Mapping[str, str]) -> bool:
    return style.get("display") == "none" or _number(style.get("opacity")) == 0


def _painted(style: Mapping[str, str]) -> bool:
    """True when a shape shows: a stroke or a fill that is neither none, transparent, nor white like paper."""
    return style["visibility"] not in ("hidden", "collapse") and not bool(
        is_paper(np.array([_paint(style)]))[0]
    )


def _paint(style: Mapping[str, str]) -> tuple[float, float, float]:
    """Red, green, blue in [0, 1] of the stroke, or of the fill when there is no stroke; white when there is neither."""
    for kind in ("stroke", "fill"):
        colour = style[kind]
        colour = style["color"] if colour.lower() == "currentcolor" else colour
        seen = _number(style.get(f"{kind}-opacity")) != 0 and not (
            kind == "stroke" and _number(style.get("stroke-width")) == 0
        )
        if seen and colour.lower() not in ("none", "transparent"):
            return _rgb(colour)
    return 1.0, 1.0, 1.0


@lru_cache(maxsize=1024)
def _rgb(colour: str) -> tuple[float, float, float]:
    """The colour on white paper; black for gradients and for what cannot be read."""
    from svgelements import Color

    try:
        parsed = Color(colour)
        alpha = parsed.alpha / 255
        red, green, blue = (
            1 - alpha * (1 - channel / 255) for channel in (parsed.red, parsed.green, parsed.blue)
        )
    except (ValueError, TypeError):
        return 0.0, 0.0, 0.0
    return red, green, blue


def _rules(root: Element) -> list[_Rule]:
    """The style rules of the document with simple selectors, weakest first."""
    rules = []
    for element in root.iter():
        if _tag(element) == "style":
            text = _AT_RULE.sub("", _COMMENT.sub(" ", "".join(element.itertext())))
            for selectors, body in _RULE.findall(text):
                rules += [rule for selector in selectors.split(",") for rule in _rule(selector.strip(), body)]
    return sorted(rules, key=lambda rule: rule.rank)


def _rule(selector: str, body: str) -> list[_Rule]:
    """The rule, or nothing when its selector depends on other elements."""
    match = _SIMPLE_SELECTOR.fullmatch(selector)
    if not selector or match is None:
        return []
    marks = re.findall(r"[.#][\w-]+", match[2])
    ids = [mark[1:] for mark in marks if mark[0] == "#"]
    classes = frozenset(mark[1:] for mark in marks if mark[0] == ".")
    return [_Rule((match[1] or "").replace("*", ""), ids[0] if ids else "", classes, _properties(body))]


def _properties(text: str) -> dict[str, str]:
    pairs = (declaration.partition(":") for declaration in text.split(";"))
    return {
        key.strip().lower(): value.replace("!important", "").strip() for key, colon, value in pairs if colon
    }


def _canvas(root: Element) -> tuple[float, float, float, float] | None:
    """The viewBox, or else width and height from (0, 0), or None."""
    box = _view_box(root)
    if box is not None:
        return box
    width, height = _length(root, "width", 0.0), _length(root, "height", 0.0)
    return (0.0, 0.0, width, height) if width > 0 and height > 0 else None


def _view_box(element: Element) -> tuple[float, float, float, float] | None:
    fields = re.split(r"[\s,]+", element.get("viewBox", "").strip())
    if fields == [""]:
        return None
    try:
        x, y, width, height = (float(field) for field in fields)
    except ValueError as error:
        raise InputError(
            f"{_named(element)}: its viewBox {element.get('viewBox', '')[:40]!r} is not four numbers"
        ) from error
    if not (np.isfinite([x, y, width, height]).all() and width > 0 and height > 0):
        raise InputError(f"{_named(element)}: its viewBox {element.get('viewBox', '')[:40]!r} has no area")
    return x, y, width, height


def _length(element: Element, key: str, default: float) -> float:
    """A length in CSS pixels; `default` when it is missing, a percentage or unreadable."""
    from svgelements import Length

    text = element.get(key, "")
    if not text or text.endswith("%"):
        return default
    try:
        value = float(Length(text).value(ppi=_PPI))
    except (ValueError, TypeError, AttributeError):
        return default
    return value if np.isfinite(value) else default


def _number(text: str | None) -> float:
    """The number that a style value starts with; 1 when there is none."""
    match = re.match(r"[+-]?(?:\d+\.?\d*|\.\d+)", text or "")
    return float(match[0]) if match else 1.0


def _tag(element: Element) -> str:
    """The tag of an SVG element without its namespace; empty for elements of other languages."""
    space, _, tag = element.tag.rpartition("}")
    return tag if space in ("", "{" + _SVG) else ""


def _named(element: Element) -> str:
    name = element.get("id")
    return f"<{_tag(element)}" + (f' id="{name[:40]}">' if name else ">")
