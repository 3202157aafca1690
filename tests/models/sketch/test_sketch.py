"""From sketches to instances: SVG, bitmaps and .scap, masks, colours, and everything that must be refused."""

import contextlib
import os
import re
import struct
import zlib

import numpy as np
import pytest
from crossfield.models.errors import CrossfieldError, InputError
from crossfield.models.instance.angles import line_difference
from crossfield.models.instance.file import read_instance, write_instance
from crossfield.models.instance.instance import name_from_text
from crossfield.models.instance.symmetries import mirrored, transposed, turned
from crossfield.models.sketch.bitmap import read_bitmap
from crossfield.models.sketch.cover import Frame, cover_by_segments
from crossfield.models.sketch.curves import flatten
from crossfield.models.sketch.pen_strokes import read_scap
from crossfield.models.sketch.read import read_sketch
from crossfield.models.sketch.svg import read_svg
from hypothesis import given, settings
from hypothesis import strategies as st
from loops import for_each
from PIL import Image, ImageDraw, ImageOps
from scipy import ndimage
from small_drawings import BLACK, RED, png, read, svg

LINE = f'<path d="M10 10 L90 90" {BLACK}/>'


def as_map(instance, values):
    """Values of the stroke pixels as a picture, nan elsewhere."""
    picture = np.full(instance.mask.shape, np.nan)
    picture[tuple(instance.stroke_pixels.T)] = values
    return picture


def assert_same(first, second, angle=1e-6, weight=1e-6):
    """Both instances have the same mask, the same stroke pixels and lines as good as equal."""
    assert (first.mask == second.mask).all()
    assert (first.stroke_pixels == second.stroke_pixels).all()
    assert line_difference(first.theta, second.theta).max() < angle
    assert np.abs(first.w - second.w).max() < weight


# --- lines on the grid --------------------------------------------------------------------------------------


def test_a_falling_line_has_135_degrees_and_covers_the_diagonal():
    instance = read(svg(LINE), size=12)
    assert instance.mask.shape == (12, 12)
    assert instance.pixel_size == pytest.approx(8)  # 80 units in 10 pixels, one pixel of margin
    assert instance.origin == pytest.approx((2, 2))
    np.testing.assert_allclose(instance.theta, 3 * np.pi / 4)  # y is down in the file and up in the instance
    assert (instance.stroke_pixels == np.stack([np.arange(1, 11)] * 2, axis=1)).all()
    np.testing.assert_allclose(instance.w, 1)
    assert instance.source == "a.svg"


def test_cover_agrees_with_dense_sampling():
    rng = np.random.default_rng(5)
    segments = rng.uniform(-3, 15, (40, 2, 2))
    frame = Frame(x=1.0, y=-1.0, pixel=1.5, height=6, width=8)
    cover = cover_by_segments(segments, frame)
    t = (np.arange(40_000) + 0.5) / 40_000
    amount, sums = np.zeros((6, 8)), np.zeros((6, 8), dtype=complex)
    for start, end in segments:
        column, row = np.floor(((start + np.outer(t, end - start)) - (1.0, -1.0)) / 1.5).astype(int).T
        inside = (row >= 0) & (row < 6) & (column >= 0) & (column < 8)
        length = np.hypot(*(end - start)) / 1.5 / len(t)
        angle = np.arctan2(-(end - start)[1], (end - start)[0])
        np.add.at(amount, (row[inside], column[inside]), length)
        np.add.at(sums, (row[inside], column[inside]), length * np.exp(2j * angle))
    np.testing.assert_allclose(cover.amount, amount, atol=5e-3)
    np.testing.assert_allclose(cover.direction[..., 0] * cover.amount, sums.real, atol=5e-3)
    np.testing.assert_allclose(cover.direction[..., 1] * cover.amount, sums.imag, atol=5e-3)


def test_a_line_along_a_pixel_edge_is_shared_by_both_sides():
    cover = cover_by_segments(np.array([[[0.0, 2.0], [4.0, 2.0]]]), Frame(0, 0, 1, 4, 4))
    np.testing.assert_allclose(cover.amount, np.array([[0, 0.5, 0.5, 0]] * 4).T)


