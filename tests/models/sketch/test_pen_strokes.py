"""Pen strokes as text, drawn on paper (.scap) and in space (.curves): pages, views, and refusals."""

import crossfield as cf
import numpy as np
import pytest
from crossfield.models import input_limits
from crossfield.models.sketch.pen_strokes import read_curves, view_axes
from hypothesis import given, settings
from hypothesis import strategies as st
from loops import for_each
from PIL import Image
from small_drawings import read

SCAP = b"#10\t10\n@1\n{\n\t#1\t7\n\t@2\n\t-5\t-20\t0\n\t5\t-10\t0\n}\n{\n#2 7\n0 0\n10 0 1\n}\n"


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


def test_scap_takes_the_box_from_the_samples_and_all_strokes():
    instance = read(SCAP, 22, "a.scap")  # 20 pixels, and one of margin
    assert instance.pixel_size == pytest.approx(1)
    assert instance.origin == pytest.approx((-6, -21))
    assert instance.mask.shape == (22, 17)
    assert np.unique(np.round(np.degrees(instance.theta))).tolist() == [0, 135]


@for_each("data, source", [(SCAP, "a.scap"), (content(sheet()), "a.curves")])
def test_content_says_what_a_file_is_and_lines_end_in_any_way(data, source):
    windows = b"\xef\xbb\xbf" + data.replace(b"\n", b"\r\n")
    first = read(data, 24, source)
    for name in (source, "a.txt"):
        other = read(windows, 24, name)
        assert (other.theta.tolist(), other.w.tolist()) == (first.theta.tolist(), first.w.tolist())


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


@settings(max_examples=25)
@given(st.floats(-180, 180), st.floats(-90, 90))
def test_a_view_is_a_projection_at_right_angles_with_up_above(azimuth, elevation):
    right, down = view_axes(f"{azimuth},{elevation}")
    assert np.array([right @ right, down @ down, right @ down]) == pytest.approx([1, 1, 0], abs=1e-9)
    assert right[1] == 0
    assert down[1] <= 1e-9
    towards = np.cross(right, -down)
    assert towards[1] == pytest.approx(np.sin(np.radians(elevation)), abs=1e-9)


@for_each(
    "view, right, down",
    [("front", [1, 0, 0], [0, -1, 0]), ("side", [0, 0, -1], [0, -1, 0]), ("top", [1, 0, 0], [0, 0, 1])],
)
def test_named_views_have_their_axes(view, right, down):
    assert view_axes(view) == pytest.approx(np.array([right, down]), abs=1e-9)


@for_each("view", ["back", "", "1", "1,2,3", "nan,0", "0,91", "1e9,0", "x" * 9999])
def test_views_that_are_none_are_refused(view):
    with pytest.raises(
        cf.InputError, match=r"there is no view .*; choose front, side, top, or azi"
    ) as caught:
        read(content(sheet()), source="a.curves", view=view)
    assert len(str(caught.value)) < 400


def test_a_mask_is_as_large_as_the_page_and_labels_are_refused(tmp_path):
    width, height = (round(side) for side in read_curves(content(sheet())).page[2:])
    Image.new("L", (width, height), 255).save(tmp_path / "mask.png")
    instance = read(content(sheet()), 27, "a.curves", mask=tmp_path / "mask.png")
    assert instance.mask.all()
    assert instance.pixel_size == pytest.approx(width / 27)
    with pytest.raises(cf.InputError, match="whose strokes have no labels; leave the choice of class=a out"):
        read(content(sheet()), source="a.curves", curvature=["class=a"])


BROKEN = [
    ("#10 10\n{\n1 2\n3 4\n", "line 2: this stroke does not end"),
    ("#10 10\n{\n{\n", "line 3: a stroke starts inside the stroke of line 2"),
    ("#10 10\n}\n", "line 2: a stroke ends that did not start"),
    ("#10 10\n1 2 3\n", "line 2: a sample stands outside"),
    ("#10 10\n{\n#1 1\n1 2 0\nnan 3 0\n}\n", "line 5: a coordinate is not a finite number"),
    ("#10 10\n{\n1 2 0\nx y z\n}\n", "line 4: expected 'x y pressure', found 'x y z'"),
    ("#10\n{\n1 2\n3 4\n}\n", "line 1: expected '#width height'"),
    ("#0 -1\n{\n1 2\n3 4\n}\n", "line 1: the size '#0 -1' is not two numbers from"),
    ("#10 10\n{\n1 2\n}\n", "no stroke of two or more samples"),
    ("v 2\n0 0 0\n", "line 1: this stroke announces 2 points, and 1 follow"),
    ("v 2\n0 0 0\nv 2\n0 0 0\n1 1 1\n", "line 3: expected 'x y z', found 'v 2'"),
    ("v 1\n0 0 0\n1 1 1\n", "line 3: expected 'v N', found '1 1 1'"),
    ("v 2\n0 0\n1 1 1\n", "line 2: expected 'x y z', found '0 0'"),
    ("v 2\n0 0 nan\n1 1 1\n", "line 2: a coordinate is not a finite number"),
    ("v -2\n0 0 0\n1 1 1\n", "line 1: expected 'v N', found 'v -2'"),
    (f"v {'9' * 5000}\n", "line 1: expected 'v N', found 'v 99999"),
    ("v 1\n0 0 0\nv 0\n", "holds no stroke of two or more samples"),
    ("v 2\n1 2 3\n1 2 3\n", "everything is one point, seen from there"),
    ("hello", "line 1: expected"),
]


@for_each("text, message", BROKEN)
def test_broken_files_are_refused_with_the_line(text, message):
    for suffix in {"#": [".scap"], "v": [".curves"]}.get(text[0], [".scap", ".curves"]):
        with pytest.raises(cf.InputError) as caught:
            read(text.encode(), source=f"a{suffix}")
        assert message in str(caught.value)
        assert len(str(caught.value)) < 250


def test_a_mesh_is_no_drawing_in_space_and_too_many_lines_are_refused_before_they_are_split():
    with pytest.raises(cf.InputError, match="is not a whole picture"):
        read(b"v 1.0 2.0 3.0\nv 1 2 3\nf 1 2 3\n", 24, "a.obj")
    with pytest.raises(cf.InputError, match=f"more than {input_limits.MAX_LINES} lines"):
        read(b"v 2\n" + b"\n" * (input_limits.MAX_LINES + 1), source="a.curves")


@settings(max_examples=20)
@given(
    st.lists(st.lists(st.tuples(*[st.floats(-1e9, 1e9)] * 3), min_size=2, max_size=4), min_size=1, max_size=3)
)
def test_all_strokes_in_space_make_a_page_or_a_typed_error(strokes):
    try:
        curves = read_curves(content(strokes))
    except cf.CrossfieldError:
        return
    assert np.isfinite(curves.points).all()
    width, height = curves.page[2:]
    assert max(width, height) == 1080
    assert min(width, height) >= 80
