"""Layers of a field: their names, and their fit to the drawing of the field."""

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.pictures.layers import cut_at_border, fit_cubics, page_of
from hypothesis import given, settings
from hypothesis import strategies as st
from layered import NUMBER, layers_of, lines_in, numbers
from PIL import Image

NAMES = ["strokes", "crosses", "streamlines-v", "streamlines-u", "singularities"]


def level(height=6, width=10, pixel_size=5.0, origin=(20.0, 30.0)):
    """A field of horizontal and upright lines with a stroke along its second row."""
    pixels = np.stack([np.ones(width, int), np.arange(width)], axis=1)
    instance = cf.Instance.on_pixels(
        "level", np.ones((height, width)), pixels, np.zeros(width), np.ones(width),
        pixel_size=pixel_size, origin=origin,
    )  # fmt: skip
    nothing = np.zeros(instance.grid.size)
    return cf.CrossField(instance, nothing, nothing, np.zeros(len(instance.grid.first), int))


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """A file of layers of the level field."""
    return cf.draw(level(), tmp_path_factory.mktemp("drawn") / "a.svg")


def test_lines_and_strokes_are_where_they_are_on_the_drawing(drawn):
    root, layers = layers_of(drawn)
    assert list(layers) == NAMES
    assert numbers(root.get("viewBox")).tolist() == [0, 0, 70, 60]
    assert (root.get("width"), root.get("height")) == ("70", "60")
    strokes = np.stack(lines_in(layers["strokes"]))
    assert strokes[..., 1] == pytest.approx(30 + 1.5 * 5)
    assert sorted(strokes[..., 0].ravel()) == pytest.approx(sorted([*range(20, 70, 5), *range(25, 75, 5)]))
    for name, along in (("streamlines-u", 0), ("streamlines-v", 1)):
        lines = lines_in(layers[name])
        assert len(lines) > 10
        for line in lines:
            assert line[:, 1 - along] == pytest.approx(line[0, 1 - along])
            assert (line > (19.999, 29.999)).all()
            assert (line < (70.001, 60.001)).all()
        assert max(np.ptp(line[:, along]) for line in lines) > 0.8 * (50, 30)[along]


def test_crosses_are_there_but_not_shown_and_numbers_are_short(drawn):
    _, layers = layers_of(drawn)
    shown = [name for name, group in layers.items() if group.get("style") == "display:inline"]
    assert shown == [name for name in NAMES if name != "crosses"]
    crosses = lines_in(layers["crosses"])
    assert len(crosses) == 2 * level().instance.grid.size
    assert np.mean(crosses[0], axis=0) == pytest.approx([22.5, 32.5])
    assert max(len(number) for number in NUMBER.findall(drawn.read_text())) < 10


def test_the_page_begins_at_zero_unless_the_field_reaches_beyond_it():
    assert page_of(level(pixel_size=1, origin=(-0.5, 3.0)).instance) == (0.0, 0.0, 9.5, 9.0)
    assert page_of(level(pixel_size=1, origin=(-50.0, 3.0)).instance) == (-50.0, 3.0, 10.0, 6.0)


def test_the_picture_shows_the_layers_where_the_drawing_has_them(tmp_path):
    """Upright lines only right of x = 20 and below y = 30 of a page of 70 x 60."""
    picture = np.asarray(Image.open(cf.draw(level(), tmp_path / "a.png", kind="layers")).convert("RGB"))
    down, across = np.nonzero((picture != 255).any(axis=-1))
    height, width = picture.shape[:2]
    assert width / height == pytest.approx(70 / 60, rel=0.01)
    assert across.min() / width == pytest.approx(20 / 70, abs=0.02)
    assert down.min() / height == pytest.approx(30 / 60, abs=0.02)


@given(st.integers(0, 2**32 - 1), st.integers(4, 60), st.booleans())
@settings(max_examples=30, deadline=None)
def test_smooth_curves_pass_the_points_without_a_corner(seed, count, closed):
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 2 * np.pi if closed else 5, count)
    radius = 10 + rng.normal(size=3) @ np.stack([np.sin(t), np.cos(2 * t), np.sin(3 * t)])
    points = np.stack([radius * np.cos(t), radius * np.sin(t)], axis=1)
    if closed:
        points[-1] = points[0]
    curves = fit_cubics(points, 0.1)
    assert (curves[1:, 0] == curves[:-1, 3]).all()
    assert (curves[0, 0] == points[0]).all()
    assert (curves[-1, 3] == points[-1]).all()
    s = np.linspace(0, 1, 400)[:, None]
    on = np.concatenate(
        [
            (1 - s) ** 3 * a + 3 * (1 - s) ** 2 * s * b + 3 * (1 - s) * s**2 * c + s**3 * d
            for a, b, c, d in curves
        ]
    )
    nearest = np.sqrt(((points[:, None] - on[None]) ** 2).sum(axis=-1).min(axis=1))
    assert nearest.max() <= 0.11
    arriving, leaving = curves[:-1, 3] - curves[:-1, 2], curves[1:, 1] - curves[1:, 0]
    across = arriving[:, 0] * leaving[:, 1] - arriving[:, 1] * leaving[:, 0]
    turn = np.arctan2(across, np.sum(arriving * leaving, axis=1))
    assert np.abs(turn).max(initial=0) < 1e-6


def test_a_straight_line_is_one_curve_however_its_points_lie():
    for t in ([0, 1e-9, 1, 2, 3], [0, 1, 2, 2 + 1e-6], [0, 1e-3, 1, 1, 5, 5.01]):
        points = np.outer(t, [3.0, 4.0]) + 1
        (curve,) = fit_cubics(points, 1e-6)
        assert curve == pytest.approx(np.linspace(points[0], points[-1], 4))


def test_lines_are_cut_where_the_depth_ends():
    depth = np.full((5, 12), -1.0)
    depth[:, 3:6] = depth[:, 8:10] = 1.0
    line = np.stack([np.linspace(0, 10, 41), np.full(41, -1.0)], axis=1)
    parts = cut_at_border(line, depth)
    assert [(part[0, 0], part[-1, 0]) for part in parts] == [
        (pytest.approx(1.5), pytest.approx(4.5)),
        (pytest.approx(6.5), pytest.approx(8.5)),
    ]
    assert cut_at_border(line[:3], depth) == []
    assert len(cut_at_border(line[8:12], depth)) == 1