@given(st.lists(st.floats(-50, 50), min_size=8, max_size=8), st.floats(1e-3, 5))
def test_flattening_stays_within_its_tolerance(numbers, tolerance):
    points = np.array(numbers).reshape(1, 4, 2)
    segments, owner = flatten(points, tolerance)
    assert (owner == 0).all()
    np.testing.assert_allclose(segments[0, 0], points[0, 0])
    np.testing.assert_allclose(segments[-1, 1], points[0, 3], atol=1e-12)
    t = (np.arange(len(segments)) + 0.5)[:, None] / len(segments)
    b = [(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3]
    true = sum(weight * point for weight, point in zip(b, points[0], strict=True))
    assert np.hypot(*(true - segments.mean(axis=1)).T).max() <= tolerance * (1 + 1e-9)


@pytest.mark.parametrize("size", [1, 2, 3, 4, 5, 7, 100])
def test_the_longer_side_has_as_many_pixels_as_asked_for(size):
    assert max(read(svg(f'<path d="M5 5Q60 5 95 45" {BLACK}/>'), size).mask.shape) == size


# --- SVG ----------------------------------------------------------------------------------------------------

SAME_LINE = {
    "line": f'<line x1="10" y1="10" x2="90" y2="90" {BLACK}/>',
    "polyline": f'<polyline points="10,10 50,50,90 90" {BLACK}/>',
    "compact": f'<path d="m10 10l40 40 40,40" {BLACK}/>',
    "style": '<path d="M10,10L90,90" style="fill:none;stroke:#000"/>',
    "class": '<style>.st0{fill:none;stroke:#000000;}</style><path class="st0" d="M10 10L90 90"/>',
    "class in defs": (
        '<defs><style type="text/css"><![CDATA[ .a, .st0 { stroke : #000000 } ]]></style></defs>'
        '<path fill="none" class="x st0" d="M10 10L90 90"/>'
    ),
    "class after use": (
        '<path class="st0" d="M10 10L90 90"/><style>/* late */ @import url(http://x.y/z.css); '
        ".st0{fill:none;stroke:#000000}</style>"
    ),
    "id": '<style>path{stroke:none} #p{stroke:black}</style><path id="p" fill="none" d="M10 10L90 90"/>',
    "media": (
        "<style>@media print { .p { stroke: none } } path.p{stroke:black !important}</style>"
        '<path class="p" fill="none" d="M10 10L90 90"/>'
    ),
    "group": '<g stroke="black"><g fill="none"><path d="M10 10L90 90"/></g></g>',
    "current colour": '<g color="black" stroke="currentColor"><path fill="none" d="M10 10L90 90"/></g>',
    "transforms": (
        '<g transform="translate(5 5)"><g transform="scale(2) rotate(90)">'
        f'<path d="M2.5 -2.5L42.5 -42.5" {BLACK}/></g></g>'
    ),
    "origin": f'<path d="M90 190 10 110" transform="rotate(180)" transform-origin="bottom" {BLACK}/>',
    "use": (
        f'<defs><path id="l" d="M0 0L80 80" {BLACK}/></defs>'
        '<use xlink:href="#l" x="5" y="5" transform="translate(5 5)"/>'
    ),
    "symbol": (
        f'<symbol id="s" viewBox="0 0 10 10"><path d="M0 0L10 10" {BLACK}/></symbol>'
        '<use href="#s" x="10" y="10" width="80" height="80"/>'
    ),
    "inner svg": (
        f'<svg x="10" y="10" width="80" height="80" viewBox="0 0 8 8"><path d="M0 0L8 8" {BLACK}/></svg>'
    ),
    "straight cubic": f'<path d="M10 10C40 40 60 60 90 90" {BLACK}/>',
    "straight quadratic": f'<path d="M10 10Q50 50 90 90" {BLACK}/>',
    "unused things": LINE
    + (
        f'<defs>{LINE.replace("10 10", "0 50")}</defs><clipPath><path d="M0 0H100" {BLACK}/>'
        f'</clipPath><symbol><path d="M0 0H100" {BLACK}/></symbol>'
    ),
    "invisible things": '<rect width="100%" height="100%" fill="#fff"/>'
    + LINE
    + (
        '<g display="none"><path d="M0 0H100" stroke="black"/></g>'
        '<path visibility="hidden" d="M0 0H100" stroke="black"/>'
    )
    + ('<path d="M0 0H100" stroke="white"/><path d="M0 0H100" style="opacity:0" stroke="black"/>')
    + (
        '<path d="M0 0H100" fill="none" stroke="black" stroke-width="0"/>'
        '<path d="M0 0H100V9" fill-opacity="0"/><g style="display:none"><circle r="9"/></g>'
    ),
    "outside things": LINE
    + '<image href="http://a.b/c.png" width="100" height="3"/><use href="other.svg#x"/><text>hello</text>',
    "itself": f'<g id="g">{LINE}<use href="#g"/></g>',
}


@for_each("name", SAME_LINE)
def test_all_ways_to_draw_a_line_give_the_same_instance(name):
    assert_same(read(svg(SAME_LINE[name])), read(svg(LINE)), weight=1e-6)


@pytest.mark.parametrize(
    "data",
    [
        b'<?xml version="1.0"?><!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" '
        b'"http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd">' + svg(LINE),
        svg(LINE).decode().encode("utf-16"),
        b"\xef\xbb\xbf\n" + svg(LINE),
        svg(LINE, 'width="100mm" height="80mm"'),
        svg(LINE, ""),
        svg(LINE).replace(b' xmlns="http://www.w3.org/2000/svg"', b""),
    ],
    ids=["doctype", "utf-16", "byte order mark", "size only", "no size", "no namespace"],
)
def test_documents_of_many_programs_are_read(data):
    assert_same(read(data), read(svg(LINE)))


CIRCLES = {
    "circle": f'<circle cx="50" cy="50" r="40" {BLACK}/>',
    "ellipse": f'<ellipse cx="25" cy="50" rx="20" ry="40" transform="matrix(2 0 0 1 0 0)" {BLACK}/>',
    "ellipse with one radius": f'<ellipse cx="50" cy="50" ry="40" {BLACK}/>',
    "arcs": f'<path d="M10 50a40 40 0 0180 0 40 40 0 01-80 0z" {BLACK}/>',
    "rounded rectangle": f'<rect x="10" y="10" width="80" height="80" rx="40" {BLACK}/>',
}


@pytest.mark.parametrize("name", CIRCLES)
def test_round_shapes_have_their_tangents(name):
    instance = read(svg(CIRCLES[name]), size=60)
    row, column = instance.stroke_pixels.T
    x = instance.origin[0] + (column + 0.5) * instance.pixel_size - 50
    y = 50 - instance.origin[1] - (row + 0.5) * instance.pixel_size
    assert np.degrees(line_difference(instance.theta, np.arctan2(x, -y))).max() < 2
    assert np.abs(np.hypot(x, y) - 40).max() < 1.5
    assert instance.mask.sum() * instance.pixel_size**2 == pytest.approx(np.pi * 41**2, rel=0.02)


def test_a_stroke_exported_as_a_filled_outline_keeps_its_direction():
    outline = '<path d="M10 48L90 48L90 52L10 52Z M40 20 L44 20 L44 40 L40 40 Z" fill="#222"/>'
    instance = read(svg(outline), size=20)
    level = line_difference(instance.theta, np.zeros_like(instance.theta)) < 1e-6
    assert 0.6 < level.mean() < 1
    assert np.allclose(instance.theta[~level & (instance.w > 0.9)], np.pi / 2)


def test_the_control_points_of_a_curve_do_not_widen_its_box():
    curves = read_svg(svg(f'<path d="M0 0C0 40 40 40 40 0" {BLACK}/>'))
    np.testing.assert_allclose(curves.box, (0, 0, 40, 30), atol=0.01)


# --- turning and mirroring ----------------------------------------------------------------------------------


def moved(body, matrix):
    return svg(f'<g transform="matrix({matrix})">{body}</g>')


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([16, 24, 33]))
def test_moving_a_drawing_moves_its_instance(seed, size):
    points = np.random.default_rng(seed).uniform(5, 95, (6, 8))
    paths = [
        f"M{a:.3f} {b:.3f}C{c:.3f} {d:.3f} {e:.3f} {f:.3f} {g:.3f} {h:.3f}"
        for a, b, c, d, e, f, g, h in points
    ]
    body = f'<path d="{"".join(paths)}" {BLACK}/>'
    plain = read(svg(body), size)
    assert_same(read(moved(body, "0 -1 1 0 0 100"), size), turned(plain), angle=1e-5)
    assert_same(read(moved(body, "-1 0 0 1 100 0"), size), mirrored(plain), angle=1e-5)
    assert_same(read(moved(body, "0 1 1 0 0 0"), size), transposed(plain), angle=1e-5)
    assert_same(read(moved(body, "0.3 0 0 0.3 7 5"), size), plain, angle=1e-5)


