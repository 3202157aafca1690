"""Published sketches: places where a script could hide are gone, and every stroke is the same."""

import re

import crossfield as cf
import pytest
from crossfield.models.sketch import publication
from crossfield.models.sketch.publication import publishable_sketch
from loops import for_each
from PIL import Image
from small_drawings import png, read, sample_svg

TURNED = b"""<svg xmlns="http://www.w3.org/2000/svg" width="90mm" height="60mm">
<g transform="rotate(7) scale(1.1 0.9)"><path d="M10 10h70v40q-9 9 -35 3T10 50z m5 5l9 9c1 2 3 4 5 6l7 0"/>
<path stroke="red" fill="none" d="M20 20A30 20 10 0 1 70 30"/><circle cx="40" cy="30" r="9" stroke="red"/>
<path stroke="red" fill="none" d="M70 30L75 30"/><polyline points="75,30 75,45 20,45"/></g></svg>"""


@for_each("data", [TURNED, TURNED.replace(b"<circle", b'<circle opacity=".2"'), sample_svg("mouse").encode()])
def test_a_drawing_is_the_same_when_it_is_drawn_again(data):
    again, suffix = publishable_sketch(data, ".html")
    assert suffix == ".svg"
    assert publishable_sketch(again, ".svg") == (again, ".svg")
    first, second = read(data), read(again)
    assert first.sha256 == second.sha256
    assert first.reading.page == second.reading.page
    assert re.fullmatch(
        r'<svg xmlns="http://www.w3.org/2000/svg"( viewBox="[^"]+")? fill="none" stroke="#000" '
        r'stroke-width="[\d.]+" stroke-linecap="round" stroke-linejoin="round">\n'
        r'(<path( stroke="#c8102e")?( stroke-opacity="[.]3")? d="[-MLCe\d. ]+"/>\n)+</svg>\n',
        again.decode(),
    )


BLANK = Image.new("L", (3, 3), 255)


@for_each(
    "data, suffix, expected",
    [
        (png(BLANK, "GIF") + b"<script>alert(1)</script>", ".html", ".gif"),
        (png(BLANK, "JPEG"), ".svg", ".jpg"),
        (png(BLANK, "PNG"), "", ".png"),
        (png(BLANK, "PPM"), ".html", ".pnm"),
        (b"neither this nor that", ".html", ".pnm"),
        (b"#9 9\n{\n}\n", ".html", ".scap"),
        (b"v 2\n0 0 0\n1 0 0\n", ".svg", ".curves"),
    ],
)
def test_the_suffix_of_a_published_file_follows_from_its_content(data, suffix, expected):
    assert publishable_sketch(data, suffix) == (data, expected)


def test_a_drawing_that_would_be_too_large_to_read_again_is_refused(monkeypatch):
    monkeypatch.setattr(publication, "MAX_DATA", 500)
    with pytest.raises(cf.InputError, match="has paths of more than 500 characters; simplify the drawing"):
        publishable_sketch(TURNED, ".svg")
