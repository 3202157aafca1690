"""What the reader of a drawing has to say beside the instance: doubts, open places, the page."""

from __future__ import annotations

from dataclasses import dataclass

Point = tuple[float, float]


@dataclass(frozen=True)
class Reading:
    """How an instance was read from a drawing; no part of its content, its files and its hash.

    page: x, y, width and height of the page in the drawing's units, or None where the drawing does not say.
    warnings: what may not be as the drawing was meant, one line each; the places are x, y in the drawing's
    units, y down. openings: both ends (x, y) of each gap in the outline that was bridged.
    """

    page: tuple[float, float, float, float] | None
    warnings: tuple[str, ...] = ()
    openings: tuple[tuple[Point, Point], ...] = ()