@pytest.mark.parametrize("size", [24, 50])
def test_moving_a_bitmap_moves_its_instance(size):
    image = drawn(300)
    plain = read(png(image), size, "a.png")
    for move, expected in (
        (Image.Transpose.ROTATE_90, turned(plain)),
        (Image.Transpose.FLIP_LEFT_RIGHT, mirrored(plain)),
        (Image.Transpose.TRANSPOSE, transposed(plain)),
    ):
        assert_same(read(png(image.transpose(move)), size, "a.png"), expected, angle=1e-3, weight=1e-4)


# --- bitmaps ------------------------------------------------------------------------------------------------


def drawn(side, width=3, colour=0, mode="L", paper=255):
    """An ellipse with two chords, anti-aliased."""
    image = Image.new(mode, (4 * side, 4 * side), paper)
    draw, s = ImageDraw.Draw(image), 4 * side
    draw.ellipse((0.1 * s, 0.2 * s, 0.9 * s, 0.8 * s), outline=colour, width=4 * width)
    draw.line((0.3 * s, 0.3 * s, 0.4 * s, 0.75 * s), fill=colour, width=4 * width)
    draw.line((0.2 * s, 0.6 * s, 0.85 * s, 0.45 * s), fill=colour, width=4 * width)
    return image.resize((side, side), Image.Resampling.BOX)


@for_each("width", [1, 2, 5, 12])
@for_each("size", [24, 60])
def test_bitmap_directions_are_tangents_at_any_stroke_width(width, size):
    image = Image.new("L", (1600, 1600), 255)
    ImageDraw.Draw(image).ellipse((200, 200, 1400, 1400), outline=0, width=4 * width)
    instance = read(png(image.resize((400, 400), Image.Resampling.BOX)), size, "a.png")
    row, column = instance.stroke_pixels.T
    x = instance.origin[0] + (column + 0.5) * instance.pixel_size - 200
    y = 200 - instance.origin[1] - (row + 0.5) * instance.pixel_size
    error = np.degrees(line_difference(instance.theta, np.arctan2(x, -y)))
    assert np.median(error) < 1
    assert error[instance.w > 0.3].max() < 6
    assert instance.w.max() > 0.8


def turned_by_exif(image):
    exif = Image.Exif()
    exif[0x0112] = 6  # the camera was turned: show it a quarter clockwise
    return png(image.transpose(Image.Transpose.ROTATE_90), exif=exif)


