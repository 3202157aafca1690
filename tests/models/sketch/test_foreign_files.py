"""Documents of drawing programs are named, with the menu by which they become PNG or SVG."""

import gzip
import io
import zipfile

import crossfield as cf
import pytest
from crossfield.models.errors import InputError
from crossfield.models.sketch.foreign_files import FOREIGN_FILES
from loops import for_each
from small_drawings import svg


def archive(**files):
    """A zip file; its first entry is not packed, as programs write `mimetype`."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as packed:
        for name, content in files.items():
            packed.writestr(name.replace("__", "/"), content)
    return stream.getvalue()


def box(brand, *compatible):
    """The first box of a file in the container of ISO media."""
    content = b"ftyp" + brand + bytes(4) + b"".join(compatible)
    return (len(content) + 4).to_bytes(4, "big") + content + bytes(40)


DOCUMENTS = {
    "photo.heic": (box(b"heic", b"mif1", b"heic"), "a HEIC photo", "Most Compatible"),
    "other.heif": (box(b"mif1", b"mif1", b"heic"), "a HEIC photo", "File > Export"),
    "photo.avif": (box(b"avif", b"avif", b"mif1"), "an AVIF picture", "PNG"),
    "other.avif": (box(b"mif1", b"mif1", b"avif"), "an AVIF picture", "PNG"),
    "a.jxl": (b"\xff\x0a\x10", "a JPEG XL picture", "PNG"),
    "a.psd": (b"8BPS\0\1" + bytes(20), "a Photoshop document", "File > Export > Export As"),
    "a.psb": (b"8BPS\0\2" + bytes(20), "a Photoshop document", "PNG"),
    "a.kra": (archive(mimetype="application/x-krita", maindoc=""), "a Krita document", "Save Vector Layer"),
    "a.ora": (archive(mimetype="image/openraster"), "an OpenRaster picture", "File > Export"),
    "a.odg": (
        archive(mimetype="application/vnd.oasis.opendocument.graphics"),
        "a LibreOffice document",
        "SVG",
    ),
    "a.procreate": (archive(**{"Document.archive": "bplist00"}), "a Procreate document", "Actions > Share"),
    "a.fig": (archive(**{"meta.json": "{}", "canvas.fig": ""}), "a Figma document", "right panel"),
    "old.fig": (b"fig-kiwi\x0f\0\0\0", "a Figma document", "right panel"),
    "a.sketch": (archive(**{"document.json": "{}"}), "a Sketch document", "Make Exportable"),
    "a.cdr": (archive(**{"content__riffData.cdr": ""}), "a CorelDRAW document", "File > Export"),
    "old.cdr": (b"RIFF\0\1\0\0CDRA", "a CorelDRAW document", "SVG"),
    "a.pptx": (archive(**{"[Content_Types].xml": ""}), "an Office document", "Inkscape"),
    "a.zip": (archive(**{"a.svg": svg("")}), "a ZIP archive", "unpack it"),
    "a.ai": (b"%PDF-1.6\n%\xe2\xe3\n/AIPrivateData1 5 0 R", "an Illustrator document", "Export As"),
    "a.pdf": (b"%PDF-1.7\n", "a PDF", "Inkscape"),
    "a.eps": (b"%!PS-Adobe-3.0 EPSF-3.0\n", "PostScript", "Inkscape"),
    "dos.eps": (b"\xc5\xd0\xd3\xc6" + bytes(30), "PostScript", "SVG"),
    "a.afdesign": (b"\0\xffKA\x0b\0", "an Affinity document", "File > Export"),
    "a.excalidraw": (b'{\n  "type": "excalidraw",\n "version": 2}', "an Excalidraw document", "Export image"),
    "a.tldr": (b'{"tldrawFileFormatVersion":1}', "a tldraw document", "Export all as"),
    "a.drawio": (b'<mxfile host="app.diagrams.net">', "a draw.io document", "Export as"),
    "a.xopp": (gzip.compress(b'<?xml version="1.0"?>\n<xournal creator="x">'), "a Xournal++ document", "SVG"),
    "a.clip": (b"CSFCHUNK" + bytes(20), "a Clip Studio document", "Single Layer"),
    "a.xcf": (b"gimp xcf v011\0", "a GIMP document", "Export As"),
    "a.mdp": (b"mdipack\0", "a MediBang document", "Save As"),
    "a.pdn": (b"PDN3\x10", "a Paint.NET document", "Save As"),
    "a.dxf": (b"  0\r\nSECTION\r\n  2\r\nHEADER\r\n", "a CAD drawing", "Inkscape"),
    "noted.dxf": (b"999\nmade by hand\n  0\nSECTION\n", "a CAD drawing", "Inkscape"),
    "a.dwg": (b"AC1032\0\0", "a CAD drawing", "DXF"),
    "a.blend": (b"BLENDER-v405", "a Blender file", "Grease Pencil as SVG"),
}


@for_each("name", DOCUMENTS)
def test_a_document_of_another_program_is_refused_with_the_menu_of_that_program(name, tmp_path):
    data, what, menu = DOCUMENTS[name]
    for path in (tmp_path / name, tmp_path / "renamed.png", tmp_path / "renamed.svg"):
        path.write_bytes(data)
        with pytest.raises(InputError) as caught:
            cf.read_sketch(path)
        message = str(caught.value)
        assert message.startswith(f"{path}: is {what}, which is not read; export it as "), message
        assert menu in message
        assert len(message.splitlines()) == 1


def test_every_kind_is_tried_and_what_is_read_stays_so(tmp_path):
    assert {kind.name for kind in FOREIGN_FILES} == {what for _, what, _ in DOCUMENTS.values()}
    drawn = '<path d="M10 10H90V90H10Z" fill="none" stroke="black"/>'
    for name, data in {
        "a.svg": svg(f'<metadata>"type":"excalidraw" %PDF</metadata>{drawn}'),
        "b.svg": b"\xef\xbb\xbf\n<!-- <mxfile --> " + svg(drawn),
    }.items():
        (tmp_path / name).write_bytes(data)
        assert cf.read_sketch(tmp_path / name).grid.size
