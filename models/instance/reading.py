"""Messages from the reader of a drawing about an instance: doubts, open places, the page."""

from __future__ import annotations

from dataclasses import dataclass

Point = tuple[float, float]


@dataclass(frozen=True)
class Reading:
    """How an instance was read from a drawing; not part of its content, files or hash.

    page: x, y, width and height of the page in the drawing's units, or None if the drawing has none.
    warnings: possible misreadings of the drawing, one line each; places are x, y in the drawing's
    units, y down. openings: both ends (x, y) of each gap in the outline that was bridged.
    """

    page: tuple[float, float, float, float] | None
    warnings: tuple[str, ...] = ()
    openings: tuple[tuple[Point, Point], ...] = ()