PICTURES = {
    "rgb": lambda im: png(im.convert("RGB")),
    "palette": lambda im: png(im.convert("P")),
    "palette with transparent paper": lambda im: png(im.convert("P"), transparency=255),
    "transparent paper": lambda im: png(Image.merge("LA", (Image.new("L", im.size, 0), ImageOps.invert(im)))),
    "rgba with black transparent paper": lambda im: png(
        Image.merge("RGBA", (*[Image.new("L", im.size, 0)] * 3, ImageOps.invert(im)))
    ),
    "16 bit": lambda im: png(Image.fromarray(np.asarray(im).astype(np.uint16) * 257)),
    "light on dark": lambda im: png(ImageOps.invert(im)),
    "grey paper": lambda im: png(im.point(lambda v: 40 + v * 0.6)),
    "beige paper": lambda im: png(
        Image.merge("RGB", (im, im.point(lambda v: v * 0.95), im.point(lambda v: v * 0.8)))
    ),
    "faint pencil": lambda im: png(im.point(lambda v: 180 + v * 75 / 255)),
    "turned camera": turned_by_exif,
    "tiff": lambda im: png(im, "TIFF"),
    "webp": lambda im: png(im, "WEBP", lossless=True),
    "bmp": lambda im: png(im, "BMP"),
}


@for_each("kind", PICTURES)
def test_the_same_drawing_in_any_kind_of_picture(kind):
    image = drawn(200)
    plain, other = read(png(image), 30, "a.png"), read(PICTURES[kind](image), 30, "a.xyz")
    assert (plain.mask == other.mask).mean() > 0.995
    lines, others = as_map(plain, plain.theta), as_map(other, other.theta)
    assert (np.isnan(lines) == np.isnan(others)).mean() > 0.995
    assert np.degrees(np.nanmax(line_difference(lines, others))) < 1.5
    assert np.nanmax(np.abs(as_map(plain, plain.w) - as_map(other, other.w))) < 0.1


@pytest.mark.parametrize("kind", ["jpeg", "noise"])
def test_noise_hardly_changes_directions(kind):
    image = drawn(300)
    if kind == "jpeg":
        data = png(image.convert("RGB"), "JPEG", quality=35)
    else:
        noise = np.random.default_rng(1).normal(0, 8, (300, 300))
        data = png(Image.fromarray(np.clip(np.asarray(image) * 0.8 + 20 + noise, 0, 255).astype(np.uint8)))
    plain, other = read(png(image), 30, "a.png"), read(data, 30, "a.jpg")
    assert plain.mask.shape == other.mask.shape
    assert (plain.mask == other.mask).mean() > 0.99
    difference = line_difference(as_map(plain, plain.theta), as_map(other, other.theta))
    both = ~np.isnan(difference)
    assert both.sum() > 0.95 * len(plain.theta)
    assert np.degrees(np.median(difference[both])) < 0.5
    assert np.degrees(np.quantile(difference[both], 0.95)) < 5


def test_junctions_drop_out_and_darker_strokes_are_stronger():
    image = Image.new("L", (300, 300), 255)
    draw = ImageDraw.Draw(image)
    draw.line((30, 150, 270, 150), fill=0, width=3)
    draw.line((150, 30, 150, 270), fill=0, width=3)
    draw.line((30, 250, 270, 250), fill=150, width=3)
    instance = read(png(image), 25, "a.png")
    weight = as_map(instance, instance.w)
    row = int((150 - instance.origin[1]) / instance.pixel_size)
    column = int((150 - instance.origin[0]) / instance.pixel_size)
    faint = int((250 - instance.origin[1]) / instance.pixel_size)
    assert np.isnan(weight[row, column]) or weight[row, column] < 0.3
    assert np.nanmax(weight[row, 3:8]) > 0.8
    assert np.nanmax(weight[faint, 3:8]) < 0.7 * np.nanmax(weight[row, 3:8])


def test_dust_does_not_widen_the_frame():
    image = drawn(200)
    image.putpixel((1, 1), 0)
    image.putpixel((197, 3), 60)
    assert_same(read(png(image), 30, "a.png"), read(png(drawn(200)), 30, "a.png"), angle=1e-3, weight=1e-3)


@pytest.mark.slow
def test_a_picture_finer_than_needed_gives_the_same_directions():
    large = png(drawn(525, 4).resize((4200, 4200)), compress_level=1)
    coarse, fine = read(png(drawn(525, 4)), 24, "a.png"), read(png(drawn(1050, 8)), 24, "a.png")
    assert read_bitmap(large, 24).reduction == 2
    reduced = read(large, 24, "a.png")
    for other in (fine, reduced):
        assert (coarse.mask == other.mask).mean() > 0.99
        difference = line_difference(as_map(coarse, coarse.theta), as_map(other, other.theta))
        assert np.degrees(np.nanmedian(difference)) < 1
    assert reduced.pixel_size == pytest.approx(8 * coarse.pixel_size, rel=0.01)


@pytest.mark.parametrize("side, size", [(50, 128), (1200, 512)])
def test_pictures_smaller_and_larger_than_a_fine_grid_are_read(side, size):
    instance = read(png(drawn(side)), size, "a.png")
    assert max(instance.mask.shape) == size
    assert instance.grid.parts == 1


