"""Files of drawings: SVG, bitmap, .scap or .curves, told apart by their content first."""

from __future__ import annotations

import base64
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final, Literal

from ..errors import InputError, NoStrokeError, shortened
from ..input_limits import MAX_BYTES
from ..storage import read_bytes
from .bitmap import Bitmap, read_bitmap
from .curves import Curves
from .foreign_files import check_not_foreign
from .labels import LabelMatcher
from .pen_strokes import CURVES_START, read_curves, read_scap
from .svg import read_svg

Drawing = Curves | Bitmap
FileKind = Literal["svg", "scap", "curves", "picture"]

_SIGNATURES: Final = {
    ".png": rb"\x89PNG",
    ".jpg": rb"\xff\xd8\xff",
    ".webp": rb"RIFF",
    ".tif": rb"II\*\0|MM\0\*",
    ".bmp": rb"BM",
    ".gif": rb"GIF8",
    ".pnm": rb"P[1-6]\s",
}
"""First bytes of pictures, by the suffix of their files."""
_PICTURE: Final = re.compile(b"|".join(_SIGNATURES.values()), re.DOTALL)
_DATA_URI: Final = re.compile(rb"""href\s*=\s*["']\s*data:image/[^,"']*;base64,([^"']*)""")
_LINE_END: Final = re.compile(rb"&#\w+;|\s")
_UNLABELLED: Final = {
    "curves": "is a .curves file, whose strokes have no labels",
    "picture": "is a picture, whose strokes have no labels: only red strokes are recognised",
}


def read_file(path: Path) -> bytes:
    """Read a regular file of acceptable length, at least one byte."""
    data = read_bytes(path, MAX_BYTES, "simplify the sketch")
    if not data:
        raise InputError("is empty; save the sketch again", file=path)
    return data


def parse_drawing(
    data: bytes, suffix: str, size: int, *, labels: Sequence[str] = (), view: str | None = None
) -> Drawing:
    """The drawing in the bytes of a file with this suffix, fine enough for a grid of `size` pixels.

    labels: of the curvature lines, as `label_of` returns them; none: colours decide. view: as in
    `read_sketch`. Raises InputError.
    """
    kind = detect_file_kind(data, suffix)
    if labels and kind in _UNLABELLED:
        raise InputError(f"{_UNLABELLED[kind]}; leave the choice of {labels[0]} out")
    if view is not None and kind != "curves":
        raise InputError(
            f"is flat: only a .curves file can be seen from {shortened(view)}; leave the view out"
        )
    if kind == "curves":
        return read_curves(data, view)
    if kind == "picture":
        return read_bitmap(data, size)
    if kind == "scap":
        return read_scap(data, LabelMatcher(frozenset(labels)) if labels else None)
    try:
        return read_svg(data, labels)
    except NoStrokeError:
        picture = _embedded_picture(data)
        if picture is None or labels:
            raise
        return read_bitmap(picture, size)


def _embedded_picture(data: bytes) -> bytes | None:
    """The only picture in the data URIs of an SVG drawing, or None."""
    texts = _DATA_URI.findall(data)
    if len(texts) != 1:
        return None
    try:
        picture = base64.b64decode(_LINE_END.sub(b"", texts[0]))
    except ValueError:
        return None
    return picture if _PICTURE.match(picture) else None


def detect_file_kind(data: bytes, suffix: str) -> FileKind:
    """Kind of a drawing, by its content first and the suffix of its file second. Raises InputError."""
    check_not_foreign(data)
    suffix, start = suffix.lower(), data[:512].lstrip(b"\xef\xbb\xbf \t\r\n")
    if data[:2] == b"\x1f\x8b":
        raise InputError(
            "is compressed; unpack it (gunzip), or save it in Inkscape as Plain SVG, and give the SVG itself"
        )
    is_text = _PICTURE.match(data) is None
    if CURVES_START.match(start) or (suffix == ".curves" and is_text and not start.startswith(b"<")):
        return "curves"
    if start.startswith(b"<") or data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "svg"
    if re.match(rb"#\s*[\d.]", start) or (suffix == ".scap" and is_text):
        return "scap"
    return "svg" if suffix == ".svg" and is_text else "picture"


def suffix_of_picture(data: bytes) -> str:
    """Suffix of a picture by its content; Netpbm's for unknown content."""
    return next((suffix for suffix, start in _SIGNATURES.items() if re.match(start, data)), ".pnm")
