"""Documents of drawing programs that are not read, and what to export them as."""

from __future__ import annotations

import re
import zlib
from typing import Final

from ..errors import InputError

_HEAD: Final = 4096  # bytes at the start of a file in which it is recognised
_ZIP: Final = rb"PK\x03\x04"
_MEDIA: Final = rb"....ftyp"


FOREIGN_FILES: Final = (
    ("an AVIF picture", _MEDIA + rb"(avi[fs]|mif1.{4,36}?avif)", "PNG"),
    (
        "a HEIC photo",
        _MEDIA + rb"(hei[cxms]|hev[cx]|mif1|msf1)",
        "PNG or JPEG (on an iPhone: Settings > Camera > Formats > Most Compatible)",
    ),
    ("a JPEG XL picture", rb"\xff\x0a|\0\0\0\x0cJXL ", "PNG"),
    ("a Photoshop document", rb"8BPS", "PNG"),
    ("a Krita document", _ZIP + rb".{26}mimetypeapplication/x-kr", "PNG, or a vector layer as SVG"),
    ("an OpenRaster picture", _ZIP + rb".{26}mimetypeimage/openraster", "PNG"),
    ("a ZIP archive or a document of a drawing program", _ZIP, "SVG or PNG in its program, or unpack it"),
    ("a PDF or an Illustrator document", rb"%PDF", "SVG in Illustrator or Inkscape"),
    ("PostScript", rb"%!PS|\xc5\xd0\xd3\xc6", "SVG in Inkscape"),
    ("a CorelDRAW document", rb"RIFF....(CDR|cdr)", "SVG"),
    ("a Figma document", rb"fig-kiwi", "SVG"),
    ("an Affinity document", rb"\0\xffKA", "SVG"),
    ("an Excalidraw document", rb'\{.*"type"\s*:\s*"excalidraw', "SVG"),
    ("a tldraw document", rb'\{.*"tldraw', "SVG"),
    ("a draw.io document", rb"<mxfile|<mxGraphModel", "SVG"),
    ("a Xournal++ document", rb"(<\?xml[^>]*>\s*)?<xournal", "SVG"),
    ("a document of a painting program", rb"CSFCHUNK|gimp xcf|mdipack|PDN3", "PNG"),
    (
        "a CAD drawing",
        rb"(999\s[^\n]*\n\s*)*0\r?\n\s*SECTION|AutoCAD Binary DXF|AC10\d\d",
        "DXF, and the DXF in Inkscape as SVG",
    ),
    (
        "a mesh or a CAD model",
        rb"glTF|ISO-10303-21|\$MeshFormat|(ply|C?OFF|solid)\s",
        "OBJ or STL, with that suffix, for `crossfield instance`",
    ),
    ("a Blender file", rb"BLENDER", "SVG (Grease Pencil), or a mesh as OBJ"),
)
"""Name, pattern of the first bytes, and export of each kind; of those that fit, the first is right."""


def check_not_foreign(data: bytes) -> None:
    """Raise InputError with the format to export a document of a program that is known and not read."""
    head = data[:_HEAD].lstrip(b"\xef\xbb\xbf \t\r\n")
    if head.startswith(b"\x1f\x8b"):
        head = _unpack_start(head)
    for name, start, export in FOREIGN_FILES:
        if re.match(start, head, re.DOTALL):
            raise InputError(f"is {name}, which is not read; export it as {export}")


def _unpack_start(packed: bytes) -> bytes:
    """The start of what gzip has packed; empty if that is damaged."""
    try:
        return zlib.decompressobj(31).decompress(packed, _HEAD)
    except zlib.error:
        return b""
