"""Sketches of a library: only strokes are published."""

import pytest
from crossfield.export.library.building.verification import verify_library
from crossfield.models.instance.file import read_instance
from libraries import library_of
from small_drawings import read

pytestmark = pytest.mark.usefixtures("short_searches")

HOSTILE = b"""<?xml version="1.0"?><?xml-stylesheet href="http://evil.example/a.css"?>
<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" "http://evil.example/svg11.dtd">
<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 150 110"
 onload="alert('loaded')"><title>evil title</title><!-- evil comment --><metadata>evil</metadata>
<script>alert('script')</script><script href="http://evil.example/x.js"/>
<style>@import url(http://evil.example/style.css); path { filter: url(http://evil.example/f#x) }</style>
<image xlink:href="http://evil.example/track.png" width="150" height="110"/>
<use xlink:href="http://evil.example/other.svg#a"/>
<foreignObject><iframe xmlns="http://www.w3.org/1999/xhtml" src="http://evil.example"/></foreignObject>
<a xlink:href="javascript:alert(1)"><g fill="none" stroke="#000"><path d="M20 30H120V90H20Z"/>
<path d="M20 60H120" stroke="#e00000" onclick="alert('clicked')"/>
<path id="&quot;&gt;&lt;script&gt;" d="M70 30V90" stroke="#e00000"/></g></a>
<text>http://evil.example</text><animate href="#a" attributeName="d"/></svg>"""
SHOWN = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 150 110" fill="none" stroke="#000" \
stroke-width="0.375" stroke-linecap="round" stroke-linejoin="round">
<path d="M20 30L120 30 120 90 20 90 20 30"/>
<path stroke="#c8102e" d="M20 60L120 60M70 30L70 90"/>
</svg>
"""
SPEC = """formulations = ["qp-fixed"]
[rungs.medium]
sizes = [8]
formats = ["lp"]
[[sketches]]
name = "evil"
file = "evil.html"
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sketches")
    (folder / "evil.html").write_bytes(HOSTILE)
    return library_of(folder, SPEC).folder


def test_a_published_sketch_has_its_strokes_and_nothing_else_of_its_file(built):
    assert (built / "cf_evil.sketch.svg").read_text() == SHOWN
    instance = read_instance(built / "cf_evil_n008.instance.json")
    wanted = read(HOSTILE, 8, "evil.html")
    assert (instance.theta.tolist(), instance.w.tolist()) == (wanted.theta.tolist(), wanted.w.tolist())
    assert verify_library(built) == []
    for path in built.iterdir():
        for word in (b"evil.example", b"alert", b"evil title", b"foreignObject"):
            assert word not in path.read_bytes(), path.name
