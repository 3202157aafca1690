"""The document of a drawing on the page: strokes with marks, changes of the mask, hints and settings.

The browser keeps the document, and sends all of it with every request. The server stores nothing.
"""

from __future__ import annotations

import base64
import hashlib
import io
import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, Literal, TypeVar, get_args

import numpy as np

from ...models.documents import parse_json
from ...models.errors import InputError, InstanceError, NoStrokeError, shortened
from ...models.input_limits import MAX_ELEMENTS, MAX_SEGMENTS
from ...models.instance.domain import Bools, Floats, Ints
from ...models.instance.instance import STROKE_WEIGHT, name_from_text
from ...models.sketch.cover import Box
from ...models.sketch.curves import Curves, lines_as_cubics
from ...models.sketch.read import Silhouette

Mark = Literal["line", "cut", "ignored"]
EditKind = Literal["paint", "erase", "toggle"]
_Read = TypeVar("_Read")

FORMAT: Final = "crossfield-studio"
VERSION: Final = 1
SIZES: Final = (8, 256)  # least and most pixels of the longer side that the page offers
FARTHEST: Final = 1e6  # coordinates
PICTURE_SIDE: Final = 1600  # most pixels of the longer side of the picture under the strokes
MOST_SENT: Final = 12_000_000  # bytes of an opened file that is sent with requests
_MOST_ATTACHED: Final = 40_000_000  # characters of a picture or file in a session
_MOST_WEIGHT: Final = 1e3  # of the strokes


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

    source: the file that was opened. It replaces its strokes as long as they are unchanged.
    """

    name: str
    page: Box
    strokes: tuple[Stroke, ...]
    mask: tuple[MaskEdit, ...]
    hints: tuple[PlacedHint, ...]
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
        _check_picture(content.get("picture"))
        _check_file(content.get("file"))
        low, high = SIZES
        strokes, source = read_strokes(content), _read_source(content.get("source"))
        document = cls(
            name=name_from_text(str(content.get("name", ""))[:200]) or "drawing",
            page=_read_page(content.get("page")),
            strokes=strokes,
            mask=_read_list(content, "mask", _read_edit),
            hints=_read_list(content, "hints", _read_hint),
            flip=content.get("flip") is True,
            size=int(_read_number(content.get("size"), "size", low, high)),
            stroke_weight=_read_number(
                content.get("stroke_weight", STROKE_WEIGHT), "stroke_weight", 0.0, _MOST_WEIGHT
            ),
            silhouette=_read_choice(content.get("silhouette", "none"), "silhouette", Silhouette),
            source=source if source and source.digest == digest_of(strokes) else None,
        )
        if sum(len(stroke.points) for stroke in document.strokes) > MAX_SEGMENTS:
            raise InputError(f"the drawing has more than {MAX_SEGMENTS} points; simplify it")
        return document

    @property
    def visible(self) -> Ints:
        """Numbers of the strokes that are read: not ignored, and longer than a point."""
        read = [
            number
            for number, stroke in enumerate(self.strokes)
            if stroke.mark != "ignored" and (stroke.points != stroke.points[0]).any()
        ]
        return np.array(read, dtype=np.int32)

    def segments(self) -> tuple[Floats, Ints]:
        """The straight parts (k, 2, 2) of the visible strokes, and the number (k,) of the stroke of each."""
        visible = self.visible
        points = [self.strokes[number].points for number in visible]
        ends = [np.stack([part[:-1], part[1:]], axis=1) for part in points] or [np.empty((0, 2, 2))]
        joined, owner = np.concatenate(ends), np.repeat(visible, [len(part) - 1 for part in points])
        long = (joined[:, 0] != joined[:, 1]).any(axis=1)
        return joined[long], owner[long]

    def curves(self) -> Curves:
        """The visible strokes as curves with their numbers. Raises NoStrokeError without a curvature line."""
        segments, owner = self.segments()
        line: Bools = np.array([stroke.mark == "line" for stroke in self.strokes], dtype=bool)[owner]
        if not line.any():
            raise NoStrokeError("there is no curvature line yet; draw one, or mark a stroke as one")
        return Curves(lines_as_cubics(segments[:, 0], segments[:, 1]), owner, line, self.sheet, line)

    @property
    def sheet(self) -> Box:
        """The page, enlarged to hold the visible strokes; x, y, width and height."""
        x, y, width, height = self.page
        corners = np.concatenate([[[x, y], [x + width, y + height]], self.segments()[0].reshape(-1, 2)])
        (left, top), (right, bottom) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        return left, top, right - left, bottom - top

    @property
    def weights(self) -> Floats:
        """Weight of each stroke, shape (number of strokes,)."""
        return np.array([stroke.weight for stroke in self.strokes])


def read_strokes(content: Mapping[str, Any]) -> tuple[Stroke, ...]:
    """The strokes of a parsed document. Raises InputError that names the faulty entry."""
    return _read_list(content, "strokes", _read_stroke)


def digest_of(strokes: tuple[Stroke, ...]) -> str:
    """64 hexadecimal digits of strokes; equal only for equal strokes."""
    digest = hashlib.sha256()
    for stroke in strokes:
        digest.update(f"{stroke.mark} {stroke.weight!r} {stroke.points.size}\n".encode())
        digest.update((stroke.points + 0.0).astype("<f8").tobytes())  # browsers write -0 as 0
    return digest.hexdigest()


def _read_list(
    content: Mapping[str, Any], key: str, read: Callable[[dict[str, Any], str], _Read]
) -> tuple[_Read, ...]:
    entries = content.get(key, [])
    if not isinstance(entries, list) or len(entries) > MAX_ELEMENTS:
        raise InputError(f"{key} of the session must be a list of at most {MAX_ELEMENTS} entries")
    if not all(isinstance(entry, dict) for entry in entries):
        raise InputError(f"an entry of {key} of the session is not an object; save the session again")
    return tuple(read(entry, f"{key}, entry {number}") for number, entry in enumerate(entries, start=1))


def _read_stroke(entry: dict[str, Any], where: str) -> Stroke:
    weight = _read_number(entry.get("weight", 1.0), f"{where}, weight", 0.0, 1.0)
    return Stroke(
        _read_points(entry.get("points"), where),
        _read_choice(entry.get("mark"), f"{where}, mark", Mark),
        max(weight, 0.05),
    )


def _read_edit(entry: dict[str, Any], where: str) -> MaskEdit:
    radius = _read_number(entry.get("radius", 0.0), f"{where}, radius", 0.0, FARTHEST)
    kind = _read_choice(entry.get("kind"), f"{where}, kind", EditKind)
    return MaskEdit(kind, _read_points(entry.get("points"), where), radius)


def _read_hint(entry: dict[str, Any], where: str) -> PlacedHint:
    number = partial(_read_number, most=FARTHEST)
    return PlacedHint(
        number(entry.get("x"), f"{where}, x", least=-FARTHEST),
        number(entry.get("y"), f"{where}, y", least=-FARTHEST),
        _read_number(entry.get("slant"), f"{where}, slant", 0.0, 89.0),
        _read_number(entry.get("tilt"), f"{where}, tilt", -720.0, 720.0),
    )


def _read_points(value: Any, where: str) -> Floats:
    """Points (k, 2) from a flat list x, y, x, y, ..."""
    try:
        points = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        points = np.empty(0)
    if points.ndim != 1 or not len(points) or len(points) % 2 or not (np.abs(points) <= FARTHEST).all():
        raise InputError(f"{where} of the session: points must be x, y, x, y, ... up to {FARTHEST:g}")
    return points.reshape(-1, 2)


def _read_page(value: Any) -> Box:
    values = _read_points(value, "page").ravel()
    if len(values) != 4 or not (values[2:] > 0).all():
        raise InputError("page of the session must be x, y, width and height")
    x, y, width, height = values.tolist()
    return x, y, width, height


def _check_picture(value: Any) -> None:
    """Check the picture under the strokes: a JPEG in base64, which the page decodes."""
    if value is None:
        return
    from PIL import Image

    data = _decode(value, "picture")
    try:
        with Image.open(io.BytesIO(data), formats=["JPEG"]) as image:  # reads the header only
            size = image.size
    except Exception as error:  # damaged pictures make decoders raise nearly anything
        raise InputError("picture of the session is not a JPEG; open the picture itself again") from error
    if max(size) > PICTURE_SIDE:
        raise InputError(
            f"picture of the session has {size[0]} x {size[1]} pixels, but at most "
            f"{PICTURE_SIDE} a side are shown; open the picture itself again"
        )


def _check_file(value: Any) -> None:
    """Check the file of a drawing in space: its name, and its bytes in base64, which `open_drawing` reads."""
    if value is None:
        return
    if not isinstance(value, dict) or not isinstance(value.get("name"), str):
        raise InputError("file of the session must have a name and data; open the file itself again")
    _decode(value.get("data"), "file")


def _read_source(value: Any) -> Source | None:
    if value is None:
        return None
    if not isinstance(value, dict) or not all(isinstance(value.get(key), str) for key in ("name", "digest")):
        raise InputError("source of the session must have a name, data and a digest; open the file again")
    return Source(value["name"][:200], _decode(value.get("data"), "source"), value["digest"])


def _decode(value: Any, where: str) -> bytes:
    if isinstance(value, str) and len(value) <= _MOST_ATTACHED:
        with suppress(ValueError):
            return base64.b64decode(value, validate=True)
    raise InputError(
        f"{where} of the session must be text in base64 of at most {_MOST_ATTACHED} characters; "
        f"open the {where} itself again"
    )


def _read_number(value: Any, where: str, least: float, most: float) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise InputError(f"{where} of the session is {shortened(value)}, not a number")
    if not least <= value <= most:
        raise InputError(f"{where} of the session is {value:g}; it must be between {least:g} and {most:g}")
    return float(value)


def _read_choice(value: Any, where: str, choice: Any) -> Any:
    if value not in get_args(choice):
        raise InputError(
            f"{where} of the session is {shortened(value)!r}; it must be {' or '.join(get_args(choice))}"
        )
    return value
