"""Small drawings as bytes, and their instances."""

import io
import tempfile
from importlib.resources import files
from pathlib import Path

import crossfield as cf

BLACK = 'fill="none" stroke="black"'
RED = 'fill="none" stroke="#d1242f"'
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
"""A box with two curvature lines, and everything in which a script or an address can hide."""


def svg(body, head='viewBox="0 0 100 100"'):
    """An SVG drawing of these elements."""
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
        f'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" {head}>{body}</svg>'
    ).encode()


def sample_svg(name):
    """The SVG text of a built-in sketch."""
    return (files("crossfield") / f"models/sketch/drawings/{name}.svg").read_text("utf-8")


def png(image, kind="PNG", **options):
    """The bytes of a picture."""
    stream = io.BytesIO()
    image.save(stream, kind, **options)
    return stream.getvalue()


def read(data, size=24, source="a.svg", **options):
    """The instance of a drawing in the bytes of a file of this name."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, source)
        path.write_bytes(data)
        return cf.read_sketch(path, size=size, name="a", **options)
