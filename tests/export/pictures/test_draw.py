from __future__ import annotations

import matplotlib as mpl
import numpy as np
import pytest
from crossfield.export.pictures import marks, panels
from crossfield.export.pictures.draw import KINDS, draw
from crossfield.models.errors import InputError
from crossfield.models.field.field import CrossField, field_in_windows
from crossfield.models.instance.instance import Instance
from folders import contents
from loops import for_each
from PIL import Image

MAGIC = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}


def instance_of(mask, row, column, theta=0.0, **more):
    return Instance.on_pixels(
        "sample", mask, np.array([[row, column]]), np.array([theta]), np.array([1.0]), **more
    )


def singular(size, index=0.25, x0=1.2, y0=0.4):
    """A field with one singularity, right and above of the middle."""
    instance = instance_of(np.ones((size, size)), 0, 0)
    x, y = instance.grid.columns - (size - 1) / 2, (size - 1) / 2 - instance.grid.rows
    alpha = index * np.arctan2(y - y0, x - x0)
    alpha -= alpha[0]
    return field_in_windows(instance, alpha, 0 * alpha, np.zeros(len(instance.grid.first), dtype=np.int32))


def picture_of(path):
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def like(picture, colour, tolerance=12):
    return (
        np.abs(picture - np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)])).max(axis=-1) <= tolerance
    )


def frame_of(picture):
    """First and last row and column of the outline of a full mask."""
    grey = like(picture, marks.BORDER, 40) & (np.ptp(picture, axis=-1) < 20)
    sides = (np.flatnonzero(grey.sum(axis) > 0.3 * grey.sum(axis).max()) for axis in (1, 0))
    return [side[at] for side in sides for at in (0, -1)]


def place(dots, picture):
    """Middle of the found dots as (across, down), 0 to 1 within the outline."""
    top, bottom, left, right = frame_of(picture)
    y, x = np.nonzero(dots[top : bottom + 1, left : right + 1])
    return x.mean() / (right - left), y.mean() / (bottom - top)


@pytest.mark.slow
@for_each(
    "kind, suffix",
    [("field", ".svg"), ("angle", ".pdf"), ("overview", ".svg"), *((kind, ".png") for kind in KINDS)],
)
def test_every_kind_and_suffix_is_written_the_same_twice(tmp_path, kind, suffix):
    field = singular(5)
    first = draw(field, tmp_path / f"first{suffix}", kind=kind)
    assert first == tmp_path / f"first{suffix}"
    data = first.read_bytes()
    assert data.startswith(MAGIC[suffix])
    with mpl.rc_context(
        {"lines.linewidth": 9.0, "svg.hashsalt": "other", "font.size": 30.0, "savefig.bbox": "tight"}
    ):
        assert draw(field, tmp_path / f"second{suffix}", kind=kind).read_bytes() == data
    assert list(contents(tmp_path)) == [f"first{suffix}", f"second{suffix}"]


def test_row_0_is_at_the_top_and_strokes_lie_where_they_are(tmp_path):
    path = draw(instance_of(np.ones((8, 8)), 2, 5), tmp_path / "a.png", kind="instance")
    picture = picture_of(path)
    across, down = place(like(picture, marks.STROKE), picture)
    assert across == pytest.approx(5.5 / 8, abs=0.01)
    assert down == pytest.approx(2.5 / 8, abs=0.01)


def test_strokes_lean_counter_clockwise(tmp_path):
    path = draw(instance_of(np.ones((3, 3)), 1, 1, theta=np.pi / 6), tmp_path / "a.png", kind="instance")
    down, across = np.nonzero(like(picture_of(path), marks.STROKE))
    slope = np.polyfit(across, -down, 1)[0]
    assert np.arctan(slope) == pytest.approx(np.pi / 6, abs=0.05)


def test_the_mask_is_white_and_the_rest_grey(tmp_path):
    mask = np.zeros((10, 10))
    mask[:, :4] = 1
    picture = picture_of(draw(instance_of(mask, 5, 2), tmp_path / "a.png", kind="instance"))
    grey = like(picture, panels.OUTSIDE, tolerance=2)
    down, across = (np.flatnonzero(grey.sum(axis) > 0.8 * grey.sum(axis).max()) for axis in (1, 0))
    assert np.ptp(across) / np.ptp(down) == pytest.approx(0.6, abs=0.01)


@pytest.mark.parametrize(
    "kind, index, colour",
    [
        ("field", 0.25, marks.POSITIVE),
        pytest.param("crosses", -0.25, marks.NEGATIVE, marks=pytest.mark.slow),
        ("angle", -0.25, marks.NEGATIVE),
    ],
)
def test_singularities_are_dots_in_their_place(tmp_path, kind, index, colour):
    field = singular(12, index)
    assert field.singularities.index.tolist() == [index]
    expected = (field.singularities.column[0] + 1) / 12, (field.singularities.row[0] + 1) / 12
    picture = picture_of(draw(field, tmp_path / "a.png", kind=kind))
    assert place(like(picture, colour, 4), picture) == pytest.approx(expected, abs=0.01)


def test_both_families_have_their_colours(tmp_path):
    instance = instance_of(np.ones((9, 9)), 4, 4)
    flat = np.zeros(81)
    field = field_in_windows(instance, flat, flat, np.zeros(len(instance.grid.first), dtype=np.int32))
    for kind in ("field", "crosses"):
        picture = picture_of(draw(field, tmp_path / "a.png", kind=kind))[:1000]
        level, upright = (like(picture, colour, 60) for colour in marks.FAMILIES)
        assert level.sum(axis=1).max() > 3 * level.sum(axis=0).max()  # u is level, as the stroke is
        assert upright.sum(axis=0).max() > 3 * upright.sum(axis=1).max()


def test_degenerate_pixels_are_marked(tmp_path):
    instance = instance_of(np.ones((10, 10)), 0, 0)
    beta = np.where((instance.grid.rows >= 5) & (instance.grid.columns >= 5), np.pi / 4, 0.0)
    field = CrossField(instance, 0 * beta, beta, np.zeros(len(instance.grid.first), dtype=np.int32))
    picture = picture_of(draw(field, tmp_path / "a.png"))
    across, down = place(like(picture, panels.COLLAPSED, 4), picture)
    assert (across, down) == pytest.approx((0.75, 0.75), abs=0.02)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "instance"])
def test_an_instance_alone_has_no_field(tmp_path, kind):
    with pytest.raises(InputError, match="an instance without a field"):
        draw(singular(4).instance, tmp_path / "a.png", kind=kind)
