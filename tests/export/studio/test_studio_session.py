"""Documents of the page: their checks, and their instances, fields, surfaces and files."""

from __future__ import annotations

import io
import re
import shlex
import zipfile
from base64 import b64decode, b64encode

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.cli.app import invoke
from crossfield.export.studio.document import Document
from crossfield.export.studio.files import download
from crossfield.export.studio.next_step import find_next_step
from crossfield.export.studio.opening import open_drawing
from crossfield.export.studio.session import IN, LEFT_OUT, STROKE, hints_on_mask, read_drawn
from crossfield.export.studio.views import field_step
from crossfield.models.sketch.samples import sample_svg
from photographs import assert_same_drawing, draw_sheet, encode, photograph
from PIL import Image, ImageDraw
from studios import CONTRADICTING, PEBBLE, changed


def document(**parts):
    return Document.from_bytes(changed(**parts))


def click(x, y, kind="toggle"):
    return [{"kind": kind, "points": [x, y], "radius": 0}]


def jpeg(width):
    stream = io.BytesIO()
    Image.new("L", (width, 1)).save(stream, "JPEG")
    return b64encode(stream.getvalue()).decode()


@pytest.mark.parametrize(
    "parts, place",
    [
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
        ({"strokes": [7]}, "entry of strokes"),
        ({"strokes": {}}, "strokes"),
        ({"hints": [{"x": 1, "y": 1, "slant": 95, "tilt": 0}]}, "slant"),
        ({"picture": 7}, "picture of the session"),
        ({"picture": "<svg/>"}, "picture of the session"),
        ({"picture": b64encode(b"GIF89a").decode()}, "not a JPEG"),
        ({"picture": jpeg(1601)}, "1601 x 1 pixels"),
        ({"file": {"name": "a.curves"}}, "file of the session"),
        ({"file": {"name": "a.curves", "data": "?"}}, "file of the session"),
        ({"mask": [{"kind": "fill", "points": [1, 1]}]}, "kind"),
    ],
)
def test_a_faulty_document_is_refused_with_its_place(parts, place):
    with pytest.raises(cf.InputError, match=place):
        document(**parts)


@pytest.mark.parametrize("data", [b"", b"[]", b"\xff", b"[" * 100_000, b'{"format": "crossfield-studio"}'])
def test_other_bytes_are_refused(data):
    with pytest.raises(cf.InputError, match="session"):
        Document.from_bytes(data)


def test_a_drawing_without_a_curvature_line_asks_for_one():
    cuts = [stroke | {"mark": "cut"} for stroke in PEBBLE["strokes"]]
    with pytest.raises(cf.NoStrokeError, match="draw one"):
        read_drawn(document(strokes=cuts))


ROUND = [value for t in np.linspace(0, 2 * np.pi, 50) for value in (60 + 45 * np.cos(t), 50 + 45 * np.sin(t))]
OUTLINE = {"points": ROUND, "mark": "cut"}
HALF = {"points": ROUND[:50], "mark": "cut"}


def line(*points):
    return {"points": points, "mark": "line"}


