"""The outlines of SVG shapes: path data, point lists and basic shapes as straight lines and cubic Beziers.

svgelements parses path data, arcs and basic shapes. Its own paths take time that grows with the square of
their length, so its lexer draws on an outline of this module.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, Final

import numpy as np

from ..errors import InputError, shortened
from ..input_limits import MAX_CURVES, MAX_LENGTH
from ..instance.domain import Floats
from .curves import lines_as_cubics

PPI: Final = 96.0  # CSS pixels per inch
EM: Final = 16.0  # CSS pixels per letter, unless the drawing chooses another font
_BASIC: Final = {
    "line": ("SimpleLine", ("x1", "y1", "x2", "y2")),
    "circle": ("Circle", ("cx", "cy", "r")),
    "ellipse": ("Ellipse", ("cx", "cy", "rx", "ry")),
    "rect": ("Rect", ("x", "y", "width", "height", "rx", "ry")),
}
SHAPES: Final = frozenset({"path", "polyline", "polygon", *_BASIC})
_ABSENT: Final = {"rect": ("width", "height"), "circle": ("r",), "ellipse": ("rx", "ry")}
"""Sizes that are 0 where a shape does not state them; svgelements would take 1."""
_SIZES: Final = frozenset({"r", "rx", "ry", "width", "height"})  # lengths that cannot be negative
_QUOTED: Final = 20  # characters of faulty data that are quoted
_ALIEN: Final = re.compile(r"[^-+.\d\seE,]")  # in a list of points
_NUMBER: Final = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")

_Coordinates = tuple[float, float] | str
"""A point, or the letter that closes the subpath in place of its last point."""


def shape_curves(
    tag: str, attributes: Mapping[str, str], page: tuple[float, float]
) -> tuple[Floats, str | None]:
    """Control points (k, 4, 2) of a shape in its own units, and what is faulty in it.

    As in browsers, a path ends where its data cannot be read, and a shape with a faulty length is left out.
    Percentages refer to the page. Raises InputError for too many curves.
    """
    if tag in ("polyline", "polygon"):
        return _polygon_lines(attributes.get("points", ""), closed=tag == "polygon")
    drawn = _PathBuilder()
    with np.errstate(over="ignore", invalid="ignore"):  # left out when placed
        if tag == "path":
            fault = _trace_path(attributes.get("d", ""), drawn)
        else:
            fault = _trace_basic(tag, attributes, page, drawn)
        return drawn.points(), fault


def length_in_pixels(text: str) -> float | None:
    """A length in CSS pixels, None for a percentage and for unreadable text."""
    from svgelements import Length

    if not text or text.endswith("%") or len(text) > MAX_LENGTH:
        return None
    try:
        value = Length(text).value(ppi=PPI, font_size=EM, font_height=EM)
    except (ValueError, TypeError, AttributeError):
        return None
    return value if isinstance(value, float) and np.isfinite(value) else None


def _trace_path(data: str, drawn: _PathBuilder) -> str | None:
    """Draw path data as far as it can be read, and return what is faulty in it."""
    from svgelements import SVGLexicalParser

    data = data.strip()
    if data in ("", "none"):
        return None
    if data[0] not in "Mm":
        return f"its path data begins with {shortened(data, _QUOTED)!r}, not with a move (M)"
    lexer = SVGLexicalParser()
    try:
        lexer.parse(drawn, data)
    except (ValueError, TypeError, IndexError, AttributeError, ArithmeticError):
        lexer.pos = min(lexer.pos, len(data) - 1)
    if lexer.pos == len(data):
        return None
    return f"its path data is faulty near {shortened(data[max(lexer.pos - 9, 0) :], _QUOTED)!r}"


def _polygon_lines(text: str, *, closed: bool) -> tuple[Floats, str | None]:
    """The lines between points as far as they can be read, and what is faulty in these."""
    alien = _ALIEN.search(text)
    numbers = np.array(_NUMBER.findall(text[: alien.start()] if alien else text), dtype=float)
    points = numbers[: len(numbers) // 2 * 2].reshape(-1, 2)
    if len(points) > MAX_CURVES:
        raise too_many_curves()
    if closed:
        points = np.concatenate([points, points[:1]])
    fault = None
    if alien:
        fault = f"its points cannot be read from {shortened(text[alien.start() :], _QUOTED)!r} on"
    elif len(numbers) % 2:
        fault = "its last point has no y"
    return lines_as_cubics(points[:-1], points[1:]), fault


def _trace_basic(
    tag: str, attributes: Mapping[str, str], page: tuple[float, float], drawn: _PathBuilder
) -> str | None:
    """Draw a basic shape, unless it is faulty; return what is."""
    import svgelements

    kind, keys = _BASIC[tag]
    texts = {key: attributes[key] for key in keys if attributes.get(key)}
    lengths = {key: _parse_length(text) for key, text in texts.items()}
    for key, length in lengths.items():
        if length is None:
            return f"its {key} {shortened(texts[key], _QUOTED)!r} cannot be read"
        if key in _SIZES and str(length).startswith("-"):
            return f"its {key} is {shortened(texts[key], _QUOTED)}"
    if tag == "ellipse" and len(lengths.keys() & _SIZES) == 1:
        lengths["rx"] = lengths["ry"] = lengths.get("rx", lengths.get("ry"))
    shape = getattr(svgelements, kind)({**dict.fromkeys(_ABSENT.get(tag, ()), 0), **lengths})
    shape.render(ppi=PPI, width=page[0], height=page[1])
    for segment in shape.segments():
        drawn.add(segment)
    return None


def _parse_length(length: str) -> str | float | None:
    """A length in pixels, or the percentage; None if it cannot be read."""
    if not length.endswith("%"):
        return length_in_pixels(length)
    return length if _NUMBER.fullmatch(length[:-1].strip()) else None


def too_many_curves() -> InputError:
    """The error for a drawing with more than MAX_CURVES segments."""
    return InputError(f"draws more than {MAX_CURVES} segments of curves, with <use>; simplify the drawing")


@dataclass(eq=False)
class _PathBuilder:
    """The target of svgelements' lexer: cubics, in the order of the path, as points of the complex plane.

    A straight line has its control points at its ends. smooth: the kind of the last curve (2: quadratic,
    3: cubic) and its last control point.
    """

    cubics: list[tuple[complex, complex, complex, complex]] = field(default_factory=list)
    here: complex = 0j
    begin: complex = 0j
    smooth: tuple[int, complex] = (0, 0j)

    @property
    def current_point(self) -> SimpleNamespace:
        return SimpleNamespace(x=self.here.real, y=self.here.imag)

    def points(self) -> Floats:
        """Control points (k, 4, 2)."""
        values = np.array(self.cubics, dtype=complex).reshape(-1, 4)
        cubics: Floats = np.stack([values.real, values.imag], axis=-1)
        straight = (values[:, 0] == values[:, 1]) & (values[:, 2] == values[:, 3])
        cubics[straight] = lines_as_cubics(cubics[straight, 0], cubics[straight, 3])
        return cubics

    def start(self) -> None:
        pass

    def end(self) -> None:
        pass

    def move(self, point: _Coordinates, **_: bool) -> None:
        self.here = self.begin = self._at(point)
        self.smooth = (0, 0j)

    def line(self, point: _Coordinates, **_: bool) -> None:
        end = self._at(point)
        self._curve(self.here, end, end)
        self.smooth = (0, 0j)

    def horizontal(self, x: float, *, relative: bool) -> None:
        self.line((x + self.here.real * relative, self.here.imag))

    def vertical(self, y: float, *, relative: bool) -> None:
        self.line((self.here.real, y + self.here.imag * relative))

    def closed(self, **_: bool) -> None:
        self.line("z")

    def cubic(self, first: _Coordinates, second: _Coordinates, point: _Coordinates, **_: bool) -> None:
        control, end = self._at(second), self._at(point)
        self._curve(self._at(first), control, end)
        self.smooth = (3, control)

    def smooth_cubic(self, second: _Coordinates, point: _Coordinates, **_: bool) -> None:
        first = self._reflected_control(3)
        self.cubic((first.real, first.imag), second, point)

    def quad(self, middle: _Coordinates, point: _Coordinates, **_: bool) -> None:
        control, end = self._at(middle), self._at(point)
        self._curve((self.here + 2 * control) / 3, (end + 2 * control) / 3, end)
        self.smooth = (2, control)

    def smooth_quad(self, point: _Coordinates, **_: bool) -> None:
        control = self._reflected_control(2)
        self.quad((control.real, control.imag), point)

    def arc(self, rx: float, ry: float, *others: Any, **_: bool) -> None:
        from svgelements import Arc

        rotation, large, sweep, point = others
        if large is None or sweep is None:
            raise ValueError("a flag of an arc is neither 0 nor 1")
        end = self._at(point)
        if rx == 0 or ry == 0:  # as in SVG
            self.line((end.real, end.imag))
        elif end != self.here:
            self.add(Arc(self.here, abs(rx), abs(ry), rotation, large, sweep, end))
        self.here, self.smooth = end, (0, 0j)

    def add(self, segment: Any) -> None:
        """Add a segment of svgelements that has its own start."""
        import svgelements

        if isinstance(segment, svgelements.Arc):
            for curve in segment.as_cubic_curves():
                self.add(curve)
        elif isinstance(segment, svgelements.CubicBezier):
            start, first, second, end = map(
                complex, (segment.start, segment.control1, segment.control2, segment.end)
            )
            self.here = start
            self._curve(first, second, end)
        elif isinstance(segment, svgelements.Linear):
            self.here, end = complex(segment.start), complex(segment.end)
            self._curve(self.here, end, end)

    def _curve(self, first: complex, second: complex, end: complex) -> None:
        if len(self.cubics) >= MAX_CURVES:
            raise too_many_curves()
        self.cubics.append((self.here, first, second, end))
        self.here = end

    def _reflected_control(self, kind: int) -> complex:
        """A smooth curve's first control point: the last one reflected after a curve of its kind."""
        return 2 * self.here - self.smooth[1] if self.smooth[0] == kind else self.here

    def _at(self, point: _Coordinates) -> complex:
        return self.begin if isinstance(point, str) else complex(*point)