# --- colours and masks --------------------------------------------------------------------------------------

TWO_COLOURS = f'<circle cx="50" cy="50" r="40" {BLACK}/><path d="M20 50H80M50 20V80" {RED}/>'


def test_red_lines_are_curvature_lines_and_the_others_cut():
    both = read(svg(TWO_COLOURS), 41)
    row, column = both.stroke_pixels.T
    x = both.origin[0] + (column + 0.5) * both.pixel_size - 50
    y = both.origin[1] + (row + 0.5) * both.pixel_size - 50
    assert (np.minimum(np.abs(x), np.abs(y)) < both.pixel_size).all()
    radius = np.hypot(*(np.argwhere(both.mask) + 0.5 - np.array(both.mask.shape) / 2).T) * both.pixel_size
    assert 36 < radius.max() < 40  # the outline itself is not solved for
    assert both.grid.parts == 1


@pytest.mark.parametrize("colour", ["#d1242f", "red", "black", "#0044cc", "rgb(255,128,128)"])
def test_a_sketch_in_one_colour_is_all_curvature_lines(colour):
    body = TWO_COLOURS.replace("#d1242f", "black")
    assert_same(read(svg(body.replace("black", colour))), read(svg(body)))


@for_each(
    "colour",
    [
        "RED",
        "#f00",
        "#ff000080",
        "rgb(300, 0, 0)",
        "rgb(255 0 0 / 50%)",
        "rgba(255, 0, 0, 0.5)",
        "hsl(0deg 100% 50%)",
        "hsl(0, 100%, 50%)",
        "crimson",
        "color(display-p3 1 0 0)",
        "oklch(62.8% 0.2577 29.23)",
        "lab(54 80 70)",
        "rgb(255 none 0)",
        "red icc-color(coated, 0, 1, 1, 0)",
        "light-dark(rgb(255, 0, 0), pink)",
    ],
)
def test_red_is_red_in_every_notation_of_css(colour):
    line, outline = (
        '<path d="M20 50H80M50 20V80" fill="none" style="stroke:{}"/>',
        TWO_COLOURS.partition("<path")[0],
    )
    red, other = (read(svg(outline + line.format(notation))) for notation in ("red", colour))
    assert_same(red, other)
    assert red.theta.tolist() == other.theta.tolist()


@for_each("colour", ["no colour", "var(--pen)", "color-mix(in srgb, red, blue)"])
def test_strokes_in_colours_that_cannot_be_read_are_left_out_with_a_note(colour):
    line = '<path d="M20 50H80" fill="none" stroke="{}"/>'
    curves = read_svg(svg(line.format("blue") + line.format(colour).replace("50", "60")))
    assert (curves.points[..., 1] == 50).all()
    assert re.search(r"1 colour is not understood, first '.*' of <path>; write #rrggbb", *curves.notes)


@pytest.mark.parametrize(
    "style", ["clip-path: inset(50%)", "transform-box: fill-box", "rotate: 90deg", "transform: rotate(x)"]
)
def test_places_and_clips_that_are_not_understood_are_reported(style):
    curves = read_svg(svg(f'<path d="M10 10 60 80" {BLACK} style="{style}"/>'))
    assert re.search(rf"1 property is not understood, first '{style[:10]}.*' of <path>", *curves.notes)


def test_reading_a_drawing_again_cannot_be_disturbed_by_its_users():
    drawing = svg(f'<path d="M10 10 60 80" {BLACK}/>')
    with pytest.raises(ValueError, match="read-only"):
        read_svg(drawing).points[:] = 0.0
    assert read_svg(drawing).points.max() == 80


@for_each("mistake", ["stroke-miterlimit: 10 stroke-width: 3", "stroke-linejoin: round fill: red"])
def test_a_declaration_without_its_semicolon_leaves_the_others_valid(mistake):
    path = '<path d="M640 566C700 520 1000 400 1060 381M910 387L1150 540" stroke-width="3"/>'
    page = 'viewBox="0 0 3000 3000" style="background-color: white"'
    drawing = f"<svg {page} xmlns='http://www.w3.org/2000/svg'><style>path {{{{{{}}}}}}</style>{path}</svg>"
    right, wrong = (
        read_svg(drawing.format(f"fill: none; stroke: #000; {more}").encode()) for more in ("", mistake)
    )
    assert len(wrong.points) == 2
    np.testing.assert_array_equal(wrong.points, right.points)


@for_each("line", ["stroke-opacity='0.7'", "opacity='0.7'", ""])
def test_red_lines_below_a_clear_marker_stay_red(line):
    lines = f'<path d="M20 50H80M50 20V80" fill="none" stroke="red" {line}/>'
    marker = '<rect x="5" y="5" width="90" height="90" fill="yellow" fill-opacity="0.3"/>'
    curves = read_svg(svg(TWO_COLOURS.partition("<path")[0] + lines + marker))
    assert 0 < curves.red.sum() < len(curves.red)


