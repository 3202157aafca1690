"""From sketches to instances: SVG, bitmaps, colours, names, and everything that must be refused."""

import contextlib
import os
import struct
import zlib
from functools import cache

import crossfield as cf
import numpy as np
import pytest
from angles import line_difference
from crossfield.models.sketch.cover import Frame, cover_by_segments
from hypothesis import given, settings
from hypothesis import strategies as st
from loops import for_each
from moves import mirrored, transposed, turned
from PIL import Image, ImageDraw, ImageOps
from scipy import ndimage
from small_drawings import BLACK, RED, png, read, svg

LINE = f'<path d="M10 10 L90 90" {BLACK}/>'
ACROSS = "M0 0H100"


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


def test_cover_agrees_with_dense_sampling():
    rng = np.random.default_rng(5)
    along_an_edge = np.array([[[2.5, 2.0], [8.5, 2.0]]])  # shared by the pixels of both sides
    segments = np.concatenate([rng.uniform(-3, 15, (40, 2, 2)), along_an_edge])
    frame = Frame(x=1.0, y=-1.0, pixel=1.5, height=6, width=8)
    cover = cover_by_segments(segments, frame)
    t = (np.arange(40_000) + 0.5) / 40_000
    amount, sums = np.zeros((6, 8)), np.zeros((6, 8), dtype=complex)
    for start, end in [*segments[:-1], *(segments[-1] + [[0, side], [0, side]] for side in (-1e-9, 1e-9))]:
        column, row = np.floor(((start + np.outer(t, end - start)) - (1.0, -1.0)) / 1.5).astype(int).T
        inside = (row >= 0) & (row < 6) & (column >= 0) & (column < 8)
        length = np.hypot(*(end - start)) / 1.5 / len(t) / (2 if start[1] == end[1] else 1)
        angle = np.arctan2(-(end - start)[1], (end - start)[0])
        np.add.at(amount, (row[inside], column[inside]), length)
        np.add.at(sums, (row[inside], column[inside]), length * np.exp(2j * angle))
    np.testing.assert_allclose(cover.amount, amount, atol=5e-3)
    np.testing.assert_allclose(cover.direction[..., 0] * cover.amount, sums.real, atol=5e-3)
    np.testing.assert_allclose(cover.direction[..., 1] * cover.amount, sums.imag, atol=5e-3)


@for_each("size", [1, 2, 3, 4, 5, 7, 100])
def test_the_longer_side_has_as_many_pixels_as_asked_for(size):
    assert max(read(svg(f'<path d="M5 5Q60 5 95 45" {BLACK}/>'), size).mask.shape) == size


# --- SVG ----------------------------------------------------------------------------------------------------

SAME_LINE = {
    "line": svg(f'<line x1="10" y1="10" x2="90" y2="90" {BLACK}/>'),
    "percentages": svg(f'<line x1="10%" y1="10%" x2="90%" y2="90%" {BLACK}/>'),
    "polyline": svg(f'<polyline points="10,10 50,50,90 90" {BLACK}/>'),
    "compact": svg(f'<path d="m10 10l40 40 40,40" {BLACK}/>'),
    "class in defs": svg(
        '<defs><style type="text/css"><![CDATA[ .a, .st0 { stroke : #000000 } ]]></style></defs>'
        '<path fill="none" class="x st0" d="M10 10L90 90"/>'
    ),
    "style after its use": svg(
        '<path class="st0" d="M10 10L90 90"/><style>/* late */ @import url(http://x.y/z.css); '
        ".st0{fill:none;stroke:#000000}</style>"
    ),
    "id": svg('<style>path{stroke:none} #p{stroke:black}</style><path id="p" fill="none" d="M10 10L90 90"/>'),
    "no semicolon": svg(
        "<style>path{fill: none; stroke: #000; stroke-linejoin: round fill: red}</style>"
        '<path d="M10 10L90 90"/>'
    ),
    "transforms": svg(
        '<g transform="translate(5 5)"><g transform="scale(2) rotate(90)">'
        f'<path d="M2.5 -2.5L42.5 -42.5" {BLACK}/></g></g>'
    ),
    "use": svg(
        f'<defs><path id="l" d="M0 0L80 80" {BLACK}/></defs>'
        '<use xlink:href="#l" x="5" y="5" transform="translate(5 5)"/>'
    ),
    "straight curves": svg(f'<path d="M10 10C20 20 30 30 50 50Q70 70 90 90" {BLACK}/>'),
    "unused things": svg(
        f'{LINE}<defs>{LINE.replace("10 10", "0 50")}</defs><clipPath><path d="{ACROSS}" {BLACK}/></clipPath>'
        f'<symbol><path d="{ACROSS}" {BLACK}/></symbol>'
    ),
    "red alone": svg(LINE.replace("black", "red")),
    "outside things": svg(
        f'{LINE}<image href="http://a.b/c.png" width="100" height="3"/><use href="other.svg#x"/>'
        "<text>hello</text>"
    ),
    "transparent things": svg(
        f'{LINE}<path d="{ACROSS}" stroke="#ff000000"/><path d="{ACROSS}V1H0Z" fill="rgb(0 0 0 / 0)"/>'
    ),
    "a use of itself": svg(f'<g id="g">{LINE}<use href="#g"/></g>'),
    "doctype": b'\xef\xbb\xbf\n<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" '
    b'"http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd">' + svg(LINE),
    "utf-16": svg(LINE).decode().encode("utf-16"),
    "size only": svg(LINE, 'width="100mm" height="80mm"'),
    "no size": svg(LINE, ""),
    "no namespace": svg(LINE).replace(b' xmlns="http://www.w3.org/2000/svg"', b""),
}