@pytest.mark.parametrize(
    "strokes, step",
    [
        ([], "outline"),
        ([HALF], "outline"),
        ([HALF, line(40, 30, 80, 30)], "outline"),
        ([OUTLINE], "line"),
        ([OUTLINE, OUTLINE | {"mark": "ignored"}], "line"),
        ([OUTLINE, line(20, 50, 100, 50)], "across"),
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


def test_strokes_beyond_the_page_enlarge_it(tmp_path):
    beyond = document(strokes=[*PEBBLE["strokes"], line(100, 50, 150, 130)])
    assert beyond.sheet == (0, 0, 150, 130)
    assert read_drawn(beyond).instance.reading.warnings == ()


def test_the_instance_is_that_of_the_downloaded_drawing(tmp_path):
    name, svg = download(changed(), "drawing")
    (tmp_path / name).write_bytes(svg)
    assert cf.read_sketch(tmp_path / name, size=16).sha256 == read_drawn(document()).instance.sha256


def test_the_weight_of_a_stroke_scales_its_reliability():
    light = [stroke | {"weight": 0.5} for stroke in PEBBLE["strokes"]]
    before, after = read_drawn(document()).instance, read_drawn(document(strokes=light)).instance
    assert np.allclose(after.w, before.w / 2)


def test_the_downloaded_drawing_shows_pressure_and_is_read_the_same(tmp_path):
    strokes = [
        stroke | {"weight": weight} for stroke, weight in zip(PEBBLE["strokes"], (1, 0.05, 0.5), strict=True)
    ]
    name, svg = download(changed(strokes=strokes), "drawing")
    widths = [float(width) for width in re.findall(rb'stroke-width="([^"]*)"', svg)]
    assert widths == pytest.approx([0.3, 0.3 * 0.335, 0.3 * 0.65], rel=1e-3)
    (tmp_path / name).write_bytes(svg)
    assert cf.read_sketch(tmp_path / name, size=16).sha256 == read_drawn(document()).instance.sha256


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
    ring = Document.from_json(
        PEBBLE
        | {
            key: value
            for key, value in open_drawing(sample_svg("ring").encode(), "ring.svg").items()
            if key in PEBBLE
        }
        | {"size": 32}
    )
    drawn = read_drawn(ring)
    rows, columns = np.nonzero(drawn.kinds == LEFT_OUT)
    assert len(rows)
    x, y = drawn.instance.origin
    pixel = drawn.instance.pixel_size
    middle = len(rows) // 2
    point = [x + pixel * (columns[middle] + 0.5), y + pixel * (rows[middle] + 0.5)]
    edits = Document.from_json(PEBBLE | {
        "size": 32, "page": list(ring.page), "mask": click(*point),
        "strokes": [{"points": s.points.ravel().tolist(), "mark": s.mark} for s in ring.strokes],
    })  # fmt: skip
    assert read_drawn(edits).instance.mask.sum() > drawn.instance.mask.sum()


def test_hints_are_placed_on_pixels_and_those_outside_are_left_out():
    hints = [{"x": 30, "y": 25, "slant": 40, "tilt": 90}, {"x": -9, "y": 500, "slant": 40, "tilt": 90}]
    session = document(hints=hints)
    instance = read_drawn(session).instance
    (hint,) = hints_on_mask(session, instance)
    x, y = instance.origin
    assert (hint.column, hint.row) == (
        int((30 - x) / instance.pixel_size),
        int((25 - y) / instance.pixel_size),
    )


def test_strokes_that_the_field_does_not_follow_are_suspects():
    assert field_step(changed(strokes=CONTRADICTING, size=32))[0]["suspects"] == [8, 9]
    assert field_step(changed(strokes=CONTRADICTING[:8], size=32))[0]["suspects"] == []


def test_solver_files_come_with_their_manifest():
    name, content = download(changed(size=8), "solver", "milp-mccormick", "mps")
    assert name == "pebble.solver.zip"
    names = zipfile.ZipFile(io.BytesIO(content)).namelist()
    assert {file.split(".", 1)[1] for file in names} >= {
        "instance.json", "milp-mccormick.manifest.json", "milp-mccormick.mps",
    }  # fmt: skip


def test_a_refused_pair_of_formulation_and_format_gives_the_reason():
    with pytest.raises(cf.CrossfieldError, match="quartic"):
        download(changed(size=8), "solver", "minlp-parity", "mps")
    with pytest.raises(cf.CrossfieldError, match="formulation"):
        download(changed(size=8), "solver", "nothing", "mps")


@pytest.mark.slow
def test_the_commands_of_the_menu_compute_the_same(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    hints = [{"x": 30, "y": 25, "slant": 40, "tilt": -90}]
    data = changed(hints=hints, flip=True)
    for kind in ("drawing", "instance", "layers", "surface", "field"):
        name, content = download(data, kind)
        (tmp_path / (f"page.{kind}" if kind in {"layers", "field"} else name)).write_bytes(content)
    commands = field_step(data)[0]["commands"]
    for command in commands[:3]:
        assert invoke(shlex.split(command)[1:]) == 0, capsys.readouterr().err
    assert (tmp_path / "pebble.layers.svg").read_bytes() == (tmp_path / "page.layers").read_bytes()
    archive = zipfile.ZipFile(tmp_path / "pebble.surface.zip")
    for name in ("surface.obj", "heights.npy", "shaded.png"):
        assert archive.read(name) == (tmp_path / "surface" / name).read_bytes(), name


def picture():
    """A red line and a black circle on paper, as PNG."""
    image = Image.new("RGB", (200, 160), "white")
    pen = ImageDraw.Draw(image)
    pen.line([20, 80, 180, 80], fill=(220, 0, 0), width=3)
    pen.ellipse([120, 10, 170, 60], outline="black", width=3)
    stream = io.BytesIO()
    image.save(stream, "PNG")
    return stream.getvalue()


def test_a_picture_is_traced_to_strokes_with_marks():
    session = open_drawing(picture(), "photo.png")
    assert session["page"] == [0, 0, 200, 160]
    assert Image.open(io.BytesIO(b64decode(session["picture"]))).size == (200, 160)
    lines = [np.reshape(s["points"], (-1, 2)) for s in session["strokes"] if s["mark"] == "line"]
    cuts = [np.reshape(s["points"], (-1, 2)) for s in session["strokes"] if s["mark"] == "cut"]
    assert len(lines) == len(cuts) == 1
    assert np.abs(lines[0][:, 1] - 80.5).max() < 2
    assert np.ptp(lines[0][:, 0]) > 150
    assert np.abs(np.hypot(*(cuts[0] - [145.5, 35.5]).T) - 24).max() < 3


@pytest.mark.parametrize(
    "data, name, words",
    [
        (b"", "a.svg", "empty"),
        (b"<svg", "a.svg", "."),
        (b"\x89PNG\r\n\x1a\nxx", "a.png", "picture"),
        (b"v 1\n", "a.curves", "."),
    ],
)
def test_files_that_are_no_drawing_are_refused(data, name, words):
    with pytest.raises(cf.CrossfieldError, match=words):
        open_drawing(data, name)


def test_the_name_of_a_file_is_no_path():
    assert open_drawing(sample_svg("skew").encode(), "../../etc/passwd.svg")["name"] == "etc_passwd"


def test_hatching_comes_ignored_unless_nothing_else_is_a_curvature_line():
    hatch = "".join(f'<path d="M{20 + 2 * k} 30l9 20"/>' for k in range(12))
    body = '<circle cx="50" cy="50" r="45"/>'
    flow = '<path d="M10 50Q50 30 90 50"/>'
    drawing = f'<svg fill="none"><g stroke="black">{body}{hatch}</g><g stroke="red">{flow}</g></svg>'
    session = open_drawing(drawing.encode(), "body.svg")
    assert [stroke["mark"] for stroke in session["strokes"]] == ["cut", *12 * ["ignored"], "line"]
    assert session["notes"][0].startswith("12 parallel lines round (35.5, 40) look like hatching")
    session = open_drawing(f'<svg fill="none" stroke="black">{hatch}</svg>'.encode(), "hatch.svg")
    assert {stroke["mark"] for stroke in session["strokes"]} == {"line"}


@pytest.mark.parametrize("kind", ["svg", "png", "photo"])
def test_page_and_command_line_read_the_same_instance(kind, tmp_path):
    data, name = {
        "svg": lambda: (sample_svg("bottle").encode(), "bottle.svg"),
        "png": lambda: (encode(draw_sheet("bottle"), "PNG"), "bottle.png"),
        "photo": lambda: (encode(photograph(draw_sheet("bottle"), "wood", turn=20, pitch=20)), "bottle.jpg"),
    }[kind]()
    (tmp_path / name).write_bytes(data)
    instance = cf.read_sketch(tmp_path / name, size=40)
    opened = open_drawing(data, name)
    parts = {key: opened[key] for key in ("name", "page", "strokes", "source")} | {"mask": [], "hints": []}
    drawn = read_drawn(document(**parts, size=40)).instance
    assert drawn.sha256 == instance.sha256
    assert drawn.reading == instance.reading
    parts["strokes"] = [*parts["strokes"], {"points": [1, 1, 1, 1], "mark": "ignored", "weight": 1}]
    changed = read_drawn(document(**parts, size=40)).instance
    assert changed.source == "bottle.svg"
    assert_same_drawing(changed, instance)
    assert opened["notes"] == [note for note in instance.reading.warnings if "sheet" in note]


def test_red_specks_of_a_picture_are_no_curvature_lines():
    image = Image.open(io.BytesIO(picture())).convert("L").convert("RGB")
    ImageDraw.Draw(image).ellipse([60, 40, 66, 46], fill=(220, 0, 0))
    stream = io.BytesIO()
    image.save(stream, "PNG")
    assert {stroke["mark"] for stroke in open_drawing(stream.getvalue(), "a.png")["strokes"]} == {"line"}
