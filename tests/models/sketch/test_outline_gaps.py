"""Outlines with a gap, drawings that enclose nothing, holes, and strokes without room between them."""

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.samples.samples import samples
from crossfield.models.sketch.thinning import thin_shape
from PIL import Image, ImageDraw
from scipy import ndimage
from small_drawings import png, read, svg

SKETCHES = [known.name for known in samples() if known.kind == "sketch"]


def drawing(paths, page="0 0 100 100"):
    body = "".join(f'<path d="{path}" fill="none" stroke="{colour}"/>' for path, colour in paths)
    return svg(body, f'viewBox="{page}"')


def in_black(*paths, page="0 0 100 100"):
    return read(drawing([(path, "black") for path in paths], page), 48)


@pytest.mark.parametrize("size", [24, pytest.param(48, marks=pytest.mark.slow)])
def test_closed_drawings_have_no_opening_and_no_warning(size):
    for name in SKETCHES:
        assert cf.sample(name, size).reading.warnings == ()


def test_what_encloses_nothing_is_solved_as_a_rectangle_and_said_to_be():
    for paths in (["M10 40Q50 10 90 40"], ["M30 30H90V70H10V30H14", "M10 20H90"]):
        instance = in_black(*paths)
        assert instance.mask.all() == any("enclose nothing" in text for text in instance.reading.warnings)
    assert in_black("M10 40Q50 10 90 40").mask.all()


def test_a_hole_is_solved_in_one_colour_and_left_out_between_cuts():
    outer, inner = "M90 50A40 40 0 1 1 90 49.9Z", "M65 50A15 15 0 1 1 65 49.9Z"
    assert in_black(outer, inner).mask[23:25, 23:25].all()
    lines = [(outer, "black"), (inner, "black"), ("M10 50H30M70 50H90M50 10V30M50 70V90", "#d1242f")]
    assert not read(drawing(lines), 48).mask[18:30, 18:30].any()


LARGE = "0 0 200 200"


@pytest.mark.parametrize("width", [5, 6, 30])
def test_a_gap_between_limbs_stays_outside(width):
    trousers = f"M30 40H170V180H{100 + width / 2}V90H{100 - width / 2}V180H30Z"
    instance = read(drawing([(trousers, "black")], LARGE), 96)
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
    assert "close the outline" in text
    assert in_black(f"{HAND}H60", page=LARGE).reading.warnings == ()


def test_solid_ink_and_hatching_are_warned_of_with_their_place():
    hatching = "".join(f"M20 {20 + k / 2}H80" for k in range(60))
    parallels, text = in_black("M10 10H90V90H10Z", hatching).reading.warnings
    assert parallels.startswith("60 parallel lines round (50, 34.75) look like hatching")
    assert "strokes leave no room between them round (50," in text
    image = Image.new("L", (200, 200), 255)
    ImageDraw.Draw(image).rectangle((20, 20, 180, 180), outline=0, width=3)
    ImageDraw.Draw(image).ellipse((100, 100, 170, 170), fill=0)
    (text,) = read(png(image), 48, "a.png").reading.warnings
    assert "strokes leave no room between them round (13" in text


def test_drawings_off_their_page_are_warned_of():
    data = drawing([("M10 10H90V190H10Z", "black")])
    off, *_ = read(data, 48).reading.warnings
    assert off.startswith("1 stroke is off the page, wholly or in part, first <path> round (90, 100")


def test_thinning_leaves_lines_of_one_pixel():
    image = Image.new("1", (120, 80))
    ImageDraw.Draw(image).line((10, 10, 100, 60), fill=1, width=9)
    ImageDraw.Draw(image).ellipse((20, 40, 50, 70), fill=0, outline=1, width=5)
    shape = np.asarray(image)
    line = thin_shape(shape)
    assert not (line & ~shape).any()
    assert ndimage.label(line, np.ones((3, 3)))[1] == ndimage.label(shape, np.ones((3, 3)))[1]
    assert not ndimage.binary_opening(line, np.ones((2, 2))).sum() > 4
    neighbours = ndimage.convolve(line.astype(int), np.ones((3, 3)), mode="constant")
    assert (line & (neighbours == 2)).sum() == 2