@for_each("name", SAME_LINE)
def test_all_ways_to_write_a_line_give_the_same_instance(name):
    assert_same(read(SAME_LINE[name]), plain_line())


@cache
def plain_line():
    return read(svg(LINE))


CIRCLES = {
    "circle": f'<circle cx="50" cy="50" r="40" {BLACK}/>',
    "ellipse": f'<ellipse cx="25" cy="50" rx="20" ry="40" transform="matrix(2 0 0 1 0 0)" {BLACK}/>',
    "ellipse with one radius": f'<ellipse cx="50" cy="50" ry="40" {BLACK}/>',
    "arcs": f'<path d="M10 50a40 40 0 0180 0 40 40 0 01-80 0z" {BLACK}/>',
    "rounded rectangle": f'<rect x="10" y="10" width="80" height="80" rx="40" {BLACK}/>',
}


@for_each("name", CIRCLES)
def test_round_shapes_have_their_tangents(name):
    instance = read(svg(CIRCLES[name]), size=60)
    x, y = places_from(instance, (50, 50))
    assert np.degrees(line_difference(instance.theta, np.arctan2(x, -y))).max() < 2
    assert np.abs(np.hypot(x, y) - 40).max() < 1.5
    assert instance.mask.sum() * instance.pixel_size**2 == pytest.approx(np.pi * 41**2, rel=0.02)


def places_from(instance, middle):
    """Places of the stroke pixels from a point of the page, y up."""
    x, y = ((instance.stroke_pixels[:, ::-1] + 0.5) * instance.pixel_size + instance.origin - middle).T
    return x, -y


@for_each(
    "smooth, plain",
    [
        ("C20 0 30 0 40 50T80 50", "C20 0 30 0 40 50Q40 50 80 50"),
        ("Q20 0 40 50S80 0 90 50", "Q20 0 40 50C40 50 80 0 90 50"),
    ],
)
def test_smooth_curves_reflect_controls_of_their_kind_alone(smooth, plain):
    one, other = (read(svg(f'<path d="M10 50{data}" {BLACK}/>')) for data in (smooth, plain))
    assert one.sha256 == other.sha256
    assert one.origin[1] > 0  # the frame is round the curve, without its control points


# --- turning and mirroring ----------------------------------------------------------------------------------


def moved(body, matrix):
    return svg(f'<g transform="matrix({matrix})">{body}</g>')


@for_each("seed, size", [(1, 16), (2, 33)])
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


def test_moving_a_bitmap_moves_its_instance():
    image, size = drawn(300), 50
    plain = read(png(image), size, "a.png")
    for move, expected in (
        (Image.Transpose.ROTATE_90, turned(plain)),
        (Image.Transpose.FLIP_LEFT_RIGHT, mirrored(plain)),
        (Image.Transpose.TRANSPOSE, transposed(plain)),
    ):
        assert_same(read(png(image.transpose(move)), size, "a.png"), expected, angle=1e-3, weight=1e-4)


# --- bitmaps ------------------------------------------------------------------------------------------------


def drawn(side, width=3):
    """An ellipse with two chords, anti-aliased."""
    image = Image.new("L", (4 * side, 4 * side), 255)
    draw, s = ImageDraw.Draw(image), 4 * side
    draw.ellipse((0.1 * s, 0.2 * s, 0.9 * s, 0.8 * s), outline=0, width=4 * width)
    draw.line((0.3 * s, 0.3 * s, 0.4 * s, 0.75 * s), fill=0, width=4 * width)
    draw.line((0.2 * s, 0.6 * s, 0.85 * s, 0.45 * s), fill=0, width=4 * width)
    return image.resize((side, side), Image.Resampling.BOX)


