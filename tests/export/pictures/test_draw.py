"""Pictures show what is there, where it is: strokes, mask, singularities, families, degenerate pixels."""

from __future__ import annotations

import re

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.pictures import marks, panels
from crossfield.export.pictures.palette import ANGLES, DARK, LIGHT
from loops import for_each
from PIL import Image
from places import ROOT


def instance_of(mask, row, column, theta=0.0):
    return cf.Instance.on_pixels(
        "sample", mask, np.array([[row, column]]), np.array([theta]), np.array([1.0])
    )


def singular(size, index=0.25, x0=1.2, y0=0.4):
    """A field with one singularity, right and above of the middle."""
    instance = instance_of(np.ones((size, size)), 0, 0)
    x, y = instance.grid.columns - (size - 1) / 2, (size - 1) / 2 - instance.grid.rows
    u = index * np.arctan2(y - y0, x - x0)
    return cf.CrossField.from_lines(instance, u, u + np.pi / 2)


def picture_of(path):
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def like(picture, colour, tolerance=12):
    rgb = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)])
    return np.abs(picture - rgb).max(axis=-1) <= tolerance


def extent(pixels, share):
    """First and last row and column that have at least this share of the most of these pixels in one."""
    sides = (np.flatnonzero(pixels.sum(axis) > share * pixels.sum(axis).max()) for axis in (1, 0))
    return [side[at] for side in sides for at in (0, -1)]


def place(dots, picture):
    """Middle of the found dots as (across, down), 0 to 1 within the outline of a full mask."""
    grey = like(picture, marks.BORDER, 40) & (np.ptp(picture, axis=-1) < 20)
    top, bottom, left, right = extent(grey, 0.3)
    y, x = np.nonzero(dots[top : bottom + 1, left : right + 1])
    return x.mean() / (right - left), y.mean() / (bottom - top)


def test_row_0_is_at_the_top_and_strokes_lie_where_they_are_and_lean_counter_clockwise(tmp_path):
    instance = instance_of(np.ones((8, 8)), 2, 5, theta=np.pi / 6)
    picture = picture_of(cf.draw(instance, tmp_path / "a.png"))
    stroke = like(picture, marks.STROKE)
    assert place(stroke, picture) == pytest.approx((5.5 / 8, 2.5 / 8), abs=0.01)
    down, across = np.nonzero(stroke)
    assert np.arctan(np.polyfit(across, -down, 1)[0]) == pytest.approx(np.pi / 6, abs=0.05)


def test_the_mask_is_white_and_the_rest_grey(tmp_path):
    mask = np.zeros((10, 10))
    mask[:, :4] = 1
    picture = picture_of(cf.draw(instance_of(mask, 5, 2), tmp_path / "a.png"))
    top, bottom, left, right = extent(like(picture, panels.OUTSIDE, tolerance=2), 0.8)
    assert (right - left) / (bottom - top) == pytest.approx(0.6, abs=0.01)


@for_each("kind, index, colour", [("crosses", 0.25, marks.POSITIVE), ("angle", -0.25, marks.NEGATIVE)])
def test_singularities_are_dots_in_their_place(tmp_path, kind, index, colour):
    field = singular(8, index)
    assert field.singularities.index.tolist() == [index]
    expected = (field.singularities.column[0] + 1) / 8, (field.singularities.row[0] + 1) / 8
    picture = picture_of(cf.draw(field, tmp_path / "a.png", kind=kind))
    assert place(like(picture, colour, 4), picture) == pytest.approx(expected, abs=0.01)


@for_each("kind, collapsed", [("field", np.pi / 4), ("crosses", 0.0)])
def test_both_families_have_their_colours_and_degenerate_pixels_a_mark(tmp_path, kind, collapsed):
    instance = instance_of(np.ones((10, 10)), 0, 0)
    corner = (instance.grid.rows >= 5) & (instance.grid.columns >= 5)
    beta = np.where(corner, collapsed, 0.0)
    field = cf.CrossField(instance, 0 * beta, beta, np.zeros(len(instance.grid.first), dtype=np.int32))
    picture = picture_of(cf.draw(field, tmp_path / "a.png", kind=kind))
    u, v = (like(picture[:1000], colour, 60) for colour in marks.FAMILIES)
    assert u.sum(axis=1).max() > 2 * u.sum(axis=0).max()  # u is level, as the stroke is
    assert v.sum(axis=0).max() > 2 * v.sum(axis=1).max()
    if collapsed:
        assert place(like(picture, panels.COLLAPSED, 4), picture) == pytest.approx((0.75, 0.75), abs=0.02)


@for_each("kind", ["crosses", "field", "angle", "overview", "layers"])
def test_an_instance_alone_has_no_field(tmp_path, kind):
    with pytest.raises(cf.InputError, match="an instance without a field"):
        cf.draw(singular(4).instance, tmp_path / "a.png", kind=kind)


def test_the_studio_has_the_colours_of_the_pictures():
    text = (ROOT / "templates/studio/studio.css").read_text()
    assert re.findall(r"--line: (#[0-9a-f]{6});", text) == [LIGHT["stroke"], DARK["stroke"]]
    assert f"to right, {', '.join(ANGLES)})" in text
