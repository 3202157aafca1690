"""Filled shapes and pictures in SVG drawings: pen strokes, areas, the ground."""

import base64
import io

import crossfield as cf
import numpy as np
import pytest
from PIL import Image, ImageDraw

BODY = "M50 10C75 10 90 30 90 50S75 90 50 90S10 70 10 50S25 10 50 10Z"
FLOW = '<path d="M14 50Q50 30 86 50M50 14Q60 50 50 86" fill="none" stroke="red" class="flow"/>'
OUTLINE = f'<path d="{BODY}" fill="none" stroke="black"/>'


def read(tmp_path, *shapes, **options):
    path = tmp_path / "drawing.svg"
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{"".join(shapes)}</svg>')
    return cf.read_sketch(path, **options)


@pytest.fixture
def plain(tmp_path):
    return read(tmp_path, OUTLINE, FLOW)


AREAS = {
    "body": f'<path d="{BODY}" fill="#ffe8a3"/>',
    "shadow": '<path d="M20 65C30 85 50 88 70 80C55 80 35 75 20 65Z" opacity="0.4"/>',
    "crescent": '<path d="M20 65C30 90 50 90 70 80C55 78 35 74 20 65Z" fill="gray"/>',
    "eye": '<circle cx="40" cy="35" r="4"/>',
    "page": '<rect width="100" height="100" fill="#eef"/>',
}


@pytest.mark.parametrize("name", AREAS)
def test_areas_are_no_strokes(name, plain, tmp_path):
    read_with = read(tmp_path, AREAS[name], OUTLINE, FLOW)
    assert (read_with.mask == plain.mask).all()
    np.testing.assert_array_equal(read_with.stroke_pixels, plain.stroke_pixels)
    assert read_with.reading.warnings == plain.reading.warnings == ()


@pytest.mark.parametrize("ground", ["", AREAS["page"], '<rect width="100" height="100" fill="white"/>'])
@pytest.mark.parametrize("options", [{}, {"curvature": ["class=flow"]}, {"curvature": ["colour=red"]}])
def test_the_edge_of_a_body_is_the_outline_where_no_stroke_is(ground, options, plain, tmp_path):
    body = AREAS["body"] + AREAS["eye"]
    silhouette = read(tmp_path, ground, body, FLOW, **options)
    assert (silhouette.mask == plain.mask).all()
    np.testing.assert_array_equal(silhouette.stroke_pixels, plain.stroke_pixels)


def test_labels_of_black_lines_leave_the_edge_of_a_body_to_the_outline(plain, tmp_path):
    flow = FLOW.replace("red", "black")
    labelled = read(tmp_path, AREAS["body"], flow, curvature=["class=flow"])
    assert (labelled.mask == plain.mask).all()


def photo():
    image = Image.new("RGB", (200, 160), "white")
    draw = ImageDraw.Draw(image)
    draw.ellipse((20, 20, 180, 140), outline="black", width=3)
    draw.line((30, 80, 170, 80), fill="red", width=3)
    return image


def embedded(kind):
    stream = io.BytesIO()
    photo().save(stream, kind)
    text = base64.encodebytes(stream.getvalue()).decode().replace("\n", "&#10;")
    return f'<image width="100" height="80" href="data:image/{kind.lower()};base64,{text}"/>'


@pytest.mark.parametrize("kind", ["PNG", "JPEG"])
def test_a_drawing_that_is_only_a_picture_is_traced_as_that_picture(kind, tmp_path):
    photo().save(tmp_path / f"drawing.{kind.lower()}")
    expected = cf.read_sketch(tmp_path / f"drawing.{kind.lower()}")
    traced = read(tmp_path, '<rect width="100" height="100" fill="white"/>', embedded(kind))
    assert (traced.mask == expected.mask).all()
    np.testing.assert_array_equal(traced.theta, expected.theta)


def test_a_picture_below_strokes_is_named_as_left_out(plain, tmp_path):
    read_with = read(tmp_path, embedded("PNG"), OUTLINE, FLOW)
    assert (read_with.mask == plain.mask).all()
    assert read_with.reading.warnings == (
        "1 picture is left out, first <image>; give a picture as a file of its own to trace it",
    )
    hidden = embedded("PNG").replace("<image", '<image display="none"')
    assert read(tmp_path, hidden, OUTLINE, FLOW).reading.warnings == ()


@pytest.mark.parametrize(
    "content",
    ["bm90IGEgcGljdHVyZQ==", "iVBORw0KGgo=", "!"],
    ids=["other bytes", "half a picture", "no base64"],
)
def test_a_drawing_without_strokes_and_without_a_whole_picture_is_refused(content, tmp_path):
    with pytest.raises(cf.InputError, match=r"draws no stroke|not a whole picture"):
        read(tmp_path, f'<image href="data:image/png;base64,{content}"/>')
