"""The document of a drawing on the page: strokes with marks, changes of the mask, hints and settings.

The browser keeps the document, and sends all of it with every request. The server stores nothing.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping
from dataclasses import astuple, dataclass
from functools import cached_property
from typing import Any, Final, Literal

import numpy as np

from ...models.documents import check_schema, parse_json
from ...models.errors import InputError, InstanceError, NoStrokeError, shortened
from ...models.input_limits import MAX_SEGMENTS
from ...models.instance.domain import Bools, Floats, Ints
from ...models.instance.instance import STROKE_WEIGHT, name_from_text
from ...models.sketch.cover import Box, box_around
from ...models.sketch.curves import Curves, lines_as_cubics
from ...models.sketch.read import Silhouette

Mark = Literal["line", "cut", "ignored"]
EditKind = Literal["paint", "erase", "toggle"]

FORMAT: Final = "crossfield-studio"
VERSION: Final = 1
SIZES: Final = (8, 256)  # least and most pixels of the longer side that the page offers
_FARTHEST: Final = 1e6  # coordinates
PICTURE_SIDE: Final = 1600  # most pixels of the longer side of the picture under the strokes
MOST_SENT: Final = 12_000_000  # bytes of an opened file that is sent with requests


@dataclass(frozen=True, eq=False)
class Stroke:
    """A polyline (k, 2) in the units of the drawing, y down, its mark, and its weight in (0, 1]."""

    points: Floats
    mark: Mark
    weight: float


@dataclass(frozen=True, eq=False)
class MaskEdit:
    """A change of the mask: a brush of a radius along points (k, 2), or a click at the first point.

    toggle: includes or excludes the area between strokes that was clicked.
    """

    kind: EditKind
    points: Floats
    radius: float


@dataclass(frozen=True)
class PlacedHint:
    """A normal of the surface at a point of the drawing, in degrees as in `crossfield shade --hint`."""

    x: float
    y: float
    slant: float
    tilt: float


@dataclass(frozen=True)
class Source:
    """The file from which strokes were read: its name, its content, and the digest of these strokes."""

    name: str
    data: bytes
    digest: str


@dataclass(frozen=True, eq=False)
class Document:
    """Everything that determines field and surface.

    concave: places x, y whose parts are bowls.
    source: the file that was opened. It replaces its strokes as long as they are unchanged.
    """

    name: str
    page: Box
    strokes: tuple[Stroke, ...]
    mask: tuple[MaskEdit, ...]
    hints: tuple[PlacedHint, ...]
    concave: tuple[tuple[float, float], ...]
    flip: bool
    size: int
    stroke_weight: float
    silhouette: Silhouette
    source: Source | None = None

    @classmethod
    def from_bytes(cls, data: bytes) -> Document:
        """Read a document from JSON. Raises InputError that names the faulty entry."""
        try:
            return cls.from_json(parse_json(data.decode()))
        except (UnicodeDecodeError, InstanceError) as error:
            reason = shortened(error) if isinstance(error, InstanceError) else "is not text"
            raise InputError(f"the file is no session of crossfield: it {reason}") from error

    @classmethod
    def from_json(cls, content: Any) -> Document:
        """Check a parsed document. Raises InputError that names the faulty entry."""
        if not isinstance(content, dict) or content.get("format") != FORMAT:
            raise InputError("this is not a session of crossfield; open a drawing or a saved session")
        if content.get("version") != VERSION:
            raise InputError(
                f"the session has version {shortened(content.get('version'))}, and this crossfield reads "
                f"version {VERSION}; open it with the crossfield that saved it and download the drawing there"
            )
        try:
            check_schema(content, "session", __package__)
        except InstanceError as error:
            raise InputError(f"the session is damaged at {error}; save it again") from error
        strokes, source = read_strokes(content), _read_source(content.get("source"))
        page = _read_points(content["page"], "page").ravel()
        if not (page[2:] > 0).all():
            raise InputError("page of the session must be x, y, width and height")
        x, y, width, height = page.tolist()
        document = cls(
            name=name_from_text(str(content.get("name", ""))[:200]) or "drawing",
            page=(x, y, width, height),
            strokes=strokes,
            mask=tuple(
                MaskEdit(edit["kind"], _read_points(edit["points"], "mask"), edit.get("radius", 0.0))
                for edit in content.get("mask", ())
            ),
            hints=tuple(
                PlacedHint(*(hint[key] for key in ("x", "y", "slant", "tilt")))
                for hint in content.get("hints", ())
            ),
            concave=tuple((x, y) for x, y in content.get("concave", ())),
            flip=content.get("flip") is True,
            size=int(content["size"]),
            stroke_weight=content.get("stroke_weight", STROKE_WEIGHT),
            silhouette=content.get("silhouette", "none"),
            source=source if source and source.digest == digest_of(strokes) else None,
        )
        numbers = [document.stroke_weight, *document.weights, *(edit.radius for edit in document.mask)]
        numbers += [
            number for place in (*map(astuple, document.hints), *document.concave) for number in place
        ]
        if not np.isfinite(numbers).all():
            raise InputError("a number of the session is not finite; save it again")
        if sum(len(stroke.points) for stroke in document.strokes) > MAX_SEGMENTS:
            raise InputError(f"the drawing has more than {MAX_SEGMENTS} points; simplify it")
        return document

    @property
    def visible(self) -> Ints:
        """Numbers of the strokes that are read: not ignored, and longer than a point."""
        return np.unique(self.segments[1])

    @cached_property
    def segments(self) -> tuple[Floats, Ints]:
        """The straight parts (k, 2, 2) of the visible strokes, and the number (k,) of the stroke of each."""
        points = np.concatenate([np.empty((0, 2)), *(stroke.points for stroke in self.strokes)])
        owner = np.repeat(np.arange(len(self.strokes)), [len(stroke.points) for stroke in self.strokes])
        is_read = np.array([stroke.mark != "ignored" for stroke in self.strokes], dtype=bool)[owner]
        start, end = points[:-1], points[1:]
        long = (start[:, 0] != end[:, 0]) | (start[:, 1] != end[:, 1])
        long &= (owner[:-1] == owner[1:]) & is_read[1:]
        return np.stack([start[long], end[long]], axis=1), owner[1:][long].astype(np.int32)

    def curves(self) -> Curves:
        """The visible strokes as curves with their numbers. Raises NoStrokeError without a curvature line."""
        segments, owner = self.segments
        line: Bools = np.array([stroke.mark == "line" for stroke in self.strokes], dtype=bool)[owner]
        if not line.any():
            raise NoStrokeError("there is no curvature line yet; draw one, or mark a stroke as one")
        return Curves(lines_as_cubics(segments[:, 0], segments[:, 1]), owner, line, self.sheet, line)

    @property
    def sheet(self) -> Box:
        """The page, enlarged to hold the visible strokes; x, y, width and height."""
        x, y, width, height = self.page
        corners = np.concatenate([[[[x, y], [x + width, y + height]]], self.segments[0]])
        left, top, right, bottom = box_around(corners)
        return left, top, right - left, bottom - top

    @property
    def weights(self) -> Floats:
        """Weight of each stroke, shape (number of strokes,)."""
        return np.array([stroke.weight for stroke in self.strokes])


def read_strokes(content: Mapping[str, Any]) -> tuple[Stroke, ...]:
    """The strokes of a document that obeys the schema. Raises InputError for points that are no numbers."""
    return tuple(
        Stroke(
            _read_points(stroke["points"], f"strokes, entry {number}"),
            stroke["mark"],
            max(float(stroke.get("weight", 1.0)), 0.05),
        )
        for number, stroke in enumerate(content.get("strokes", ()), start=1)
    )


def digest_of(strokes: tuple[Stroke, ...]) -> str:
    """64 hexadecimal digits of strokes; equal only for equal strokes."""
    digest = hashlib.sha256()
    for stroke in strokes:
        digest.update(f"{stroke.mark} {stroke.weight!r} {stroke.points.size}\n".encode())
        digest.update((stroke.points + 0.0).astype("<f8").tobytes())  # browsers write -0 as 0
    return digest.hexdigest()


def _read_points(value: Any, where: str) -> Floats:
    """Points (k, 2) from a flat list x, y, x, y, ..."""
    try:
        points = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        points = np.empty(0)
    if points.ndim != 1 or not len(points) or len(points) % 2 or not (np.abs(points) <= _FARTHEST).all():
        raise InputError(f"{where} of the session: points must be x, y, x, y, ... up to {_FARTHEST:g}")
    return points.reshape(-1, 2)


def _read_source(value: Any) -> Source | None:
    if value is None:
        return None
    try:
        data = base64.b64decode(value["data"], validate=True)
    except ValueError as error:
        raise InputError("source of the session is not in base64; open the file again") from error
    return Source(value["name"][:200], data, value["digest"])
