"""Sketches as published in a library: their content, and the suffix of their file."""

from __future__ import annotations

from itertools import pairwise
from typing import Final

import numpy as np

from ..errors import InputError
from ..input_limits import MAX_DATA
from ..instance.domain import Floats
from .curves import Curves, are_straight
from .drawing_file import detect_file_kind, suffix_of_picture
from .svg import read_svg

_LINE: Final = 400  # widths of a line on the longer side of the drawing
_RED: Final = ' stroke="#c8102e"'
_FAINT: Final = ' stroke-opacity=".3"'


def publishable_sketch(data: bytes, suffix: str) -> tuple[bytes, str]:
    """Content under which a sketch is published, and the suffix of its published file. Raises InputError.

    An SVG drawing is drawn again from the strokes that were read, so that no script, link, style or text of
    the file is published. Other kinds execute nothing and are not changed.
    """
    kind = detect_file_kind(data, suffix)
    if kind == "svg":
        return svg_of_curves(read_svg(data)), ".svg"
    return data, suffix_of_picture(data) if kind == "picture" else f".{kind}"


def svg_of_curves(curves: Curves) -> bytes:
    """SVG of only these curves; reading it gives the same numbers, except controls of straight lines."""
    left, top, right, bottom = curves.box
    box = curves.page or (left, top, right - left, bottom - top)
    page = f' viewBox="{_join_numbers(np.array(box))}"' if curves.page else ""
    root = (
        f'<svg xmlns="http://www.w3.org/2000/svg"{page} fill="none" stroke="#000" '
        f'stroke-width="{max(box[2:]) / _LINE:.3g}" stroke-linecap="round" stroke-linejoin="round">'
    )
    lines = [
        root,
        *(f'<path{paint} d="{"".join(data)}"/>' for paint, data in _paths_by_paint(curves)),
        "</svg>\n",
    ]
    if sum(map(len, lines)) > MAX_DATA:
        raise InputError(f"has paths of more than {MAX_DATA} characters; simplify the drawing")
    return "\n".join(lines).encode()


def _paths_by_paint(curves: Curves) -> list[tuple[str, list[str]]]:
    """Paint and data by path, for consecutive runs of one paint and one letter that do not touch."""
    # A reader lists lines of a path before its cubics, and joins runs of a path that touch.
    starts = np.flatnonzero(np.diff(curves.curve, prepend=-1)).tolist()
    paths: list[tuple[str, list[str]]] = []
    before: tuple[str, bool] | None = None
    end: list[float] = []
    for first, after in pairwise([*starts, len(curves.points)]):
        run, is_faint = curves.points[first:after], curves.faint is not None and curves.faint[first]
        paint = (_RED if curves.red[first] else "") + (_FAINT if is_faint else "")
        straight = bool(are_straight(run).all())
        if (paint, straight) != before or run[0, 0].tolist() == end:
            paths.append((paint, []))
        moves = f"L{_join_numbers(run[:, 3:])}" if straight else f"C{_join_numbers(run[:, 1:])}"
        paths[-1][1].append(f"M{_join_numbers(run[0, 0])}{moves}")
        before, end = (paint, straight), run[-1, 3].tolist()
    return paths


def _join_numbers(values: Floats) -> str:
    """Numbers with all digits, so that reading them gives the same numbers."""
    return " ".join(repr(value).removesuffix(".0") for value in values.ravel().tolist()).replace(" -", "-")
