"""Reading .curves, the text format of CASSIE for strokes drawn in space.

For each stroke a line `v N` and N lines `x y z`, y upwards. The strokes are projected to a plane at right
angles; those at the back are drawn too. CASSIE: E. Yu, R. Arora, T. Stanko, J. A. Baerentzen, K. Singh,
A. Bousseau, *CASSIE: Curve and Surface Sketching in Immersive Environments*, CHI 2021.
"""

from __future__ import annotations

import re
from typing import Final

import numpy as np

from ..errors import InputError, shortened
from ..instance.elementary import cosine, sine, turned
from ..instance.grid import Floats
from .curves import Curves
from .scap import lines_of, numbers_in, polylines

START: Final = re.compile(rb"v[ \t]+\d+[ \t]*[\r\n]")
"""How a .curves file begins; a mesh, whose vertices begin with v as well, has three numbers there."""
SIDE: Final = 1000.0
"""Longer side of the projected drawing, in the units of its page."""
BORDER: Final = 40.0
"""Empty border of the page round it."""
VIEWS: Final = {"front": (0.0, 0.0), "side": (90.0, 0.0), "top": (0.0, 90.0)}
"""Where views are from: azimuth, from z towards x, and elevation, in degrees."""


def read_curves(data: bytes, view: str | None = None) -> Curves:
    """The strokes of a .curves file as they are seen from somewhere, on a page of their own.

    view: "front", "side", "top", or azimuth and elevation in degrees as in "30,25"; None: along the third of
    the strokes' principal axes. The longer side of the drawing becomes SIDE, and the page, in whole units,
    leaves BORDER round it. Raises InputError with the number of the line that breaks the layout, and for a
    view that is none.
    """
    strokes = _strokes(data)
    axes = _principal(strokes) if view is None else axes_of(view)
    flat = [turned(stroke, axes) for stroke in strokes]
    ends = np.concatenate(flat)
    least, most = ends.min(axis=0), ends.max(axis=0)
    longer = float((most - least).max())
    if longer == 0:
        raise InputError("draws no stroke: everything is one point, seen from there")
    placed = [BORDER + SIDE * ((stroke - least) / longer) for stroke in flat]
    width, height = np.ceil(SIDE * ((most - least) / longer)) + 2 * BORDER
    return polylines(placed, np.arange(len(placed), dtype=np.int32), (0.0, 0.0, float(width), float(height)))


def axes_of(view: str) -> Floats:
    """The directions (2, 3) in space that point to the right and down in a view. Raises InputError."""
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


def _principal(strokes: list[Floats]) -> Floats:
    """The two principal axes (2, 3) along which strokes reach farthest, as in `axes_of`.

    The one nearer to the vertical of space points up. A piece of a stroke counts by its length, however many
    samples it has.
    """
    starts = np.concatenate([stroke[:-1] for stroke in strokes])
    ends = np.concatenate([stroke[1:] for stroke in strokes])
    scale = 2 * (max(np.abs(starts).max(), np.abs(ends).max()) or 1.0)
    middle, half = starts / scale + ends / scale, ends / scale - starts / scale
    length = np.sqrt((half**2).sum(axis=1, keepdims=True))
    middle -= (length * middle).sum(axis=0) / (length.sum() or 1.0)
    spread = (length * middle).T @ middle + (length * half).T @ half / 3
    # Processors differ in the last digits: those are cut off.
    axes = np.linalg.eigh(spread)[1].T[1:].round(9)
    across, up = sorted(axes, key=lambda axis: (abs(axis[1]), *axis))
    return np.stack([_forward(across), -(np.sign(up[1]) * up if up[1] else _forward(up))])


def _forward(axis: Floats) -> Floats:
    """The axis or its opposite, whichever has its largest part positive."""
    return axis if axis[np.argmax(np.abs(axis))] > 0 else -axis


def _strokes(data: bytes) -> list[Floats]:
    """The strokes (n, 3) of two or more samples."""
    lines = [(number, line.strip()) for number, line in enumerate(lines_of(data), start=1) if line.strip()]
    strokes: list[Floats] = []
    place = 0
    while place < len(lines):
        number, line = lines[place]
        count = _announced(line, number)
        samples = [numbers_in(text, at, "x y z", 3) for at, text in lines[place + 1 : place + 1 + count]]
        if len(samples) < count:
            raise InputError(
                f"line {number}: this stroke announces {count} points, and {len(samples)} follow; "
                "the file is cut off"
            )
        if count > 1:
            strokes.append(np.array(samples))
        place += 1 + count
    if not strokes:
        raise InputError("holds no stroke of two or more samples")
    return strokes


def _announced(line: str, number: int) -> int:
    """The number of points that the first line of a stroke announces."""
    match = re.fullmatch(r"v\s+([0-9]{1,9})", line)
    if match is None:
        raise InputError(f"line {number}: expected 'v N', found {line[:30]!r}")
    return int(match[1])
