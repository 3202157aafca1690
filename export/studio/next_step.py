"""The next step of a drawing on the page, until its strokes determine a field."""

from __future__ import annotations

from typing import Final, Literal

from ...models.sketch.cover import CUT, cover_by_segments
from ...models.sketch.meetings import find_meetings
from ...models.sketch.outline import find_inside
from .document import Document
from .meetings import frame_of, lines_of

_SOME: Final = 2000  # points of lines, among which most drawings have a meeting

NextStep = Literal["outline", "line", "across", ""]


def find_next_step(document: Document) -> NextStep:
    """The next step of a drawing: a closed outline, a curvature line, a line across the others, or none.

    Lines of one family leave the other family free: turning it by any angle costs nothing, so many fields
    have the least energy. Where two lines cross, both lines of the cross are given, and smoothness carries
    them on. So a field counts as determined once two curvature lines meet at a clear angle.
    """
    segments = document.segments[0]
    if not len(segments):
        return "outline"
    frame = frame_of(segments)
    points, owner = lines_of(document, frame)
    if any(len(find_meetings(points[:some], owner[:some])[0]) for some in (_SOME, len(points))):
        return ""
    if not document.mask and find_inside(cover_by_segments(segments, frame).amount >= CUT).all():
        return "outline"
    return "across" if len(points) else "line"
