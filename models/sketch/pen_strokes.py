"""Readers of pen strokes as text: .scap, drawn on paper, and .curves, drawn in space.

.scap is the format of StrokeStrip and StripMaker for over-sketched drawings. Line 1 is `#width height`, then
optionally `@thickness`, then strokes: `{`, `#stroke cluster`, optionally `@thickness`, one sample
`x y pressure` per line, `}`. Fields are separated by tabs or blanks; y runs downwards. Strokes of one cluster
are one curve, unless all strokes of a file are in one cluster: then each stroke is a curve.

.curves is the format of CASSIE (Yu et al.: Curve and Surface Sketching in Immersive Environments, 2021): for
each stroke a line `v N` and N lines `x y z`, y upwards. Strokes at the back are drawn too.
"""

from __future__ import annotations

import re
from typing import Final

import numpy as np

from ..errors import InputError, shortened
from ..input_limits import LEAST_LENGTH, MAX_LINES
from ..instance.angles import cosine, sine, transform_vectors
from ..instance.domain import Bools, Floats, Ints
from .cover import Box
from .curves import Curves, lines_as_cubics
from .labels import LabelMatcher

_GREATEST: Final = 1e9
CURVES_START: Final = re.compile(rb"v[ \t]+\d+[ \t]*[\r\n]")
"""First line of a .curves file; a mesh, whose vertices begin with v as well, has three numbers there."""
_SIDE: Final = 1000.0  # longer side of the projected drawing, in the units of its page
_BORDER: Final = 40.0  # empty border of the page round it
VIEWS: Final = {"front": (0.0, 0.0), "side": (90.0, 0.0), "top": (0.0, 90.0)}
"""Directions of views: azimuth, from z towards x, and elevation, in degrees."""


def read_scap(data: bytes, matcher: LabelMatcher | None = None) -> Curves:
    """Read the strokes of a .scap file. Raises InputError with the number of the line at fault.

    matcher: matches the clusters of curvature lines, cluster=NAME; None: all strokes are.
    """
    lines = _split_lines(data)
    page = _parse_page(lines[0] if lines else "")
    strokes: list[tuple[str, Floats]] = []
    samples: list[list[float]] = []
    opened = 0
    for number, line in enumerate(map(str.strip, lines[1:]), start=2):
        if line == "{":
            if opened:
                raise InputError(
                    f"line {number}: a stroke starts inside the stroke of line {opened}; close it"
                )
            samples, opened = [], number
        elif line == "}":
            if not opened:
                raise InputError(f"line {number}: a stroke ends that did not start; remove the line")
            fields = lines[opened].strip().removeprefix("#").split()
            named = len(fields) == 2 and lines[opened].strip().startswith("#")
            if len(samples) > 1:
                strokes.append((fields[1] if named else f"stroke {len(strokes)}", np.array(samples)))
            opened = 0
        elif line and line[0] not in "#@":
            if not opened:
                raise InputError(
                    f"line {number}: a sample stands outside of strokes; put it between {{ and }}"
                )
            samples.append(_parse_numbers(line, number, "x y pressure", 2))
    if opened:
        raise InputError(f"line {opened}: this stroke does not end; the file is cut off")
    return _curves_of_clusters(strokes, page, matcher)


def read_curves(data: bytes, view: str | None = None) -> Curves:
    """Read the strokes of a .curves file as seen from one side, on a page of their own. Raises InputError.

    view: as in `view_axes`; None: along the third of the strokes' principal axes.
    """
    strokes = _parse_spatial_strokes(data)
    axes = _principal_axes(strokes) if view is None else view_axes(view)
    flat = [transform_vectors(stroke, axes) for stroke in strokes]
    ends = np.concatenate(flat)
    least, most = ends.min(axis=0), ends.max(axis=0)
    longer = float((most - least).max())
    if longer == 0:
        raise InputError("draws no stroke: everything is one point, seen from there")
    placed = [_BORDER + _SIDE * ((stroke - least) / longer) for stroke in flat]
    width, height = np.ceil(_SIDE * ((most - least) / longer)) + 2 * _BORDER
    return _curves_of_polylines(
        placed, np.arange(len(placed), dtype=np.int32), (0.0, 0.0, float(width), float(height))
    )


def view_axes(view: str) -> Floats:
    """The directions (2, 3) to the right and down in a view, as "top" or "30,25". Raises InputError."""
    try:
        azimuth, elevation = np.radians(VIEWS.get(view) or [float(part) for part in view.split(",")])
    except ValueError:
        azimuth = elevation = np.nan
    if not (abs(azimuth) <= 2 * np.pi and abs(elevation) <= np.pi / 2):
        raise InputError(
            f"there is no view {shortened(view)!r}; choose {', '.join(VIEWS)}, or azimuth (-360 to 360) and"
            " elevation (-90 to 90) in degrees as in 30,25"
        )
    angles = np.array([azimuth, elevation])
    (across, rise), (along, level) = sine(angles), cosine(angles)
    return np.array([[along, 0.0, -across], [rise * across, -level, rise * along]])


