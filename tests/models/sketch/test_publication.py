"""Published sketches: places where a script could hide are gone, and every stroke is the same."""

import re

import numpy as np
import pytest
from crossfield.models.errors import InputError
from crossfield.models.sketch import publication
from crossfield.models.sketch.publication import publishable_sketch, svg_of_curves
from crossfield.models.sketch.samples import SAMPLES, sample_svg
from crossfield.models.sketch.svg import read_svg
from loops import for_each
from PIL import Image
from small_drawings import png, read

DRAWN = [name for name, known in SAMPLES.items() if known.kind == "sketch"]
TURNED = b"""<svg xmlns="http://www.w3.org/2000/svg" width="90mm" height="60mm">
<g transform="rotate(7) scale(1.1 0.9)"><path d="M10 10h70v40q-9 9 -35 3T10 50z m5 5l9 9c1 2 3 4 5 6l7 0"/>
<path stroke="red" fill="none" d="M20 20A30 20 10 0 1 70 30"/><circle cx="40" cy="30" r="9" stroke="red"/>
<path stroke="red" fill="none" d="M70 30L75 30"/><polyline points="75,30 75,45 20,45"/></g></svg>"""


@for_each("name", [*DRAWN, ""])
def test_a_drawing_is_the_same_when_it_is_drawn_again(name):
    data = sample_svg(name).encode() if name else TURNED
    first, again = read_svg(data), svg_of_curves(read_svg(data))
    second = read_svg(again)
    assert svg_of_curves(second) == again
    assert (first.page, first.curve.tolist()) == (second.page, second.curve.tolist())
    assert first.red.tolist() == second.red.tolist()
    assert np.array_equal(first.points[:, [0, 3]], second.points[:, [0, 3]])
    assert np.allclose(first.points, second.points, rtol=1e-9, atol=0)
    instances = [read(content) for content in (data, again)]
    assert instances[0].sha256 == instances[1].sha256
    assert re.fullmatch(
        r'<svg xmlns="http://www.w3.org/2000/svg"( viewBox="[^"]+")? fill="none" stroke="#000" '
        r'stroke-width="[\d.]+" stroke-linecap="round" stroke-linejoin="round">\n'
        r'(<path( stroke="#c8102e")? d="[-MLCe\d. ]+"/>\n)+</svg>\n',
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
        (TURNED, ".html", ".svg"),
    ],
)
def test_the_suffix_of_a_published_file_follows_from_its_content(data, suffix, expected):
    content, published = publishable_sketch(data, suffix)
    assert published == expected
    assert publishable_sketch(content, suffix) == (content, published)
    assert (content == data) == (published != ".svg")


def test_a_drawing_that_would_be_too_large_to_read_again_is_refused(monkeypatch):
    monkeypatch.setattr(publication, "MAX_DATA", 500)
    with pytest.raises(InputError, match="has paths of more than 500 characters; simplify the drawing"):
        publishable_sketch(TURNED, ".svg")