@for_each("width, size", [(1, 24), (12, 24), (5, 60)])
def test_bitmap_directions_are_tangents_at_any_stroke_width(width, size):
    image = Image.new("L", (1600, 1600), 255)
    ImageDraw.Draw(image).ellipse((200, 200, 1400, 1400), outline=0, width=4 * width)
    instance = read(png(image.resize((400, 400), Image.Resampling.BOX)), size, "a.png")
    x, y = places_from(instance, (200, 200))
    error = np.degrees(line_difference(instance.theta, np.arctan2(x, -y)))
    assert np.median(error) < 1
    assert error[instance.w > 0.3].max() < 6
    assert instance.w.max() > 0.8


def dusty(image):
    image = image.copy()
    image.putpixel((1, 1), 0)
    image.putpixel((197, 3), 60)
    return png(image)


BLANK = Image.new("L", (200, 200), 255)
PICTURES = {
    "palette with transparent paper": lambda im: png(im.convert("P"), transparency=255),
    "transparent paper": lambda im: png(Image.merge("LA", (Image.new("L", im.size, 0), ImageOps.invert(im)))),
    "light ink, transparent paper": lambda im: png(
        Image.merge("LA", (im.point(lambda _: 255), ImageOps.invert(im)))
    ),
    "rgba with black transparent paper": lambda im: png(
        Image.merge("RGBA", (*[Image.new("L", im.size, 0)] * 3, ImageOps.invert(im)))
    ),
    "16 bit": lambda im: png(Image.fromarray(np.asarray(im).astype(np.uint16) * 257)),
    "light on dark": lambda im: png(ImageOps.invert(im)),
    "grey paper": lambda im: png(im.point(lambda v: 40 + v * 0.6)),
    "faint pencil": lambda im: png(im.point(lambda v: 180 + v * 75 / 255)),
    "dust at the border": dusty,
    "tiff": lambda im: png(im, "TIFF", save_all=True, append_images=[BLANK]),
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


def test_junctions_drop_out_and_darker_strokes_are_stronger():
    image = Image.new("L", (300, 300), 255)
    for line, ink in (((30, 150, 270, 150), 0), ((150, 30, 150, 270), 0), ((30, 250, 270, 250), 150)):
        ImageDraw.Draw(image).line(line, fill=ink, width=3)
    instance = read(png(image), 25, "a.png")
    weight = as_map(instance, instance.w)
    places = np.subtract([150, 150, 250], np.take(instance.origin, [1, 0, 1]))
    row, column, faint = (places / instance.pixel_size).astype(int)
    assert np.isnan(weight[row, column]) or weight[row, column] < 0.3
    assert np.nanmax(weight[row, 3:8]) > 0.8
    assert np.nanmax(weight[faint, 3:8]) < 0.7 * np.nanmax(weight[row, 3:8])


@pytest.mark.slow
def test_a_picture_finer_than_needed_gives_the_same_directions():
    """One of 4200 pixels is reduced for a coarse grid."""
    large = png(drawn(525, 4).resize((4200, 4200)), compress_level=1)
    coarse, reduced = read(png(drawn(525, 4)), 24, "a.png"), read(large, 24, "a.png")
    assert (coarse.mask == reduced.mask).mean() > 0.99
    difference = line_difference(as_map(coarse, coarse.theta), as_map(reduced, reduced.theta))
    assert np.degrees(np.nanmedian(difference)) < 1
    assert reduced.pixel_size == pytest.approx(8 * coarse.pixel_size, rel=0.01)


def test_a_picture_coarser_than_its_grid_is_read():
    instance = read(png(drawn(50)), 128, "a.png")
    assert (max(instance.mask.shape), instance.grid.parts) == (128, 1)


OUTLINE = f'<circle cx="50" cy="50" r="40" {BLACK}/>'
LINES = "M20 50H80M50 20V80"
TWO_COLOURS = f'{OUTLINE}<path d="{LINES}" {RED}/>'


# --- areas --------------------------------------------------------------------------------------------------


def test_a_part_without_a_curvature_line_is_left_out():
    ring = f'<circle cx="50" cy="50" r="15" {BLACK}/><circle cx="50" cy="50" r="28" {RED}/>'
    instance = read(svg(OUTLINE + ring), 60)
    assert not instance.mask[30, 30]
    assert instance.grid.parts == 1
    assert ndimage.binary_fill_holes(instance.mask).sum() > instance.mask.sum() + 100


@for_each("slope", [0.03, 0.6, 3])
def test_a_cutting_line_leaves_no_gap(slope):
    run, rise = (40 * side / max(1, slope) for side in (1, slope))
    cut = f"M10 10H90V90H10ZM{50 - run} {50 + rise}L{50 + run} {50 - rise}"
    body = f'<path d="{cut}" {BLACK}/><path d="M20 30L80 70M30 20L70 80" {RED}/>'
    assert read(svg(body), 50).grid.parts == 2


@for_each("angle", (65, 90))
def test_two_lines_in_one_pixel_do_not_make_a_third_direction(angle):
    """Half and half at 65 degrees, the mean is 32.5 degrees off both; then no direction is better."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    body = f'<path d="M10 50H90M{50 - 40 * c} {50 + 40 * s}L{50 + 40 * c} {50 - 40 * s}" {BLACK}/>'
    instance = read(svg(body), 13)
    off = line_difference(instance.theta, np.radians([[0], [angle]])).min(axis=0)
    assert np.degrees(off.max()) < 15
    assert np.degrees(np.median(off)) < 1e-6


# --- what is refused ----------------------------------------------------------------------------------------


def declared(width, height):
    """A PNG of a few bytes that claims to be large."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    chunks = chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(b"\0" * 99)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + chunks


REFUSED = {
    "empty.png": (b"", "is empty"),
    "text.png": (b"just text", "is not a whole picture"),
    "cut.png": (png(drawn(200))[:900], "is not a whole picture"),
    "paper.png": (png(Image.new("RGB", (90, 90), "#eee")), "shows no stroke"),
    "night.png": (png(Image.new("RGB", (90, 90), "#000")), "shows ink on 100% of the paper"),
    "bomb.png": (declared(60_000, 60_000), "absurdly many pixels"),
    "large.png": (declared(10_000, 10_000), "declares 10000 x 10000 pixels"),
    "nothing.svg": (svg(""), "draws no stroke"),
    "words.svg": (svg('<text y="9">a</text>'), "it has text, 1 in all; convert it to paths"),
    "ground.svg": (
        svg('<rect width="100" height="100" fill="#eef"/>'),
        "it has areas without a stroke, 1 in all",
    ),
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
    "nested.svg": (
        svg(f"<style><![CDATA[{'a' * 20_000}{{{'& ' * 5000}{{fill:red}}}}]]></style>{LINE}"),
        "its style sheets have more than 1000000 characters",
    ),
    "long.svg": (svg(f'<path d="M0 0{"L1 1" * 3_000_000}" {BLACK}/>'), "characters of paths"),
}


@for_each("name", REFUSED)
def test_bad_files_are_refused_in_one_line_that_names_them(name, tmp_path):
    data, message = REFUSED[name]
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(cf.InputError) as caught:
        cf.read_sketch(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_grid_too_coarse_for_the_outline_is_refused():
    with pytest.raises(cf.InstanceError, match="so coarse a grid; choose a larger size"):
        read(svg(TWO_COLOURS), 2)


STARTS = [b"", b"#10 10\n{\n", b"v 2\n", b"v 2\n0 0 0\n1 1 1\n", b"<svg>", b"\x89PNG\r\n\x1a\n"]


@settings(max_examples=100)
@given(st.sampled_from(STARTS), st.binary(max_size=300), st.sampled_from(["a.svg", "a.scap", "a"]))
def test_no_bytes_at_all_give_anything_but_a_typed_error(start, data, source):
    with contextlib.suppress(cf.CrossfieldError):
        read(start + data, 8, source)


# --- names --------------------------------------------------------------------------------------------------


@pytest.mark.skipif(os.name == "nt", reason="has no such file names")
@for_each(
    "file, name, source",
    [
        ("Computer Mouse (final).SVG", "computer_mouse_final", "Computer Mouse (final).SVG"),
        ("2nd-try.svg", "sketch_2nd_try", "2nd-try.svg"),
        ("....svg", "sketch", "....svg"),
        ("Ünïcode.svg", "n_code", "Ünïcode.svg"),
        ("a" * 50, "a" * 32, "a" * 50),
        ("x" * 31 + "-y", "x" * 31, "x" * 31 + "-y"),
        # No terminal should print these.
        ("a\x1b[31mb.svg", "a_31mb", r"a\x1b[31mb.svg"),
        ("a\n b.svg", "a_b", "a b.svg"),
        ("a\u202eb.svg", "a_b", r"a\u202eb.svg"),
    ],
)
def test_names_and_sources_are_made_from_file_names(file, name, source, tmp_path):
    path = tmp_path / file
    path.write_bytes(svg(LINE))
    instance = cf.read_sketch(path, gauge="box")
    assert (instance.name, instance.source, instance.gauge) == (name, source, "box")
    assert max(instance.mask.shape) == 24
    assert cf.read_instance(cf.write_instance(instance, tmp_path / "a.json")).sha256 == instance.sha256
    assert cf.read_sketch(path, name="other").name == "other"


@for_each(
    "name, data",
    [("a.png", svg(LINE)), ("b.svg", png(drawn(200))), ("c", svg(LINE)), ("d", b"#9 9\n{\n1 1\n8 8\n}\n")],
)
def test_the_content_decides_what_a_file_is(name, data):
    assert len(read(data, 12, name).theta) > 5
