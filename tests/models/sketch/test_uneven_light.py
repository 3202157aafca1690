"""Photographs: shadows are not ink, ink is not half of the paper, and even light changes nothing."""

import io

import numpy as np
import pytest
from crossfield.models.errors import InputError
from crossfield.models.sketch.bitmap import read_bitmap
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image, ImageDraw
from scipy import ndimage

WIDTH, HEIGHT = 360, 280


def drawing(colour=(0, 0, 0)):
    """A closed shape with cross lines and a crowded corner, anti-aliased, as float [h, w, 3]."""
    image = Image.new("RGB", (4 * WIDTH, 4 * HEIGHT), "white")
    draw = ImageDraw.Draw(image)
    draw.ellipse((120, 120, 1320, 1000), outline=colour, width=12)
    draw.arc((120, 400, 1320, 720), 0, 180, fill=(0, 0, 0), width=12)
    for x in range(400, 1000, 60):
        draw.line((x, 200, x + 40, 900), fill=colour, width=10)
    return np.asarray(image.resize((WIDTH, HEIGHT), Image.Resampling.BOX)).astype(float)


def picture(pixels):
    stream = io.BytesIO()
    Image.fromarray(np.clip(pixels, 0, 255).astype(np.uint8)).save(stream, "PNG")
    return read_bitmap(stream.getvalue(), 32)


DRAWING = drawing()
CLEAN = picture(DRAWING).ink


def assert_nearly_the_strokes(pixels):
    """All but a hundredth of the dark pixels are found, and next to nothing a pixel beside the strokes."""
    ink = picture(pixels).ink > 0.5
    dark, near = CLEAN > 0.9, ndimage.binary_dilation(CLEAN > 0.3)
    assert (dark & ~ink).sum() <= 0.01 * dark.sum()
    assert (ink & ~near).sum() <= 0.01 * dark.sum()


@settings(max_examples=6, deadline=None)
@given(st.floats(0, 2 * np.pi), st.floats(0.35, 1), st.integers(0, 99))
def test_a_drawing_in_a_gradient_of_light_and_noise_has_nearly_the_strokes_of_the_clean_one(
    angle, dark, seed
):
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    along = np.cos(angle) * x + np.sin(angle) * y
    light = 1 - (1 - dark) * (along - along.min()) / np.ptp(along)
    noise = np.random.default_rng(seed).normal(0, 3, light.shape)
    assert_nearly_the_strokes((DRAWING * light[..., None]) + noise[..., None])


def test_the_edge_of_a_shadow_and_a_dark_rim_are_no_strokes():
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    for light in (
        np.where(x + y / 3 > 220, 0.5, 1.0),
        1 - 0.6 * ((2 * x / WIDTH - 1) ** 2 + (2 * y / HEIGHT - 1) ** 2) / 2,
    ):
        assert_nearly_the_strokes(DRAWING * light[..., None])


def test_red_stays_red_in_the_shade():
    pixels = drawing((210, 36, 47)) * np.linspace(1, 0.35, WIDTH)[:, None]
    clean, shaded = picture(drawing((210, 36, 47))), picture(pixels)
    strong = (clean.ink > 0.5) & (shaded.ink > 0.5)
    assert (clean.red[strong] == shaded.red[strong]).mean() > 0.98
    assert 0.2 < clean.red[strong].mean() < 1


def test_evenly_lit_pictures_have_one_level_of_paper():
    """All paper of one grey, and a little grain on it, changes no more than rounding does."""
    grain = np.random.default_rng(0).normal(0, 2, (HEIGHT, WIDTH, 1))
    grey = picture(DRAWING * 0.8).ink
    assert np.abs(grey - CLEAN).max() < 0.02
    assert_nearly_the_strokes(DRAWING * 0.8 + grain)


@pytest.mark.parametrize("black", [0.55, 0.7])
def test_ink_on_half_of_the_paper_is_refused_with_a_remedy(black):
    pixels = np.full((HEIGHT, WIDTH), 250.0)
    pixels[: round(black * HEIGHT)] = 20
    with pytest.raises(InputError, match=r"shows ink on (55|70)% of the paper.*crop it to the drawing"):
        picture(pixels)


def test_what_is_most_frequent_is_paper():
    """Stripes are ink if they are narrow, and have no meaning if neither colour prevails."""
    stripes = [np.full((HEIGHT, WIDTH), 250.0) for _ in range(3)]
    for pixels, black in zip(stripes, (6, 11, 14), strict=True):
        pixels[:, np.arange(WIDTH) % 20 < black] = 20
    dark, light = picture(stripes[0]).ink > 0.5, picture(stripes[2]).ink > 0.5
    assert (dark == (stripes[0] < 100)).all()
    assert (light == (stripes[2] > 100))[:, :-20].all()  # the border is light
    with pytest.raises(InputError, match=r"shows ink on \d\d% of the paper"):
        picture(stripes[1])
