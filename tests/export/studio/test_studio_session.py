"""Documents of the page: their checks, and their instances, fields, surfaces and files."""

from __future__ import annotations

import io
import re
import tracemalloc
import zipfile
from base64 import b64decode

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.studio.document import Document
from crossfield.export.studio.files import download
from crossfield.export.studio.next_step import find_next_step
from crossfield.export.studio.opening import open_drawing
from crossfield.export.studio.session import (
    IN,
    LEFT_OUT,
    STROKE,
    compute_field,
    compute_surface,
    hints_on_mask,
    read_drawn,
)
from crossfield.export.studio.views import field_step, surface_step
from loops import for_each
from photographs import assert_same_drawing, draw_sheet, encode, photograph
from PIL import Image, ImageDraw
from small_drawings import png, sample_svg
from studios import CROSSED, PEBBLE, changed


def document(**parts):
    return Document.from_bytes(changed(**parts))


def click(x, y):
    return [{"kind": "toggle", "points": [x, y], "radius": 0}]


@for_each(
    "parts, place",
    [
        *((data, "session") for data in (b"", b"[]", b"\xff", b"[" * 100_000)),
        ({"format": "other"}, "not a session"),
        ({"version": 2}, "version 2"),
        ({"page": [0, 0, 0, 5]}, "page"),
        ({"size": 10_000}, "size"),
        ({"size": float("nan")}, "size"),
        ({"size": True}, "size"),
        ({"strokes": [{"points": [1, 2, 3], "mark": "line"}]}, "strokes, entry 1"),
        ({"strokes": [{"points": [1, "x"], "mark": "line"}]}, "strokes, entry 1"),
        ({"strokes": [{"points": [1, 1e300], "mark": "line"}]}, "strokes, entry 1"),
        ({"strokes": [{"points": [1, 2], "mark": "dashed"}]}, "mark"),
        ({"strokes": [7]}, r"strokes\[0\]"),
        ({"hints": [{"x": 1, "y": 1, "slant": 95, "tilt": 0}]}, "slant"),
        ({"concave": [[1]]}, "concave"),
        ({"stroke_weight": float("nan")}, "not finite"),
        ({"picture": 7}, "picture"),
        ({"file": {"name": "a.curves"}}, "file"),
        ({"source": {"name": "a.svg", "data": "?", "digest": ""}}, "source of the session"),
        ({"mask": [{"kind": "fill", "points": [1, 1]}]}, "kind"),
    ],
)
def test_a_faulty_document_is_refused_with_its_place(parts, place):
    with pytest.raises(cf.InputError, match=place):
        Document.from_bytes(parts if isinstance(parts, bytes) else changed(**parts))


ROUND = [value for t in np.linspace(0, 2 * np.pi, 50) for value in (60 + 45 * np.cos(t), 50 + 45 * np.sin(t))]
OUTLINE = {"points": ROUND, "mark": "cut"}
HALF = {"points": ROUND[:50], "mark": "cut"}


def line(*points):
    return {"points": points, "mark": "line"}


@for_each(
    "strokes, step",
    [
        ([], "outline"),
        ([HALF, line(40, 30, 80, 30)], "outline"),
        ([OUTLINE, OUTLINE | {"mark": "ignored"}], "line"),
        ([OUTLINE, line(20, 40, 60, 65, 100, 40)], "across"),  # one stroke is one line, however it bends
        ([OUTLINE, *(line(20, y, 60, y + 15, 100, y) for y in (30, 45, 60))], "across"),
        ([OUTLINE, line(20, 50, 100, 50), line(20, 50.5, 60, 49, 100, 51)], "across"),  # drawn twice
        ([OUTLINE, line(20, 50, 100, 50), line(60, 10, 60, 90)], ""),
        ([OUTLINE, line(20, 50, 100, 50), line(60, 52, 60, 90)], ""),  # about a pixel is missing
        ([line(20, 50, 100, 50), line(60, 10, 60, 90)], ""),
    ],
)
def test_the_next_step_of_a_drawing(strokes, step):
    assert find_next_step(document(strokes=strokes)) == step


def test_the_next_step_of_many_lines_of_one_family_compares_few_of_them():
    lines = [line(15, 30 + k / 50, 60, 31 + k / 50, 105, 30 + k / 50) for k in range(2000)]
    many = document(strokes=[OUTLINE, *lines])
    tracemalloc.start()
    assert find_next_step(many) == "across"
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 150e6  # bytes; all pairs of points would take 2 GB