def test_a_part_without_a_curvature_line_is_left_out():
    ring = (
        f'<circle cx="50" cy="50" r="40" {BLACK}/><circle cx="50" cy="50" r="15" {BLACK}/>'
        f'<circle cx="50" cy="50" r="28" {RED}/>'
    )
    instance = read(svg(ring), 60)
    assert not instance.mask[30, 30]
    assert instance.grid.parts == 1
    assert ndimage.binary_fill_holes(instance.mask).sum() > instance.mask.sum() + 100


def test_a_stroke_that_ends_a_little_beyond_the_outline_opens_no_part():
    two = f'<path d="M10 10H90V90H10ZM10 60H90" {BLACK}/><path d="M30 15V62" {RED}/>'
    instance = read(svg(two), 40)
    assert instance.grid.parts == 1
    assert not instance.mask[int((75 - instance.origin[1]) / instance.pixel_size)].any()


@for_each("slope", np.linspace(0.03, 3, 12))
def test_a_cutting_line_leaves_no_gap(slope):
    rise = 40 * slope / max(1, slope)
    run = rise / slope
    line = f'<path d="M{50 - run} {50 + rise}L{50 + run} {50 - rise}" {BLACK}/>'
    body = (
        f'<rect x="10" y="10" width="80" height="80" {BLACK}/>{line}<path d="M20 30L80 70M30 '
        f'20L70 80" {RED}/>'
    )
    assert read(svg(body), 50).grid.parts == 2


def test_two_lines_in_one_pixel_do_not_make_a_third_direction():
    # Half and half at 65 degrees the mean is 32.5 degrees off both lines; then no direction is better than
    # that one.
    for angle in (65, 90):
        c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        body = f'<path d="M10 50H90M{50 - 40 * c} {50 + 40 * s}L{50 + 40 * c} {50 - 40 * s}" {BLACK}/>'
        instance = read(svg(body), 13)
        off = np.minimum(
            line_difference(instance.theta, np.zeros(1)), line_difference(instance.theta, np.radians([angle]))
        )
        assert np.degrees(off.max()) < 15
        assert np.degrees(np.median(off)) < 1e-6


def test_a_grid_too_coarse_for_the_outline_is_refused():
    with pytest.raises(InputError, match="so coarse a grid; choose a larger size"):
        read(svg(TWO_COLOURS), 2)


@pytest.mark.parametrize("kind", ["PNG", "JPEG"])
def test_colours_of_bitmaps_follow_the_same_rule(kind):
    image = Image.new("RGB", (1600, 1600), "white")
    draw = ImageDraw.Draw(image)
    draw.ellipse((160, 160, 1440, 1440), outline="black", width=16)
    draw.line((320, 800, 1280, 800), fill="#d1242f", width=16)
    draw.line((800, 320, 800, 1280), fill="#d1242f", width=16)
    picture = read(png(image.resize((400, 400), Image.Resampling.BOX), kind), 41, "a.png")
    drawing = read(svg(TWO_COLOURS), 41)
    assert (picture.mask == drawing.mask).mean() > 0.97
    difference = line_difference(as_map(picture, picture.theta), as_map(drawing, drawing.theta))
    assert (~np.isnan(difference)).sum() > 0.9 * len(drawing.theta)
    assert np.degrees(np.nanmax(difference)) < 3


@pytest.mark.parametrize("size", [24, 48, 128])
def test_outlines_with_small_gaps_enclose_and_open_strokes_do_not(size):
    closed = read(svg(f'<circle cx="50" cy="50" r="40" {BLACK}/>'), size).mask
    gap = read(svg(f'<path d="M90 50A40 40 0 1 1 89.95 48" {BLACK}/>'), size).mask
    assert (closed == gap).mean() > 0.98
    assert closed.mean() < 0.75
    open_line = read(svg(f'<path d="M10 40 Q50 10 90 40" {BLACK}/>'), size).mask
    assert open_line.all()
    apart = read(svg(f'<path d="M10 10H90M10 50H90M10 90H90" {BLACK}/>'), size).mask
    assert apart.all()


def mask_file(tmp_path, size, box, value=255, name="mask.png"):
    image = Image.new("L", size, 0)
    ImageDraw.Draw(image).rectangle((box[0], box[1], box[2] - 1, box[3] - 1), fill=value)
    path = tmp_path / name
    image.save(path)
    return path


def test_a_mask_crops_the_grid_and_decides_what_is_solved(tmp_path):
    drawing = tmp_path / "Drawing.svg"
    drawing.write_bytes(svg(LINE))
    instance = read_sketch(drawing, size=30, mask=mask_file(tmp_path, (100, 100), (20, 30, 80, 70)))
    assert instance.mask.shape == (20, 30)
    assert instance.mask.all()
    assert instance.pixel_size == pytest.approx(2)
    assert instance.origin == pytest.approx((20, 30))
    np.testing.assert_allclose(instance.theta, 3 * np.pi / 4)
    assert (np.diff(instance.stroke_pixels, axis=1) == 10 - 5).all()  # y = x: column * 2 + 20 = row * 2 + 30


