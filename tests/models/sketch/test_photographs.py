"""Photographs: the sheet on a table, light strokes on dark paper, thin colours; the drawing is known."""

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.sketch.bitmap import read_bitmap
from loops import for_each
from photographs import (
    BLACK,
    RED,
    WHITE,
    assert_same_drawing,
    draw_sheet,
    encode,
    light_on,
    photograph,
    read_clean,
)
from PIL import Image, ImageDraw
from small_drawings import png, read

BLUEPRINT = {"paper": "blue", "ink": WHITE}


ON_WOOD = "mouse", "wood", BLUEPRINT, {"turn": -20, "pitch": 20, "yaw": 18, "light": "shadow"}


@pytest.mark.parametrize(
    "sample, table, ink, view",
    [
        ("bottle", "mat", {}, {"turn": 12, "pitch": -30, "light": "lamp"}),
        pytest.param(*ON_WOOD, marks=pytest.mark.slow),
    ],
)
def test_a_sheet_on_a_table_is_straightened(sample, table, ink, view):
    sheet = draw_sheet(sample, **ink)
    instance = read(encode(photograph(sheet, table, **view), quality=88), 40, "a.jpg")
    assert_same_drawing(instance, read_clean(sample))
    (note,) = instance.reading.warnings
    assert note.startswith("the sheet in the photo was straightened (corners at (")
    width, height = instance.reading.page[2:]
    assert width / height == pytest.approx(sheet.shape[1] / sheet.shape[0], rel=0.03)


def test_a_sheet_that_the_picture_cuts_off_loses_its_surroundings():
    pixels = photograph(draw_sheet("mouse"), "wood", shift=(0.1, 0.1), fill=1, light="gradient")
    instance = read(encode(pixels), 40, "a.jpg")
    assert_same_drawing(instance, read_clean("mouse"))
    assert "take a picture of the whole sheet" in instance.reading.warnings[0]
    assert instance.reading.page == (0, 0, 1000, 750)


@pytest.mark.parametrize(
    "paper, ink, red",
    [
        ("black", WHITE, (220, 70, 60)),  # chalk and red chalk
        pytest.param("kraft", BLACK, WHITE, marks=pytest.mark.slow),
    ],
)
def test_strokes_are_lighter_or_darker_than_their_paper(paper, ink, red):
    sheet = draw_sheet("bottle", paper=paper, ink=ink, red=red)
    pixels = sheet * light_on("gradient", *sheet.shape[:2])
    pixels += np.random.default_rng(0).normal(0, 3, sheet.shape)
    instance = read(encode(pixels, quality=88), 40, "a.jpg")
    assert_same_drawing(instance, read_clean("bottle", one_colour=red == WHITE))


@pytest.mark.parametrize(
    "widths, quality", [((30, 2), 60), pytest.param((1.5, 1.5), 75, marks=pytest.mark.slow)]
)
def test_thin_red_strokes_count_by_their_length(widths, quality):
    data = encode(draw_sheet("bottle", widths=widths), quality=quality)
    assert_same_drawing(read(data, 40, "a.jpg"), read_clean("bottle", widths=widths))


def test_red_specks_are_no_red_strokes():
    image = Image.fromarray(draw_sheet("mouse").astype(np.uint8))
    pen = ImageDraw.Draw(image)
    for x, y in np.random.default_rng(3).uniform(0.3, 0.7, (12, 2)) * image.size:
        pen.ellipse((x - 5, y - 5, x + 5, y + 5), RED)
    assert not read_bitmap(png(image, "JPEG"), 40).has_two_colours
    pen.line((150, 300, 450, 320), RED, 3)
    assert read_bitmap(png(image, "JPEG"), 40).has_two_colours


@for_each("light, boxed", [("gradient", False), ("shadow", True)])
def test_paper_to_the_border_is_left_as_it_is(light, boxed):
    pixels = draw_sheet("cylinder_bend")
    if boxed:  # the paper goes on behind a frame
        pixels[60:-60, 60:-60][[0, -1]] = pixels[60:-60, 60:-60][:, [0, -1]] = 0
        pixels[30:44, 30:-30] = pixels[-44:-30, 30:-30] = pixels[30:-30, 30:44] = pixels[30:-30, -44:-30] = 20
    instance = read(encode(pixels * light_on(light, *pixels.shape[:2])), 40, "a.jpg")
    assert not any("sheet" in warning for warning in instance.reading.warnings)
    assert instance.reading.page == (0, 0, pixels.shape[1], pixels.shape[0])


@for_each("paper, fills", [("#334", ("white", "white")), ("white", ("#ffe8a3", "white"))])
def test_two_cards_of_a_drawing_are_no_sheets(paper, fills):
    image = Image.new("RGB", (900, 500), paper)
    pen = ImageDraw.Draw(image)
    for x, fill in zip((60, 500), fills, strict=True):
        pen.rounded_rectangle((x, 80, x + 340, 420), 12, fill, "black", 2)
        pen.ellipse((x + 50, 130, x + 290, 370), outline="black", width=3)
        pen.line((x + 70, 250, x + 270, 250), "red", 3)
    instance = read(png(image), 48, "a.png")
    assert (instance.reading.page, instance.grid.parts) == ((0, 0, 900, 500), 2)
    assert not any("sheet" in warning for warning in instance.reading.warnings)


def test_page_and_masks_of_a_straightened_sheet(tmp_path):
    """All grids are on one page, and a mask may have the pixels of the sheet or of the photograph."""
    pixels = photograph(draw_sheet("mouse"), "dark", turn=15, pitch=20)
    path = tmp_path / "photo.jpg"
    path.write_bytes(encode(pixels, quality=90))
    coarse = cf.read_sketch(path, size=24)
    width, height = map(round, coarse.reading.page[2:])
    corners = read_bitmap(path.read_bytes(), 24).sheet.corners
    masks = {"sheet": Image.new("L", (width, height), 255), "photo": Image.new("L", (1000, 750))}
    ImageDraw.Draw(masks["photo"]).polygon([tuple(corner) for corner in corners], 255)
    instances = []
    for name, mask in masks.items():
        mask.save(tmp_path / f"{name}.png")
        instances.append(cf.read_sketch(path, size=40, mask=tmp_path / f"{name}.png"))
        assert instances[-1].reading.page == coarse.reading.page
    assert_same_drawing(*instances)
    Image.new("L", (999, 750), 255).save(tmp_path / "other.png")
    with pytest.raises(cf.InputError, match=rf"999 x 750 pixels, but the sketch {width} x {height}"):
        cf.read_sketch(path, mask=tmp_path / "other.png")