def test_strokes_beyond_the_page_enlarge_it():
    beyond = document(strokes=[*PEBBLE["strokes"], line(100, 50, 150, 130)])
    assert beyond.sheet == (0, 0, 150, 130)
    assert read_drawn(beyond).instance.reading.warnings == ()


def test_pressure_scales_reliability_and_is_seen_in_the_download_which_is_read_as_without(tmp_path):
    weights = (1, 0.05, 0.5)
    strokes = [stroke | {"weight": weight} for stroke, weight in zip(PEBBLE["strokes"], weights, strict=True)]
    name, svg = download(changed(strokes=strokes), "drawing")
    widths = [float(width) for width in re.findall(rb'stroke-width="([^"]*)"', svg)]
    assert widths == pytest.approx([0.3, 0.3 * 0.335, 0.3 * 0.65], rel=1e-3)
    (tmp_path / name).write_bytes(svg)
    plain = read_drawn(document()).instance
    assert cf.read_sketch(tmp_path / name, size=16).sha256 == plain.sha256
    light = read_drawn(document(strokes=[stroke | {"weight": 0.5} for stroke in PEBBLE["strokes"]])).instance
    assert np.allclose(light.w, plain.w / 2)


def test_a_brush_changes_the_mask_where_it_passed():
    path = {"points": [25, 25, 35, 25], "radius": 8}
    before = read_drawn(document()).instance.mask
    without = read_drawn(document(mask=[{"kind": "erase", **path}])).instance.mask
    again = read_drawn(document(mask=[{"kind": "erase", **path}, {"kind": "paint", **path}])).instance.mask
    assert 0 < (before & ~without).sum() < before.sum() / 3
    assert not (without & ~before).any()
    assert (again == before).all()


def test_a_brush_never_covers_a_stroke_that_cuts():
    over = read_drawn(document(mask=[{"kind": "paint", "points": [0, 10, 120, 10], "radius": 6}]))
    assert (over.kinds == STROKE).any()
    assert not (over.instance.mask & (over.kinds == STROKE)).any()


def test_a_click_excludes_an_area_between_strokes_and_includes_it_again():
    before = read_drawn(document())
    without = read_drawn(document(mask=click(30, 25)))
    gone = before.instance.mask & ~without.instance.mask
    assert 0.1 < gone.sum() / before.instance.mask.sum() < 0.4
    assert (without.kinds[gone] == LEFT_OUT).mean() > 0.9  # the rest is a stroke's corner
    assert (before.kinds[gone] == IN).all()
    assert read_drawn(document(mask=click(30, 25) * 2)).instance.sha256 == before.instance.sha256