def test_a_mask_pixel_counts_from_half_its_area_on(tmp_path):
    image = Image.new("L", (100, 100), 0)
    ImageDraw.Draw(image).rectangle((0, 0, 99, 54), fill=255)
    ImageDraw.Draw(image).rectangle((0, 0, 53, 99), fill=255)
    image.save(tmp_path / "m.png")
    drawing = tmp_path / "a.svg"
    drawing.write_bytes(svg(LINE))
    mask = read_sketch(drawing, size=10, mask=tmp_path / "m.png").mask
    assert mask[:6].all()  # row 5 is white in half of it
    assert mask[:, :5].all()
    assert not mask[6:, 5:].any()  # column 5 in less than half


def test_a_mask_belongs_to_bitmaps_and_to_scap_files_too(tmp_path):
    drawn(200).save(tmp_path / "a.png")
    (tmp_path / "a.scap").write_text("#200\t200\n@1\n{\n\t#0\t0\n\t20\t100\t1\n\t180\t100\t1\n}\n")
    mask = mask_file(tmp_path, (200, 200), (40, 60, 160, 140))
    for name in ("a.png", "a.scap"):
        instance = read_sketch(tmp_path / name, size=30, mask=mask)
        assert instance.mask.shape == (20, 30)
        assert instance.origin == pytest.approx((40, 60))


def test_masks_that_do_not_fit_are_refused_with_both_sizes(tmp_path):
    drawing = tmp_path / "a.svg"
    drawing.write_bytes(svg(LINE))
    with pytest.raises(InputError, match=r"m1.png: the mask has 90 x 80 pixels, but the sketch 100 x 100"):
        read_sketch(drawing, mask=mask_file(tmp_path, (90, 80), (0, 0, 50, 50), name="m1.png"))
    with pytest.raises(InputError, match=r"m2.png: the mask is black all over"):
        read_sketch(drawing, mask=mask_file(tmp_path, (100, 100), (0, 0, 5, 5), 0, name="m2.png"))
    with pytest.raises(InputError, match=r"a.svg: no stroke lies inside the mask"):
        read_sketch(drawing, mask=mask_file(tmp_path, (100, 100), (60, 0, 100, 40), name="m3.png"))
    (tmp_path / "b.svg").write_bytes(svg(LINE, ""))
    with pytest.raises(InputError, match="neither a viewBox nor a width and height"):
        read_sketch(tmp_path / "b.svg", mask=mask_file(tmp_path, (100, 100), (0, 0, 50, 50), name="m4.png"))
    with pytest.raises(InputError, match=r"none.png: cannot be read"):
        read_sketch(drawing, mask=tmp_path / "none.png")


# --- .scap --------------------------------------------------------------------------------------------------


def test_scap_takes_the_box_from_the_samples_and_all_strokes():
    text = "#10\t10\n@1\n{\n\t#1\t7\n\t@2\n\t-5\t-20\t0\n\t5\t-10\t0\n}\n{\n#2 7\n0 0\n10 0 1\n}\n"
    curves = read_scap(text.encode())
    assert curves.box == (-5, -20, 10, 0)
    assert len(curves.points) == 2
    assert not curves.red.any()
    assert_same(read(text.encode(), 20, "a.txt"), read(text.replace("\n", "\r\n").encode(), 20, "a.scap"))


SCAP_ERRORS = {
    "#10 10\n{\n1 2\n3 4\n": "line 2: this stroke does not end",
    "#10 10\n{\n{\n": "line 3: a stroke starts inside the stroke of line 2",
    "#10 10\n}\n": "line 2: a stroke ends that did not start",
    "#10 10\n1 2 3\n": "line 2: a sample stands outside",
    "#10 10\n{\n#1 1\n1 2 0\nnan 3 0\n}\n": "line 5: a coordinate is not a finite number",
    "#10 10\n{\n1 2 0\n1e300 3 0\n}\n": "line 4: a coordinate is not a finite number",
    "#10 10\n{\n1 2 0\nx y z\n}\n": "line 4: expected 'x y pressure', found 'x y z'",
    "#10 10\n{\n1\n}\n": "line 3: expected 'x y pressure'",
    "#10\n{\n1 2\n3 4\n}\n": "line 1: expected '#width height'",
    "#0 -1\n{\n1 2\n3 4\n}\n": "line 1: the size '#0 -1' is not two numbers from",
    "#10 10\n{\n1 2\n}\n": "no stroke of two or more samples",
    "hello": "line 1: expected '#width height', found 'hello'",
}


@for_each("text", SCAP_ERRORS)
def test_broken_scap_files_are_refused_with_the_line(text):
    with pytest.raises(InputError) as caught:
        read(text.encode(), source="a.scap")
    assert SCAP_ERRORS[text] in str(caught.value)


# --- what is refused ----------------------------------------------------------------------------------------


