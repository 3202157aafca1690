"""Reading .scap, the text format of StrokeStrip and StripMaker for over-sketched pen strokes.

Line 1 `#width height`, then optionally `@thickness`, then strokes: `{`, `#stroke cluster`, optionally
`@thickness`, one sample `x y pressure` a line, `}`. Fields are parted by tabs or blanks; y runs downwards.
The declared size need not bound the samples. Strokes of one cluster are meant as one curve, and
are one here when a curve is asked for by its number; their directions count one by one. A file that has all
strokes in one cluster says nothing of curves: there each stroke is one.
"""

from __future__ import annotations

import re
from typing import Final

import numpy as np

from ..errors import InputError
from ..input_limits import LEAST_LENGTH, MAX_LINES
from ..instance.grid import Bools, Floats, Ints
from .choice import Chooser
from .curves import Curves, lines_as_cubics

_GREATEST: Final = 1e9


def read_scap(data: bytes, chooser: Chooser | None = None) -> Curves:
    """The strokes of a .scap file.

    chooser: looks for the clusters of curvature lines, cluster=NAME; None: all strokes are. Raises InputError
    with the number of the line that breaks the layout, and for clusters that are not there.
    """
    lines = lines_of(data)
    canvas = _canvas(lines[0] if lines else "")
    strokes: list[list[tuple[float, float]]] = []
    clusters: list[str] = []
    samples: list[tuple[float, float]] = []
    opened = 0
    for number, line in enumerate(map(str.strip, lines[1:]), start=2):
        if line == "{":
            if opened:
                raise InputError(
                    f"line {number}: a stroke starts inside the stroke of line {opened}; "
                    "close that one with }"
                )
            samples, opened = [], number
        elif line == "}":
            if not opened:
                raise InputError(f"line {number}: a stroke ends that did not start; remove the line")
            clusters.append(_cluster(lines[opened], len(strokes)))
            strokes.append(samples)
            opened = 0
        elif line and line[0] not in "#@":
            if not opened:
                raise InputError(
                    f"line {number}: a sample stands outside of any stroke; put it between {{ and }}"
                )
            x, y = numbers_in(line, number, "x y pressure", 2)
            samples.append((x, y))
    if opened:
        raise InputError(f"line {opened}: this stroke does not end; the file is cut off")
    return _curves(strokes, clusters, canvas, chooser)


def lines_of(data: bytes) -> list[str]:
    """The lines of a text of strokes. Raises InputError when there are more than MAX_LINES."""
    if sum(data.count(end) for end in (b"\n", b"\r")) > MAX_LINES:
        raise InputError(f"has more than {MAX_LINES} lines; simplify the drawing")
    text = data.decode("utf-8", errors="replace").lstrip("\ufeff")
    return re.split(r"\r\n?|\n", text)


def numbers_in(line: str, number: int, layout: str, count: int) -> list[float]:
    """The first `count` coordinates in a line, whose number and layout an InputError names."""
    fields = line.split(maxsplit=count)[:count]
    try:
        found = [float(field) for field in fields]
    except ValueError:
        found = []
    if len(found) < count:
        raise InputError(f"line {number}: expected {layout!r}, found {line[:30]!r}")
    if not all(abs(each) <= _GREATEST for each in found):
        raise InputError(f"line {number}: a coordinate is not a finite number below {_GREATEST:g}")
    return found


def polylines(
    strokes: list[Floats], curve: Ints, canvas: tuple[float, float, float, float], taken: Bools | None = None
) -> Curves:
    """The curves of pen strokes, each of two or more samples (n, 2).

    curve: int (s,), the number of each stroke's curve; taken: bool (s,), which were chosen, None: none.
    """
    count = [len(stroke) - 1 for stroke in strokes]
    points = np.concatenate([lines_as_cubics(stroke[:-1], stroke[1:]) for stroke in strokes])
    chosen = None if taken is None else np.repeat(taken, count)
    return Curves(points, np.repeat(curve, count), np.zeros(len(points), dtype=bool), canvas, chosen)


def _curves(
    strokes: list[list[tuple[float, float]]],
    clusters: list[str],
    canvas: tuple[float, float, float, float],
    chooser: Chooser | None,
) -> Curves:
    drawn = [number for number, stroke in enumerate(strokes) if len(stroke) > 1]
    if not drawn:
        raise InputError("holds no stroke of two or more samples")
    names = [clusters[number] for number in drawn]
    taken = None
    if chooser is not None:
        taken = np.array([chooser.takes([f"cluster={name}"] if " " not in name else []) for name in names])
        chooser.check(taken=bool(taken.any()))
    return polylines([np.array(strokes[number]) for number in drawn], _numbers(names), canvas, taken)


def _cluster(line: str, stroke: int) -> str:
    """The name of the cluster in a stroke's first line, `#stroke cluster`; the stroke's own without one."""
    fields = line.strip().removeprefix("#").split()
    return fields[1] if len(fields) == 2 and line.strip().startswith("#") else f"stroke {stroke}"


def _numbers(clusters: list[str]) -> Ints:
    """The number of each stroke's curve: its cluster, or the stroke itself where there is but one cluster."""
    numbers = {name: number for number, name in enumerate(dict.fromkeys(clusters))}
    return np.array(
        [numbers[name] for name in clusters] if len(numbers) > 1 else range(len(clusters)), dtype=np.int32
    )


def _canvas(line: str) -> tuple[float, float, float, float]:
    fields = line.strip().removeprefix("#").split(maxsplit=3)
    try:
        width, height = (float(field) for field in fields)
    except ValueError as error:
        raise InputError(f"line 1: expected '#width height', found {line.strip()[:30]!r}") from error
    if not (min(width, height) >= LEAST_LENGTH and max(width, height) <= _GREATEST):
        raise InputError(
            f"line 1: the size {line.strip()[:30]!r} is not two positive numbers from {LEAST_LENGTH:g} to "
            f"{_GREATEST:g}"
        )
    return 0.0, 0.0, width, height
