"""Outlines with a gap, drawings that enclose nothing, holes, and strokes without room between them."""

from loops import for_each
from PIL import Image, ImageDraw
from small_drawings import BLACK, RED, png, read, svg

LARGE = "0 0 200 200"


def in_black(*paths, page="0 0 100 100", size=48):
    body = "".join(f'<path d="{path}" {BLACK}/>' for path in paths)
    return read(svg(body, f'viewBox="{page}"'), size)


@for_each("size", [24, 48, 128])
def test_outlines_with_small_gaps_enclose(size):
    closed = in_black("M90 50A40 40 0 1 1 90 49.99Z", size=size).mask
    gap = in_black("M90 50A40 40 0 1 1 89.95 48", size=size).mask
    assert (closed == gap).mean() > 0.98
    assert closed.mean() < 0.75


@for_each("path", ["M10 40Q50 10 90 40", "M10 10H90M10 50H90M10 90H90"])
def test_what_encloses_nothing_is_solved_as_a_rectangle_and_said_to_be(path):
    instance = in_black(path)
    assert instance.mask.all()
    assert any("enclose nothing" in text for text in instance.reading.warnings)


def test_a_hole_is_solved_in_one_colour_and_left_out_between_cuts():
    outer, inner = "M90 50A40 40 0 1 1 90 49.9Z", "M65 50A15 15 0 1 1 65 49.9Z"
    assert in_black(outer, inner).mask[23:25, 23:25].all()
    lines = f'<path d="{outer}{inner}" {BLACK}/><path d="M10 50H30M70 50H90M50 10V30M50 70V90" {RED}/>'
    assert not read(svg(lines), 48).mask[18:30, 18:30].any()


@for_each("width", [5, 6, 30])
def test_a_gap_between_limbs_stays_outside(width):
    trousers = f"M30 40H170V180H{100 + width / 2}V90H{100 - width / 2}V180H30Z"
    instance = in_black(trousers, page=LARGE, size=96)
    column, first, last = (int((at - instance.origin[0]) / instance.pixel_size) for at in (100, 105, 165))
    assert not instance.mask[first:last, column].any()
    assert instance.mask[first : last + 5, : column - 5].sum() > 30 * 60 / instance.pixel_size**2
    assert not instance.reading.warnings


HAND = (
    "M60 190V110L30 90Q20 80 30 74L60 92V30Q68 20 76 30V80L80 80V20Q88 10 96 20V80L100 80V24Q108 14 116 24V80"
    "L120 82V40Q128 30 136 40V120L132 190"
)


def test_an_open_wrist_that_loses_the_palm_is_warned_of():
    (text,) = in_black(HAND, page=LARGE).reading.warnings
    assert text.startswith("46 of 214 stroke pixels bound no area, most of them round (13")
    assert in_black(f"{HAND}H60", page=LARGE).reading.warnings == ()


def test_solid_ink_and_hatching_are_warned_of_with_their_place():
    hatching = "".join(f"M20 {20 + k / 2}H80" for k in range(60))
    (text,) = in_black("M10 10H90V90H10Z", hatching).reading.warnings
    assert "strokes leave no room between them round (50," in text
    image = Image.new("L", (200, 200), 255)
    ImageDraw.Draw(image).rectangle((20, 20, 180, 180), outline=0, width=3)
    ImageDraw.Draw(image).ellipse((100, 100, 170, 170), fill=0)
    (text,) = read(png(image), 48, "a.png").reading.warnings
    assert "strokes leave no room between them round (13" in text


@for_each(
    "lines, parts, named",
    [
        ("M15 50H95M50 15V85", 1, 0),  # ends a little beyond
        ("M15 50H104M50 15V85", 1, 1),
        ("M15 50H119M50 15V85", 2, 0),  # runs through
        ("M15 50H85M50 15V85M105 35V65", 2, 0),  # a line of its own
        ("M60 50H106M50 15V85", 2, 0),  # a third of a line
    ],
)
def test_an_area_that_a_line_only_overshoots_into_is_left_out_and_named(lines, parts, named):
    body = f'<path d="M10 10H90V90H10ZM90 30H120V70H90" {BLACK}/><path d="{lines}" {RED}/>'
    instance = read(svg(body, 'viewBox="0 0 130 100"'), 40)
    assert instance.grid.parts == parts
    assert [text[:30] for text in instance.reading.warnings] == named * ["the area round (105.1, 50) is "]
