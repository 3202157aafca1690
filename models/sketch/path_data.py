"""The outlines of SVG shapes: path data, point lists and basic shapes as straight lines and cubic Beziers.

svgelements parses path data, arcs and basic shapes.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from ..errors import InputError, shortened
from ..input_limits import MAX_CURVES, MAX_LENGTH
from ..instance.domain import Floats
from .curves import lines_as_cubics, run_numbers

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

_Cubics = list[tuple[complex, complex, complex, complex]]


def shape_curves(
    tag: str, attributes: Mapping[str, str], page: tuple[float, float]
) -> tuple[Floats, str | None]:
    """Control points (k, 4, 2) of a shape in its own units, and what is faulty in it.

    As in browsers, a path ends where its data cannot be read, and a shape with a faulty length is left out.
    Percentages refer to the page. Raises InputError for too many curves.
    """
    if tag in ("polyline", "polygon"):
        return _polygon_lines(attributes.get("points", ""), closed=tag == "polygon")
    with np.errstate(over="ignore", invalid="ignore"):  # left out when placed
        if tag == "path":
            cubics, fault = _parse_path(attributes.get("d", ""))
        else:
            cubics, fault = _parse_basic(tag, attributes, page)
        values = np.array(cubics).reshape(-1, 4)
        points: Floats = np.stack([values.real, values.imag], axis=-1)
        straight = (values[:, 0] == values[:, 1]) & (values[:, 2] == values[:, 3])
        points[straight] = lines_as_cubics(points[straight, 0], points[straight, 3])
    return points, fault


def path_data(points: Floats) -> str:
    """Path data of cubics (k, 4, 2)."""
    run = run_numbers(points, np.zeros(len(points), dtype=np.int32))
    texts = ([f"{value:.9g}" for value in cubic] for cubic in points.reshape(-1, 8).tolist())
    return "".join(
        ("M" + " ".join(text[:2]) if is_start else "") + "C" + " ".join(text[2:])
        for text, is_start in zip(texts, np.diff(run, prepend=-1), strict=True)
    )


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


def _parse_path(data: str) -> tuple[_Cubics, str | None]:
    """The cubics of path data as far as it can be read, and what is faulty in it."""
    from svgelements import SVGLexicalParser

    data, path = data.strip(), _empty_path()
    if data in ("", "none"):
        return [], None
    if data[0] not in "Mm":
        return [], f"its path data begins with {shortened(data, _QUOTED)!r}, not with a move (M)"
    lexer = SVGLexicalParser()
    try:
        lexer.parse(path, data)
    except (ValueError, TypeError, IndexError, AttributeError, ArithmeticError):
        lexer.pos = min(lexer.pos, len(data) - 1)
    if lexer.pos == len(data):
        return path.cubics, None
    return path.cubics, f"its path data is faulty near {shortened(data[max(lexer.pos - 9, 0) :], _QUOTED)!r}"


def _empty_path() -> Any:
    """A path of svgelements for its lexer, without checks whose time grows with the square of its length."""
    from svgelements import CubicBezier, Move, Path, QuadraticBezier

    class CubicPath(Path):  # type: ignore[misc]
        z_point = None
        cubics: _Cubics

        def append(self, value: Any) -> None:
            if len(self.cubics) >= MAX_CURVES:
                raise too_many_curves()
            self.cubics += _cubics_of(value)
            self._segments[:] = [value]
            if isinstance(value, Move):
                self.z_point = value.end

        def smooth_quad(self, *points: Any, **options: Any) -> None:
            self.quad(self._reflected_control(QuadraticBezier), *points, **options)

        def smooth_cubic(self, *points: Any, **options: Any) -> None:
            self.cubic(self._reflected_control(CubicBezier), *points, **options)

        def _reflected_control(self, kind: type) -> Any:
            # svgelements also reflects those of the other kind, unlike SVG.
            return self.smooth_point if isinstance(self._segments[-1], kind) else self.current_point

        def arc(self, rx: float, ry: float, *others: Any, **options: Any) -> None:
            rotation, large, sweep, end = others
            if None in (large, sweep):
                raise ValueError("a flag of an arc is neither 0 nor 1")
            if rx == 0 or ry == 0:  # as in SVG
                self.line(end)
            else:
                super().arc(rx, ry, rotation, large, sweep, end, **options)

    path = CubicPath()
    path.cubics = []
    return path


def _cubics_of(segment: Any) -> _Cubics:
    """Control points of a segment of svgelements; those of a straight line are its ends."""
    import svgelements

    if isinstance(segment, svgelements.Move):
        return []
    if isinstance(segment, svgelements.Arc):
        curves = segment.as_cubic_curves() if segment.start != segment.end else ()
        return [cubic for curve in curves for cubic in _cubics_of(curve)]
    start, end = complex(segment.start), complex(segment.end)
    if isinstance(segment, svgelements.CubicBezier):
        return [(start, complex(segment.control1), complex(segment.control2), end)]
    if isinstance(segment, svgelements.QuadraticBezier):
        control = 2 * complex(segment.control)
        return [(start, (start + control) / 3, (end + control) / 3, end)]
    return [(start, start, end, end)]


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


def _parse_basic(
    tag: str, attributes: Mapping[str, str], page: tuple[float, float]
) -> tuple[_Cubics, str | None]:
    """The cubics of a basic shape, none if it is faulty, and what is."""
    import svgelements

    kind, keys = _BASIC[tag]
    texts = {key: attributes[key] for key in keys if attributes.get(key)}
    lengths = {key: _parse_length(text) for key, text in texts.items()}
    for key, length in lengths.items():
        if length is None:
            return [], f"its {key} {shortened(texts[key], _QUOTED)!r} cannot be read"
        if key in _SIZES and str(length).startswith("-"):
            return [], f"its {key} is {shortened(texts[key], _QUOTED)}"
    if tag == "ellipse" and len(lengths.keys() & _SIZES) == 1:
        lengths["rx"] = lengths["ry"] = lengths.get("rx", lengths.get("ry"))
    shape = getattr(svgelements, kind)({**dict.fromkeys(_ABSENT.get(tag, ()), 0), **lengths})
    shape.render(ppi=PPI, width=page[0], height=page[1])
    return [cubic for segment in shape.segments() for cubic in _cubics_of(segment)], None


def _parse_length(length: str) -> str | float | None:
    """A length in pixels, or the percentage; None if it cannot be read."""
    if not length.endswith("%"):
        return length_in_pixels(length)
    return length if _NUMBER.fullmatch(length[:-1].strip()) else None


def too_many_curves() -> InputError:
    """The error for a drawing with more than MAX_CURVES segments."""
    return InputError(f"draws more than {MAX_CURVES} segments of curves, with <use>; simplify the drawing")