def _principal_axes(strokes: list[Floats]) -> Floats:
    """The two principal axes (2, 3) along which strokes extend farthest; the more vertical one points up."""
    starts = np.concatenate([stroke[:-1] for stroke in strokes])
    ends = np.concatenate([stroke[1:] for stroke in strokes])
    scale = 2 * (max(np.abs(starts).max(), np.abs(ends).max()) or 1.0)
    middle, half = starts / scale + ends / scale, ends / scale - starts / scale
    length = np.sqrt((half**2).sum(axis=1, keepdims=True))
    middle -= (length * middle).sum(axis=0) / (length.sum() or 1.0)
    spread = (length * middle).T @ middle + (length * half).T @ half / 3
    # Processors differ in the last digits, which are cut off.
    axes = np.linalg.eigh(spread)[1].T[1:].round(9)
    across, up = sorted(axes, key=lambda axis: (abs(axis[1]), *axis))
    return np.stack([_point_forward(across), -(np.sign(up[1]) * up if up[1] else _point_forward(up))])


def _point_forward(axis: Floats) -> Floats:
    """The axis or its opposite, whichever has its largest part positive."""
    return axis if axis[np.argmax(np.abs(axis))] > 0 else -axis


def _parse_spatial_strokes(data: bytes) -> list[Floats]:
    """The strokes (n, 3) of two or more samples."""
    lines = [
        (number, line.strip()) for number, line in enumerate(_split_lines(data), start=1) if line.strip()
    ]
    strokes: list[Floats] = []
    place = 0
    while place < len(lines):
        number, line = lines[place]
        match = re.fullmatch(r"v\s+([0-9]{1,9})", line)
        if match is None:
            raise InputError(f"line {number}: expected 'v N', found {line[:30]!r}")
        count = int(match[1])
        samples = [_parse_numbers(text, at, "x y z", 3) for at, text in lines[place + 1 : place + 1 + count]]
        if len(samples) < count:
            follow = f"announces {count} points, and {len(samples)} follow"
            raise InputError(f"line {number}: this stroke {follow}; the file is cut off")
        if count > 1:
            strokes.append(np.array(samples))
        place += 1 + count
    if not strokes:
        raise InputError("holds no stroke of two or more samples")
    return strokes


def _split_lines(data: bytes) -> list[str]:
    """The lines of a text of strokes, at most MAX_LINES."""
    if sum(data.count(end) for end in (b"\n", b"\r")) > MAX_LINES:
        raise InputError(f"has more than {MAX_LINES} lines; simplify the drawing")
    text = data.decode("utf-8", errors="replace").lstrip("\ufeff")
    return re.split(r"\r\n?|\n", text)


def _parse_numbers(line: str, place: int, layout: str, count: int) -> list[float]:
    """The first `count` coordinates in a line."""
    fields = line.split(maxsplit=count)[:count]
    try:
        numbers = [float(field) for field in fields]
    except ValueError:
        numbers = []
    if len(numbers) < count:
        raise InputError(f"line {place}: expected {layout!r}, found {line[:30]!r}")
    if not all(abs(number) <= _GREATEST for number in numbers):
        raise InputError(f"line {place}: a coordinate is not a finite number below {_GREATEST:g}")
    return numbers


def _curves_of_polylines(strokes: list[Floats], curve: Ints, page: Box, taken: Bools | None = None) -> Curves:
    """The curves of pen strokes of two or more samples (n, 2), by the numbers (s,) of their curves."""
    count = [len(stroke) - 1 for stroke in strokes]
    points = np.concatenate([lines_as_cubics(stroke[:-1], stroke[1:]) for stroke in strokes])
    chosen = None if taken is None else np.repeat(taken, count)
    return Curves(points, np.repeat(curve, count), np.zeros(len(points), dtype=bool), page, chosen)


def _curves_of_clusters(strokes: list[tuple[str, Floats]], page: Box, matcher: LabelMatcher | None) -> Curves:
    """The curves of pen strokes (n, 2) of two or more samples, each with the name of its cluster."""
    if not strokes:
        raise InputError("holds no stroke of two or more samples")
    names, samples = zip(*strokes, strict=True)
    numbers = {name: number for number, name in enumerate(dict.fromkeys(names))}
    curve = [numbers[name] for name in names] if len(numbers) > 1 else range(len(names))
    taken = None
    if matcher is not None:
        taken = np.array([matcher.matches([f"cluster={name}"] if " " not in name else []) for name in names])
        matcher.check(any_stroke=bool(taken.any()))
    return _curves_of_polylines(list(samples), np.array(curve, dtype=np.int32), page, taken)


def _parse_page(line: str) -> Box:
    fields = line.strip().removeprefix("#").split(maxsplit=3)
    try:
        width, height = (float(field) for field in fields)
    except ValueError as error:
        raise InputError(f"line 1: expected '#width height', found {line.strip()[:30]!r}") from error
    if not (min(width, height) >= LEAST_LENGTH and max(width, height) <= _GREATEST):
        raise InputError(
            f"line 1: the size {line.strip()[:30]!r} is not two numbers from {LEAST_LENGTH} to {_GREATEST:g}"
        )
    return 0.0, 0.0, width, height
