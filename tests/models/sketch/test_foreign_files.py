"""Documents of drawing programs are named, with what to export them as."""

import gzip
import io
import zipfile

import crossfield as cf
import pytest
from loops import for_each
from small_drawings import BLACK, read, svg


def archive(**files):
    """A zip file; its first entry is not packed, as programs write `mimetype`."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as packed:
        for name, content in files.items():
            packed.writestr(name, content)
    return stream.getvalue()


def box(brand, *compatible):
    """The first box of a file in the container of ISO media."""
    content = b"ftyp" + brand + bytes(4) + b"".join(compatible)
    return (len(content) + 4).to_bytes(4, "big") + content + bytes(40)


DOCUMENTS = [
    (box(b"heic", b"mif1", b"heic"), "a HEIC photo"),
    (box(b"mif1", b"mif1", b"heic"), "a HEIC photo"),
    (box(b"avif", b"avif", b"mif1"), "an AVIF picture"),
    (box(b"mif1", b"mif1", b"avif"), "an AVIF picture"),
    (b"\xff\x0a\x10", "a JPEG XL picture"),
    (b"8BPS\0\1" + bytes(20), "a Photoshop document"),
    (archive(mimetype="application/x-krita", maindoc=""), "a Krita document"),
    (archive(mimetype="image/openraster"), "an OpenRaster picture"),
    (archive(drawing=svg("")), "a ZIP archive or a document of a drawing program"),
    (b"fig-kiwi\x0f\0\0\0", "a Figma document"),
    (b"RIFF\0\1\0\0CDRA", "a CorelDRAW document"),
    (b"%PDF-1.7\n", "a PDF or an Illustrator document"),
    (b"%!PS-Adobe-3.0 EPSF-3.0\n", "PostScript"),
    (b"\xc5\xd0\xd3\xc6" + bytes(30), "PostScript"),
    (b"\0\xffKA\x0b\0", "an Affinity document"),
    (b'{\n  "type": "excalidraw",\n "version": 2}', "an Excalidraw document"),
    (b'{"tldrawFileFormatVersion":1}', "a tldraw document"),
    (b'<mxfile host="app.diagrams.net">', "a draw.io document"),
    (gzip.compress(b'<?xml version="1.0"?>\n<xournal creator="x">'), "a Xournal++ document"),
    (b"CSFCHUNK" + bytes(20), "a document of a painting program"),
    (b"gimp xcf v011\0", "a document of a painting program"),
    (b"mdipack\0", "a document of a painting program"),
    (b"PDN3\x10", "a document of a painting program"),
    (b"  0\r\nSECTION\r\n  2\r\nHEADER\r\n", "a CAD drawing"),
    (b"999\nmade by hand\n  0\nSECTION\n", "a CAD drawing"),
    (b"AC1032\0\0", "a CAD drawing"),
    (b"glTF\2\0\0\0", "a mesh or a CAD model"),
    (b"ISO-10303-21;\n", "a mesh or a CAD model"),
    (b"solid part\n", "a mesh or a CAD model"),
    (b"BLENDER-v405", "a Blender file"),
]


@for_each("data, what", DOCUMENTS)
def test_a_document_of_another_program_is_refused_with_what_to_export(data, what, tmp_path):
    for name in ("document", "renamed.svg"):
        path = tmp_path / name
        path.write_bytes(data)
        with pytest.raises(cf.InputError) as caught:
            cf.read_sketch(path)
        message = str(caught.value)
        assert message.startswith(f"{path}: is {what}, which is not read; export it as "), message
        assert len(message.splitlines()) == 1


def test_words_of_other_programs_in_a_drawing_do_no_harm():
    drawn = f'<path d="M10 10H90V90H10Z" {BLACK}/>'
    named = svg(f'<metadata>"type":"excalidraw" %PDF</metadata>{drawn}')
    commented = b"\xef\xbb\xbf\n<!-- <mxfile --> " + svg(drawn)
    assert read(named).sha256 == read(commented).sha256 == read(svg(drawn)).sha256