def declared(width, height):
    """A PNG of a few bytes that claims to be large."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head)
        + chunk(b"IDAT", zlib.compress(b"\0" * 99))
        + chunk(b"IEND", b"")
    )


REFUSED = {
    "empty.png": (b"", "is empty"),
    "text.png": (b"just text", "is not a whole picture"),
    "cut.png": (png(drawn(200))[:900], "is not a whole picture"),
    "paper.png": (png(Image.new("RGB", (90, 90), "#eee")), "shows no stroke"),
    "night.png": (png(Image.new("RGB", (90, 90), "#000")), "shows ink on 100% of the paper"),
    "bomb.png": (declared(60_000, 60_000), "absurdly many pixels"),
    "large.png": (declared(10_000, 10_000), "declares 10000 x 10000 pixels"),
    "nothing.svg": (svg(""), "draws no stroke"),
    "point.svg": (svg(f'<path d="M5 5L5 5" {BLACK}/>'), "draws no stroke"),
    "cut.svg": (svg(LINE)[:-9], "is not well-formed XML"),
    "page.svg": (b"<html><body/></html>", "<html>, not <svg>"),
    "laughs.svg": (
        b'<!DOCTYPE svg [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]>' + svg("<title>&b;</title>"),
        "declares XML entities",
    ),
    "infinite.svg": (
        svg(f'<path id="p" d="M1e999 0L5 5" {BLACK}/>'),
        '<path id="p">: a coordinate is not a finite number',
    ),
    "word.svg": (svg(f'<path d="M0 0L foo bar" {BLACK}/>'), "<path>: its path data is faulty near 'M0 0L"),
    "box.svg": (svg(LINE, 'viewBox="0 0 a b"'), "<svg>: its viewBox '0 0 a b' is not four numbers"),
    "flat.svg": (svg(LINE, 'viewBox="0 0 0 9"'), "has no area"),
    "packed.svgz": (b"\x1f\x8b\x08" + b"0" * 40, "is compressed"),
    "deep.svg": (svg("<g>" * 30_000 + "</g>" * 30_000), "nested more than 50 deep"),
    "long.svg": (svg(f'<path d="M0 0{"L1 1" * 3_000_000}" {BLACK}/>'), "characters of paths"),
}


@for_each("name", REFUSED)
def test_bad_files_are_refused_in_one_line_that_names_them(name, tmp_path):
    data, message = REFUSED[name]
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(InputError) as caught:
        read_sketch(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_missing_files_and_folders_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"none.svg: cannot be read: no such file"):
        read_sketch(tmp_path / "none.svg")
    with pytest.raises(InputError, match="is a directory"):
        read_sketch(tmp_path)
    for name in ("a\0b.svg", "x" * 5000, ""):
        with pytest.raises(InputError, match="cannot be read"):
            read_sketch(name)


@pytest.mark.parametrize("size", [0, -3, 4097])
def test_sizes_out_of_range_are_refused_before_the_file_is_opened(size):
    with pytest.raises(InputError, match=f"size is {size}; choose 1 to 4096"):
        read_sketch("there is no such file", size=size)


@settings(max_examples=60, deadline=None)
@given(st.binary(max_size=300), st.sampled_from(["a.svg", "a.png", "a.scap", "a.curves", "a"]))
def test_no_bytes_at_all_give_anything_but_a_typed_error(data, source):
    for start in (
        b"",
        b"#10 10\n{\n",
        b"v 2\n",
        b"v 2\n0 0 0\n1 1 1\n",
        b"<svg>",
        b"\x89PNG\r\n\x1a\n",
        b"\xff\xd8\xff\xe0",
    ):
        with contextlib.suppress(CrossfieldError):
            read(start + data, 8, source)


# --- names --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text, name",
    [
        ("Computer Mouse (final)", "computer_mouse_final"),
        ("2nd-try", "sketch_2nd_try"),
        ("...", "sketch"),
        ("Ünïcode", "n_code"),
        ("a" * 50, "a" * 32),
        ("x" * 31 + "-y", "x" * 31),
    ],
)
def test_names_are_made_from_file_names(text, name):
    assert name_from_text(text) == name


def test_name_source_and_gauge_of_a_file(tmp_path):
    path = tmp_path / "My Sketch 3.SVG"
    path.write_bytes(svg(LINE))
    instance = read_sketch(path, gauge="box")
    assert (instance.name, instance.source, instance.gauge) == ("my_sketch_3", "My Sketch 3.SVG", "box")
    assert max(instance.mask.shape) == 24
    assert read_sketch(path, name="other").name == "other"
    assert read_sketch(path).sha256 == read_sketch(path).sha256
    with pytest.raises(CrossfieldError, match="the name 'Other' is not allowed"):
        read_sketch(path, name="Other")


@pytest.mark.skipif(os.name == "nt", reason="has no such file names")
@for_each(
    "name, source",
    [("a\x1b[31mb.svg", r"a\x1b[31mb.svg"), ("a\n b.svg", "a b.svg"), ("a\u202eb.svg", r"a\u202eb.svg")],
)
def test_a_file_name_that_no_terminal_should_print_is_escaped_in_the_source(tmp_path, name, source):
    path = tmp_path / name
    path.write_bytes(svg(LINE))
    instance = read_sketch(path, size=6)
    assert instance.source == source
    assert read_instance(write_instance(instance, tmp_path / "a.json")).sha256 == instance.sha256


def test_the_content_decides_what_a_file_is(tmp_path):
    for name, data in (
        ("a.png", svg(LINE)),
        ("b.svg", png(drawn(200))),
        ("c", svg(LINE)),
        ("d.txt", b"#9 9\n{\n1 1\n8 8\n}\n"),
    ):
        (tmp_path / name).write_bytes(data)
        assert len(read_sketch(tmp_path / name, size=12).theta) > 5