def test_an_enclosed_area_that_was_left_out_is_included_by_a_click():
    ring = open_drawing(sample_svg("ring").encode(), "ring.svg")
    parts = {"size": 32, "page": ring["page"], "strokes": ring["strokes"]}
    drawn = read_drawn(document(**parts))
    places = np.argwhere(drawn.kinds == LEFT_OUT)
    row, column = places[len(places) // 2]
    (x, y), pixel = drawn.instance.origin, drawn.instance.pixel_size
    mask = click(x + pixel * (column + 0.5), y + pixel * (row + 0.5))
    assert read_drawn(document(**parts, mask=mask)).instance.mask.sum() > drawn.instance.mask.sum()


def test_hints_are_placed_on_pixels_and_those_outside_are_left_out():
    hints = [{"x": 30, "y": 25, "slant": 40, "tilt": 90}, {"x": -9, "y": 500, "slant": 40, "tilt": 90}]
    session = document(hints=hints)
    instance = read_drawn(session).instance
    (hint,) = hints_on_mask(session, instance)
    column, row = ((np.array([30, 25]) - instance.origin) / instance.pixel_size).astype(int)
    assert (hint.column, hint.row) == (column, row)


def test_a_bowl_is_the_surface_inside_out_and_beyond_the_mask_it_has_no_effect():
    sessions = [document(concave=[place]) for place in ([60, 50], [-9, 500])]
    bowl, dome = (compute_surface(each, compute_field(each)[1]).heights for each in sessions)
    np.testing.assert_allclose(bowl, -dome, atol=1e-9)
    assert np.nanmax(np.abs(bowl)) > 0.1


def doubts(strokes):
    """Suspects, and whether another depth is offered."""
    _, drawn, field = field_step(changed(strokes=strokes))
    seen = surface_step(drawn, field)
    return seen["suspects"], any(choice["kind"] == "depth" for choice in seen["freedom"])


def strokes_of(outline, *lines):
    """An outline and curvature lines (k, 2), in units of 45 about the middle of the page."""
    outline, *lines = (line(*(part * 45 + [60, 50]).ravel().tolist()) for part in (outline, *lines))
    return outline | {"mark": "cut"}, lines


def ellipsoid_lines():
    """Curvature lines of an ellipsoid from the front: it meets its confocal quadrics there (Dupin)."""
    a, b, c = 1.0, 0.6, 0.2  # squares of the half axes

    def quarter(m, n, right, down, step):
        x = np.sqrt(a * (a - m) * (a - n) / ((a - b) * (a - c)))
        y = np.sqrt(b * (b - m) * (n - b) / ((a - b) * (b - c)))
        return np.stack([right * x, down * y], axis=1)[::step]

    def ring(m):
        n = np.linspace(b, a, 20)
        sides = [(1, 1, 1), (-1, 1, -1), (-1, -1, 1), (1, -1, -1)]
        return np.concatenate([quarter(m, n, *side) for side in sides])

    def across(n, right):
        m = np.linspace(c, b, 20)
        return np.concatenate([quarter(m, n, right, 1, 1), quarter(m, n, right, -1, -1)])

    lines = [ring(0.3), across(0.66, 1), across(0.66, -1), ring(0.42), across(0.85, 1), across(0.85, -1)]
    return strokes_of(ring(c), *lines)


def wave_lines():
    """Curvature lines of a wave seen aslant: profiles, and rulings, which are straight."""
    s, t = np.meshgrid(np.linspace(-1, 1, 41), np.linspace(-1, 1, 61))
    place = np.stack([0.8 * t + 0.3 * s, 0.6 * s + 0.15 * np.sin(5 * t)], axis=2)
    border = [place[:, 0], place[-1], place[::-1, -1], place[0, ::-1]]
    return strokes_of(np.concatenate(border), place[:, 12], place[20], place[40], place[:, 28])


@pytest.mark.slow
@for_each("drawn_lines", [ellipsoid_lines, wave_lines])
def test_nothing_is_asked_that_the_next_line_would_answer(drawn_lines):
    outline, lines = drawn_lines()
    for count in range(1, len(lines) + 1):
        suspects, is_depth_open = doubts([outline, *lines[:count]])
        assert suspects == []
        assert not is_depth_open or count > 2
    assert doubts([outline, *lines, line(20, 75, 105, 25)])[0] == [1 + len(lines)]


def test_a_stroke_that_crosses_lines_of_both_families_is_suspected():
    assert [doubts(strokes)[0] for strokes in (CROSSED, CROSSED[:7])] == [[7], []]


@for_each("begin", [0, -1])  # at the pole, and beyond it
def test_lines_that_meet_at_a_pole_are_not_suspected(begin):
    circle = np.exp(1j * np.linspace(0, 2 * np.pi, 49)).view(float).reshape(-1, 2)
    arms = [np.outer([begin, 1], circle[at]) for at in range(0, 24, 4)]
    outline, lines = strokes_of(circle, *arms, circle / 3, circle * 2 / 3)
    assert doubts([outline, *lines])[0] == []


def test_solver_files_come_with_their_manifest_or_a_reason():
    name, content = download(changed(size=8), "solver", "milp-mccormick", "mps")
    assert name == "pebble.solver.zip"
    names = zipfile.ZipFile(io.BytesIO(content)).namelist()
    assert {file.split(".", 1)[1] for file in names} >= {
        "instance.json", "milp-mccormick.manifest.json", "milp-mccormick.mps",
    }  # fmt: skip
    for formulation, words in (("minlp-parity", "quartic"), ("nothing", "formulation")):
        with pytest.raises(cf.CrossfieldError, match=words):
            download(changed(size=8), "solver", formulation, "mps")


def test_a_picture_is_traced_to_strokes_with_marks():
    image = Image.new("RGB", (200, 160), "white")
    ImageDraw.Draw(image).line([20, 80, 180, 80], fill=(220, 0, 0), width=3)
    ImageDraw.Draw(image).ellipse([120, 10, 170, 60], outline="black", width=3)
    session = open_drawing(png(image), "../../etc/photo.png")
    assert (session["name"], session["page"]) == ("etc_photo", [0, 0, 200, 160])
    assert Image.open(io.BytesIO(b64decode(session["picture"]))).size == (200, 160)
    (line,) = [np.reshape(s["points"], (-1, 2)) for s in session["strokes"] if s["mark"] == "line"]
    (cut,) = [np.reshape(s["points"], (-1, 2)) for s in session["strokes"] if s["mark"] == "cut"]
    assert np.abs(line[:, 1] - 80.5).max() < 2
    assert np.ptp(line[:, 0]) > 150
    assert np.abs(np.hypot(*(cut - [145.5, 35.5]).T) - 24).max() < 3


GRID = [line for at in (60, 100, 140) for line in ((20, at, 180, at + 10), (at, 20, at, 180))]
GAPS = [(20, 20, 180, 20, 180, 180, 20, 180, 20, 20), (50, 100, 95, 100), (108, 100, 150, 100)]
ARC = 20 * np.exp(1j * np.linspace(0, np.pi, 41)).imag
ARCS = [np.stack([np.linspace(20, 180, 41), ARC + y], axis=1).ravel().tolist() for y in (60, 100)]
ASLANT = [*ARCS, (20, 120, 180, 40), (20, 160, 180, 80)]  # links are left where they cross


@for_each("lines, is_long", [(GRID, 6 * [1]), (GAPS, [0, 0, 1, 1, 1, 1]), (ASLANT, [0, 0, 0, 1, 1, 1, 1])])
def test_lines_of_a_picture_continue_across_junctions_and_end_at_corners_and_gaps(lines, is_long):
    image = Image.new("RGB", (200, 200), "white")
    for places in lines:
        ImageDraw.Draw(image).line(places, fill="black", width=4)
    strokes = [np.reshape(s["points"], (-1, 2)) for s in open_drawing(png(image), "a.png")["strokes"]]
    assert sorted(np.ptp(points, axis=0).max() > 150 for points in strokes) == is_long


def test_a_red_speck_of_a_picture_makes_no_black_line_a_cut():
    image = Image.new("RGB", (200, 160), "white")
    ImageDraw.Draw(image).line([20, 80, 180, 80], fill="black", width=3)
    ImageDraw.Draw(image).ellipse([60, 40, 72, 44], fill=(220, 0, 0))
    assert {stroke["mark"] for stroke in open_drawing(png(image), "a.png")["strokes"]} == {"line"}


def test_hatching_comes_ignored_unless_nothing_else_is_a_curvature_line():
    hatch = "".join(f'<path d="M{20 + 2 * k} 30l9 20"/>' for k in range(12))
    body, flow = '<circle cx="50" cy="50" r="45"/>', '<path d="M10 50Q50 30 90 50"/>'
    drawing = f'<svg fill="none"><g stroke="black">{body}{hatch}</g><g stroke="red">{flow}</g></svg>'
    session = open_drawing(drawing.encode(), "body.svg")
    assert [stroke["mark"] for stroke in session["strokes"]] == ["cut", *12 * ["ignored"], "line"]
    assert session["notes"][0].startswith("12 parallel lines round (35.5, 40) are left out as hatching")
    session = open_drawing(f'<svg fill="none" stroke="black">{hatch}</svg>'.encode(), "hatch.svg")
    assert {stroke["mark"] for stroke in session["strokes"]} == {"line"}


@for_each(
    "name, draw",
    [
        ("bottle.svg", lambda: sample_svg("bottle").encode()),
        ("bottle.jpg", lambda: encode(photograph(draw_sheet("bottle"), "wood", turn=20, pitch=20))),
    ],
)
def test_page_and_command_line_read_the_same_instance(name, draw, tmp_path):
    data = draw()
    (tmp_path / name).write_bytes(data)
    instance = cf.read_sketch(tmp_path / name, size=40)
    opened = open_drawing(data, name)
    parts = {key: opened[key] for key in ("name", "page", "strokes", "source")} | {"size": 40}
    drawn = read_drawn(document(**parts)).instance
    assert drawn.sha256 == instance.sha256
    assert drawn.reading == instance.reading
    parts["strokes"] = [*parts["strokes"], {"points": [1, 1, 1, 1], "mark": "ignored", "weight": 1}]
    redrawn = read_drawn(document(**parts)).instance
    assert redrawn.source == "bottle.svg"
    assert_same_drawing(redrawn, instance)
    assert opened["notes"] == [note for note in instance.reading.warnings if "sheet" in note]
