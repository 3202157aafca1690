"""Photographs: shadows are not ink, ink is not half of the paper, and even light changes nothing."""

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.sketch.bitmap import read_bitmap
from loops import for_each
from PIL import Image, ImageDraw
from scipy import ndimage
from small_drawings import png

WIDTH, HEIGHT = 360, 280
Y, X = np.mgrid[0:HEIGHT, 0:WIDTH]


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
    return read_bitmap(png(Image.fromarray(np.clip(pixels, 0, 255).astype(np.uint8))), 32)


DRAWING = drawing()
CLEAN = picture(DRAWING).ink


def gradient(angle, dark):
    """Light that falls to a share of itself in a direction."""
    along = np.cos(angle) * X + np.sin(angle) * Y
    return 1 - (1 - dark) * (along - along.min()) / np.ptp(along)


@for_each(
    "light, noise",
    [
        (gradient(0.4, 0.35), 3),
        (gradient(4.0, 0.9), 3),
        (np.where(X + Y / 3 > 220, 0.5, 1.0), 0),  # the edge of a shadow
        (1 - 0.6 * ((2 * X / WIDTH - 1) ** 2 + (2 * Y / HEIGHT - 1) ** 2) / 2, 0),  # a dark rim
        (np.full(X.shape, 0.8), 2),
    ],
)
def test_a_drawing_in_uneven_light_and_noise_has_nearly_the_strokes_of_the_clean_one(light, noise):
    """All but a hundredth of the dark pixels are found, and next to nothing a pixel beside the strokes."""
    grain = np.random.default_rng(0).normal(0, noise, light.shape)
    ink = picture((DRAWING * light[..., None]) + grain[..., None]).ink > 0.5
    dark, near = CLEAN > 0.9, ndimage.binary_dilation(CLEAN > 0.3)
    assert (dark & ~ink).sum() <= 0.01 * dark.sum()
    assert (ink & ~near).sum() <= 0.01 * dark.sum()


def test_what_is_most_frequent_is_paper():
    """Stripes are ink if they are narrow, and have no meaning if neither colour prevails."""
    stripes = [np.full((HEIGHT, WIDTH), 250.0) for _ in range(3)]
    for pixels, black in zip(stripes, (6, 11, 14), strict=True):
        pixels[:, np.arange(WIDTH) % 20 < black] = 20
    dark, light = picture(stripes[0]).ink > 0.5, picture(stripes[2]).ink > 0.5
    assert (dark == (stripes[0] < 100)).all()
    assert (light == (stripes[2] > 100))[:, :-20].all()  # the border is light
    with pytest.raises(cf.InputError, match=r"shows ink on \d\d% of the paper.*crop it to the drawing"):
        picture(stripes[1])
