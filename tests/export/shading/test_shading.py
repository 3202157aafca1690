"""Surfaces in light: normals stay normals on any raster, the outline is smooth, and light is Lambert's."""

import io

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.pictures.svg import encode_png
from crossfield.export.shading.colours import CLAY, colour_normals, direction_to, shade_by_light, to_eight_bit
from crossfield.export.shading.raster import Raster, raster, view_of_grid
from loops import for_each
from PIL import Image
from shapes import ball, ball_normals, disc, plane, surface_of


def fine(surface, scale):
    return raster(surface.instance, surface.normals, view_of_grid(surface.instance, scale))


def mapped(surface, scale):
    return to_eight_bit(colour_normals(fine(surface, scale))).astype(int)


def test_a_normal_map_has_unit_normals_near_those_of_the_pixels_right_red_up_green():
    surface = ball(20)
    texels = mapped(surface, 5)
    assert texels.shape == (100, 100, 4)
    assert texels[50, 85, 0] > 180 > texels[50, 15, 0] + 100
    assert texels[15, 50, 1] > 180 > texels[85, 50, 1] + 100
    read = Image.open(io.BytesIO(encode_png(texels.astype(np.uint8))))
    assert (np.asarray(read) == texels).all()
    inside = texels[texels[..., 3] == 255]
    assert np.abs(np.linalg.norm(2 * inside[:, :3] / 255 - 1, axis=1) - 1).max() < 0.02
    middles = texels[2::5, 2::5][surface.instance.mask][:, :3]
    deep = ball_normals(surface)[:, 2] > 0.6
    assert np.abs(middles - 255 * (surface.normals + 1) / 2)[deep].max() < 3


def test_a_plane_has_one_normal_up_to_its_border():
    picture = fine(plane(9, 0.5, -1.0), 7)
    normal = np.array([-0.5, 1.0, 1.0]) / 1.5
    assert np.abs(picture.normals[picture.opacity > 0] - normal).max() < 1e-12
    assert np.abs(np.linalg.norm(picture.normals, axis=-1) - 1).max() < 1e-12
    assert (mapped(plane(6, 0.0, 0.0), 3)[9, 9] == (128, 128, 255, 255)).all()


def outlined(mask, scale=8):
    """Opacity of a flat surface."""
    return fine(surface_of(mask, lambda x, _: 0 * x), scale).opacity


def test_the_outline_keeps_the_area_and_smooths_the_stairs():
    opacity = outlined(disc(40, 17))
    assert opacity.sum() / 64 == pytest.approx(np.pi * 17**2, rel=0.015)
    y, x = (np.mgrid[:320, :320] + 0.5) / 8 - 20
    radius = np.hypot(x, y)
    assert opacity[radius < 16.5].min() == 1
    assert opacity[radius > 17.5].max() == 0
    part = (opacity > 0) & (opacity < 1)
    assert radius[part].max() - radius[part].min() < 0.7  # the stairs are 1.4 apart
    assert part.sum() < 4 * 2 * np.pi * 17 * 8


def test_what_is_one_pixel_thin_stays_and_so_do_thin_gaps():
    mask = np.zeros((12, 24), dtype=bool)
    mask[5, 2:22] = True
    assert outlined(mask)[5 * 8 + 4, 3 * 8 : 21 * 8].min() == 1
    gap = outlined(~mask)
    assert gap[5 * 8 + 4, 4 * 8 : 20 * 8].max() == 0
    assert gap[2 * 8 + 4, 8:-8].min() == 1


@for_each("slope, length", [(0, 10), (1, 10), (-1, 5), (0, 4)])
def test_a_line_of_single_pixels_stays(slope, length):
    """Diagonal lines vanished, and short ones nearly."""
    mask = np.zeros((30, 30), dtype=bool)
    mask[8:22, 4:14] = True
    line = (15 + slope * np.arange(length), 14 + np.arange(length))
    mask[line] = True
    opacity = outlined(mask)[4::8, 4::8]
    assert opacity[line].min() == 1


def test_strokes_at_the_border_are_the_border():
    mask = np.ones((16, 16), dtype=bool)
    surface = surface_of(mask, lambda x, _: 0 * x)
    edge = np.argwhere(~np.pad(np.ones((14, 14), dtype=bool), 1))
    instance = cf.Instance.on_pixels("shape", mask, edge, np.zeros(len(edge)), np.ones(len(edge)))
    drawn = raster(instance, surface.normals, view_of_grid(instance, 10)).opacity
    assert fine(surface, 10).opacity[80].sum() == pytest.approx(160, abs=1.5)
    assert drawn[80].sum() == pytest.approx(152, abs=1.5)


def encoded(energy):
    """The encoded value of clay on a screen in light of that energy."""
    light = np.minimum(energy * np.array(CLAY), 1.0)
    return 1.055 * light ** (1 / 2.4) - 0.055


def test_light_comes_back_with_the_cosine_and_mirrored_light_is_mirrored():
    one = np.ones((1, 1))
    for azimuth, elevation in ((0.3, 0.4), (2.2, 1.5), (-1.0, 0.0)):
        light = azimuth, elevation
        towards = direction_to(light)
        assert np.linalg.norm(towards) == pytest.approx(1)
        facing = shade_by_light(Raster(towards[None, None], one), light)
        away = shade_by_light(Raster((towards * (-1, -1, 1))[None, None], one), light)
        assert (facing >= away).all()
    frontal = shade_by_light(Raster(np.array([[[0.0, 0.0, 1.0]]]), one), (0.0, np.pi / 2))[0, 0]
    assert frontal[:3] == pytest.approx(encoded(1.09 + 0.08 * np.sqrt(0.5)))
    side = shade_by_light(Raster(np.array([[[0.8, 0.0, 0.6]]]), one), (np.pi, 0.0))[0, 0]
    assert side[:3] == pytest.approx(encoded(0.04 + 0.06 + 0.08 * 0.8))  # in the lamp's shade
    picture = fine(ball(16), 4)
    left, right = shade_by_light(picture, (2.0, 0.7)), shade_by_light(picture, (np.pi - 2.0, 0.7))
    assert np.abs(left - right[:, ::-1]).max() < 1e-9
    rows, columns = np.nonzero(left[..., 0] == left[picture.opacity == 1][:, 0].max())
    assert rows.mean() < 32
    assert columns.mean() < 32


@for_each("angles", [(0.0, -0.1), (0.0, 1.7), (np.nan, 0.5), (0.0, np.nan), (np.inf, 0.5)])
def test_a_lamp_below_the_drawing_is_refused(angles):
    with pytest.raises(cf.InputError, match="elevation is between 0 and 90"):
        direction_to(angles)
