"""Documents of drawing programs that are not read, with the menu by which each becomes a file that is."""

from __future__ import annotations

import re
import zlib
from typing import Final, NamedTuple

from ..errors import InputError

_HEAD: Final = 4096  # bytes at the start of a file in which it is recognised
_ZIP: Final = rb"PK\x03\x04"
_FIRST: Final = _ZIP + rb".{26}mimetype"  # an archive that states its kind at its start
_MEDIA: Final = rb"....ftyp"


class ForeignFile(NamedTuple):
    """A kind of file: what it is, a pattern of its first bytes, and how to export it.

    anywhere: bytes that it also has, such as the name of a file in an archive.
    """

    name: str
    start: bytes
    export: str
    anywhere: bytes = b""


FOREIGN_FILES: Final = (
    ForeignFile("an AVIF picture", _MEDIA + rb"(avi[fs]|mif1.{4,36}?avif)", "PNG: in GIMP or Preview"),
    ForeignFile(
        "a HEIC photo",
        _MEDIA + rb"(hei[cxms]|hev[cx]|mif1|msf1)",
        "PNG or JPEG: File > Export in Photos or Preview; for JPEG photos of an iPhone: Settings > Camera > "
        "Formats > Most Compatible",
    ),
    ForeignFile("a JPEG XL picture", rb"\xff\x0a|\0\0\0\x0cJXL ", "PNG: in GIMP or Krita"),
    ForeignFile("a Photoshop document", rb"8BPS", "PNG: File > Export > Export As"),
    ForeignFile(
        "a Krita document",
        _FIRST + rb"application/x-kr",
        "PNG: File > Export; a vector layer: Layer > Import/Export > Save Vector Layer as SVG",
    ),
    ForeignFile("an OpenRaster picture", _FIRST + rb"image/openraster", "PNG: File > Export"),
    ForeignFile("a LibreOffice document", _FIRST + rb"application/vnd\.oasis", "SVG: File > Export"),
    ForeignFile("a Procreate document", _ZIP, "PNG: Actions > Share > PNG", b"Document.archive"),
    ForeignFile("a Figma document", _ZIP, "SVG: select the frame, Export in the right panel", b"canvas.fig"),
    ForeignFile("a Figma document", rb"fig-kiwi", "SVG: select the frame, Export in the right panel"),
    ForeignFile("a CorelDRAW document", _ZIP, "SVG: File > Export", b"riffData.cdr"),
    ForeignFile("a CorelDRAW document", rb"RIFF....(CDR|cdr)", "SVG: File > Export"),
    ForeignFile("a Sketch document", _ZIP, "SVG: select the artboard, Make Exportable", b"document.json"),
    ForeignFile("an Office document", _ZIP, "PDF, and the PDF in Inkscape as SVG", b"[Content_Types].xml"),
    ForeignFile("a ZIP archive", _ZIP, "PNG or SVG in the program that wrote it, or unpack it"),
    ForeignFile("an Illustrator document", rb"%PDF", "SVG: File > Export > Export As", b"AIPrivateData"),
    ForeignFile("a PDF", rb"%PDF", "SVG: open it in Inkscape, File > Save As > Plain SVG"),
    ForeignFile("PostScript", rb"%!PS|\xc5\xd0\xd3\xc6", "SVG: in Inkscape, File > Save As > Plain SVG"),
    ForeignFile("an Affinity document", rb"\0\xffKA", "SVG or PNG: File > Export"),
    ForeignFile(
        "an Excalidraw document", rb'\{.*"type"\s*:\s*"excalidraw', "SVG or PNG: Menu > Export image"
    ),
    ForeignFile("a tldraw document", rb'\{.*"tldraw', "SVG: Menu > Export all as > SVG"),
    ForeignFile("a draw.io document", rb"<mxfile|<mxGraphModel", "SVG: File > Export as > SVG"),
    ForeignFile("a Xournal++ document", rb"(<\?xml[^>]*>\s*)?<xournal", "SVG: File > Export As"),
    ForeignFile("a Clip Studio document", rb"CSFCHUNK", "PNG: File > Export (Single Layer) > .png"),
    ForeignFile("a GIMP document", rb"gimp xcf", "PNG: File > Export As"),
    ForeignFile("a MediBang document", rb"mdipack", "PNG: File > Save As"),
    ForeignFile("a Paint.NET document", rb"PDN3", "PNG: File > Save As"),
    ForeignFile(
        "a CAD drawing",
        rb"(999\s[^\n]*\n\s*)*0\r?\n\s*SECTION|AutoCAD Binary DXF|AC10\d\d",
        "SVG: open it as DXF in Inkscape, File > Save As > Plain SVG",
    ),
    ForeignFile("a Blender file", rb"BLENDER", "SVG: File > Export > Grease Pencil as SVG; a mesh as OBJ"),
)
"""The kinds that are recognised; of those that fit, the first is right."""


def check_not_foreign(data: bytes) -> None:
    """Raise InputError with the way to export a document of a program that is known and not read."""
    head = data[:_HEAD].lstrip(b"\xef\xbb\xbf \t\r\n")
    if head.startswith(b"\x1f\x8b"):
        head = _unpack_start(head)
    for kind in FOREIGN_FILES:
        if re.match(kind.start, head, re.DOTALL) and kind.anywhere in data:
            raise InputError(f"is {kind.name}, which is not read; export it as {kind.export}")


def _unpack_start(packed: bytes) -> bytes:
    """The start of what gzip has packed; empty if that is damaged."""
    try:
        return zlib.decompressobj(31).decompress(packed, _HEAD)
    except zlib.error:
        return b""
