"""Strokes drawn in space, .curves: views, and refusals."""

import crossfield as cf
import numpy as np
import pytest
from crossfield.models import input_limits
from crossfield.models.errors import CrossfieldError, InputError
from crossfield.models.sketch.pen_strokes import read_curves, view_axes
from hypothesis import given, settings
from hypothesis import strategies as st
from loops import for_each
from PIL import Image
from small_drawings import read


def content(strokes):
    """Strokes (n, 3) as a .curves file."""
    rows = ("".join(f"{x} {y} {z}\n" for x, y, z in stroke) for stroke in strokes)
    return "".join(f"v {len(stroke)}\n{row}" for stroke, row in zip(strokes, rows, strict=True)).encode()


def sheet(count=21):
    """A wavy sheet of 4 by 2, standing upright: its outline and two lines in it."""
    t = np.linspace(0, 1, count)
    one = np.ones_like(t)
    wave = 0.1 * np.sin(3 * t)
    across = [np.stack([4 * t, height * one, wave], axis=1) for height in (0, 1, 2)]
    up = [np.stack([4 * x * one, 2 * t, 0.1 * np.sin(3 * x) * one], axis=1) for x in (0, 0.4, 1)]
    return [*across, *up]


def test_strokes_are_seen_along_the_third_principal_axis_with_up_above():
    curves = read_curves(content(sheet()))
    left, top, right, bottom = curves.box
    assert (left, top) == pytest.approx((40, 40))
    assert right == pytest.approx(1040)
    assert bottom == pytest.approx(540, abs=5)
    assert curves.page == (0, 0, 1080, np.ceil(bottom - 40) + 80)
    assert np.unique(curves.curve).tolist() == [0, 1, 2, 3, 4, 5]
    lowest, highest = (curves.points[curves.curve == number][..., 1].mean() for number in (0, 2))
    assert lowest > highest  # y down


def test_principal_axes_do_not_depend_on_the_samples_but_on_the_strokes():
    coarse = sheet(21)
    fine = [np.repeat(stroke, 1 + 3 * (number % 2), axis=0) for number, stroke in enumerate(coarse)]
    first, second = (read_curves(content(strokes)) for strokes in (coarse, fine))
    assert first.box == pytest.approx(second.box, abs=1e-6)


@settings(max_examples=25, deadline=None)
@given(st.floats(-180, 180), st.floats(-90, 90))
def test_a_view_is_a_projection_at_right_angles_with_up_above(azimuth, elevation):
    right, down = view_axes(f"{azimuth},{elevation}")
    assert np.array([right @ right, down @ down, right @ down]) == pytest.approx([1, 1, 0], abs=1e-9)
    assert right[1] == 0
    assert down[1] <= 1e-9
    towards = np.cross(right, -down)
    assert towards[1] == pytest.approx(np.sin(np.radians(elevation)), abs=1e-9)


def test_named_views_have_their_axes():
    names = {
        "front": ([1, 0, 0], [0, -1, 0]),
        "side": ([0, 0, -1], [0, -1, 0]),
        "top": ([1, 0, 0], [0, 0, 1]),
    }
    for name, axes in names.items():
        assert view_axes(name) == pytest.approx(np.array(axes), abs=1e-9)


def test_content_or_suffix_say_what_a_file_is(tmp_path):
    data = content(sheet())
    first = read(data, 24, "a.txt")
    windows = b"\xef\xbb\xbf" + data.replace(b"\n", b"\r\n")
    assert read(windows, 24, "a.txt").sha256 == first.sha256
    (tmp_path / "a.curves").write_bytes(data)
    file = tmp_path / "a.curves"
    instance = cf.read_sketch(file, size=24, silhouette="outer")
    assert len(instance.theta) < len(first.theta)
    with pytest.raises(InputError, match="whose strokes have no labels; leave the choice of class=a out"):
        cf.read_sketch(file, curvature=["class=a"])
    with pytest.raises(CrossfieldError, match="is not a whole picture"):
        read(b"v 1.0 2.0 3.0\nv 1 2 3\nf 1 2 3\n", 24, "a.obj")


def test_a_mask_is_as_large_as_the_page(tmp_path):
    (tmp_path / "a.curves").write_bytes(content(sheet()))
    width, height = (round(side) for side in read_curves(content(sheet())).page[2:])
    Image.new("L", (width, height), 255).save(tmp_path / "mask.png")
    instance = cf.read_sketch(tmp_path / "a.curves", size=27, mask=tmp_path / "mask.png")
    assert instance.mask.all()
    assert instance.pixel_size == pytest.approx(width / 27)
    Image.new("L", (99, 9), 255).save(tmp_path / "mask.png")
    with pytest.raises(InputError, match=f"99 x 9 pixels, but the sketch {width} x {height}"):
        cf.read_sketch(tmp_path / "a.curves", mask=tmp_path / "mask.png")


BROKEN = {
    "v 2\n0 0 0\n": "line 1: this stroke announces 2 points, and 1 follow",
    "v 999999999\n0 0 0\n": "line 1: this stroke announces 999999999 points, and 1 follow",
    "v 2\n0 0 0\nv 2\n0 0 0\n1 1 1\n": "line 3: expected 'x y z', found 'v 2'",
    "v 1\n0 0 0\n1 1 1\n": "line 3: expected 'v N', found '1 1 1'",
    "v 2\n0 0\n1 1 1\n": "line 2: expected 'x y z', found '0 0'",
    "v 2\n0 0 nan\n1 1 1\n": "line 2: a coordinate is not a finite number",
    "v 2\n\n0 0 0\n1e300 1 1\n": "line 4: a coordinate is not a finite number",
    "v -2\n0 0 0\n1 1 1\n": "line 1: expected 'v N', found 'v -2'",
    f"v {'9' * 5000}\n": "line 1: expected 'v N', found 'v 99999",
    "v 1\n0 0 0\nv 0\n": "holds no stroke of two or more samples",
    "v 2\n1 2 3\n1 2 3\n": "everything is one point, seen from there",
    "hello": "line 1: expected 'v N', found 'hello'",
}


@for_each("text", BROKEN)
def test_broken_files_are_refused_with_the_line(text):
    with pytest.raises(InputError) as caught:
        read_curves(text.encode())
    assert BROKEN[text] in str(caught.value)
    assert len(str(caught.value)) < 200


def test_more_lines_than_the_limit_are_refused_before_they_are_split():
    with pytest.raises(InputError, match=f"more than {input_limits.MAX_LINES} lines"):
        read_curves(b"v 2\n" + b"\n" * (input_limits.MAX_LINES + 1))


@for_each("view", ["back", "", "1", "1,2,3", "nan,0", "0,91", "1e9,0", "x" * 9999])
def test_views_that_are_none_are_refused(view):
    with pytest.raises(
        InputError, match=r"there is no view .*; choose front, side, top, or azimuth"
    ) as caught:
        read_curves(content(sheet()), view)
    assert len(str(caught.value)) < 300


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.lists(st.tuples(*[st.floats(-1e9, 1e9)] * 3), min_size=2, max_size=4), min_size=1, max_size=3)
)
def test_all_strokes_in_space_make_a_page_or_a_typed_error(strokes):
    try:
        curves = read_curves(content(strokes))
    except CrossfieldError:
        return
    assert np.isfinite(curves.points).all()
    width, height = curves.page[2:]
    assert max(width, height) == 1080
    assert min(width, height) >= 80
