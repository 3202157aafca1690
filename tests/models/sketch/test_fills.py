"""Filled shapes and pictures in SVG drawings: pen strokes, areas, the ground."""

import base64
from functools import cache

import crossfield as cf
import numpy as np
import pytest
from loops import for_each
from PIL import Image, ImageDraw
from small_drawings import BLACK, png, read, svg

BODY = "M50 10C75 10 90 30 90 50S75 90 50 90S10 70 10 50S25 10 50 10Z"
LINES = '<path d="M14 50Q50 30 86 50M50 14Q60 50 50 86" stroke="red" class="flow" {}/>'
FLOW = LINES.format('fill="none"')
OUTLINE = f'<path d="{BODY}" {BLACK}/>'
AREAS = {
    "body": f'<path d="{BODY}" fill="#ffe8a3"/>',
    "shadow": '<path d="M20 65C30 85 50 88 70 80C55 80 35 75 20 65Z" opacity="0.4"/>',
    "crescent": '<path d="M20 65C30 90 50 90 70 80C55 78 35 74 20 65Z" fill="gray"/>',
    "eye": '<circle cx="40" cy="35" r="4"/>',
    "page": '<rect width="100" height="100" fill="#eef"/>',
}
GROUP = f'<g {BLACK}><path d="{BODY}"/>{LINES.format("")}</g>'
"""Outline and curvature lines with the style of their group."""
SILHOUETTE = AREAS["body"] + AREAS["eye"] + FLOW


def assert_read_as_plain(instance):
    """The instance has mask and strokes of the outline and the curvature lines alone, and no warning."""
    plain = plain_drawing()
    assert (instance.mask == plain.mask).all()
    np.testing.assert_array_equal(instance.stroke_pixels, plain.stroke_pixels)
    assert instance.reading.warnings == ()


@cache
def plain_drawing():
    return read(svg(OUTLINE + FLOW))


@for_each(
    "body, options",
    [
        *((area + OUTLINE + FLOW, {}) for area in AREAS.values()),
        (AREAS["body"] + GROUP, {}),
        (AREAS["page"] + GROUP, {}),
        # The edge of a body is the outline where no stroke is.
        (SILHOUETTE, {"curvature": ["class=flow"]}),
        (AREAS["page"] + SILHOUETTE, {}),
        ('<rect width="100" height="100" fill="white"/>' + SILHOUETTE, {"curvature": ["colour=red"]}),
        (AREAS["body"] + FLOW.replace("red", "black"), {"curvature": ["class=flow"]}),
    ],
)
def test_areas_are_no_strokes(body, options):
    assert_read_as_plain(read(svg(body), **options))


PEN = '<path class="{}" d="M{} {}h70v3h-70z" fill="{}"/>'
PEN_OUTLINE = '<path fill-rule="evenodd" d="M5 5H95V95H5ZM8 8V92H92V8Z"/>'
CROSS = '<path {} d="M15 48.5h70v3h-70z"/><path {} d="M48.5 15h3v70h-3z"/>'


@for_each(
    "paint, options",
    [
        ('class="flow"', {"curvature": ["class=flow"]}),
        ('fill="red"', {}),
        ('fill="blue"', {"curvature": ["colour=blue"]}),
    ],
)
def test_filled_pen_strokes_are_read_by_their_middle_lines(paint, options):
    instance = read(svg(PEN_OUTLINE + CROSS.format(paint, paint)), **options)
    places = (instance.stroke_pixels[:, ::-1] + 0.5) * instance.pixel_size + instance.origin
    assert (np.abs(places - 50).min(axis=1) < instance.pixel_size).all()
    assert (np.abs(np.sin(instance.theta)) < 0.1).sum() > 12
    assert (np.abs(np.cos(instance.theta)) < 0.1).sum() > 12
    assert instance.mask.sum() == 20 * 20


def test_pen_strokes_in_the_colour_of_the_page_are_none():
    page, ink = "#121212", "white"
    ground = f'<rect width="100" height="100" fill="{page}"/>'
    outline = PEN_OUTLINE.replace("<path", f'<path fill="{ink}"')
    flow = PEN.format("", 15, 48.5, "red")
    more = read(svg(ground + PEN.format("", 15, 30, page) + outline + flow))
    assert more.sha256 == read(svg(ground + outline + flow)).sha256


def test_a_light_glyph_on_a_dark_page_is_read_by_its_outline():
    glyph = f'<rect width="100" height="100"/><path d="{BODY}" fill="white"/>'
    assert read(svg(glyph)).sha256 == read(svg(OUTLINE)).sha256


def photo():
    image = Image.new("RGB", (200, 160), "white")
    draw = ImageDraw.Draw(image)
    draw.ellipse((20, 20, 180, 140), outline="black", width=3)
    draw.line((30, 80, 170, 80), fill="red", width=3)
    return image


def embedded(kind):
    text = base64.encodebytes(png(photo(), kind)).decode().replace("\n", "&#10;")
    return f'<image width="100" height="80" href="data:image/{kind.lower()};base64,{text}"/>'


@for_each("kind", ["PNG", "JPEG"])
def test_a_drawing_that_is_only_a_picture_is_traced_as_that_picture(kind):
    traced = read(svg('<rect width="100" height="100" fill="white"/>' + embedded(kind)))
    expected = read(png(photo(), kind), source="a.png")
    assert (traced.mask == expected.mask).all()
    np.testing.assert_array_equal(traced.theta, expected.theta)


def test_a_hidden_picture_is_none():
    hidden = embedded("PNG").replace("<image", '<image display="none"')
    assert_read_as_plain(read(svg(hidden + OUTLINE + FLOW)))


@for_each(
    "body, message",
    [
        (f'<clipPath id="c"/><g clip-path="url(#c)">{PEN.format("", 15, 48, "black")}</g>', "are hidden"),
        *(
            (f'<image href="data:image/png;base64,{content}"/>', "draws no stroke|not a whole picture")
            for content in ("bm90IGEgcGljdHVyZQ==", "iVBORw0KGgo=", "!")
        ),
    ],
)
def test_a_drawing_without_strokes_and_without_a_whole_picture_is_refused(body, message):
    with pytest.raises(cf.InputError, match=message):
        read(svg(body))
