"""Fields over their drawings: SVG, bitmap, .scap and samples, with only the strokes of each."""

import base64
import io
import json
from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from command_line import invoke
from crossfield.export.pictures.underlay import INK, read_underlay
from defusedxml import ElementTree
from layered import SVG, layers_of, lines_in, numbers
from loops import for_each
from photographs import draw_sheet, encode, photograph
from PIL import Image, ImageDraw
from small_drawings import HOSTILE

BOXES = """<g fill="none" stroke="#000" stroke-width="2"><path d="M20 30H120V90H20Z"/>
<path d="M20 60H120" stroke="#e00000"/><path d="M70 30V90" stroke="#e00000"/></g>"""


def svg(path, body=BOXES):
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 150 110">{body}</svg>')
    return path


def field_of(path):
    return cf.power_field(cf.read_sketch(path, size=12))


def test_the_drawing_is_the_lowest_layer_on_its_own_page(tmp_path):
    drawing = svg(tmp_path / "a.svg")
    root, layers = layers_of(cf.draw(field_of(drawing), tmp_path / "over.svg", underlay=drawing))
    assert numbers(root.get("viewBox")).tolist() == [0, 0, 150, 110]
    assert next(iter(layers)) == "drawing"
    assert layers["strokes"].get("style") == "display:none"
    black, red = layers["drawing"]
    assert [black.get("stroke"), red.get("stroke")] == [INK["black"], INK["red"]]
    (box,), (level, upright) = lines_in(black), lines_in(red)
    assert box.tolist() == [[20, 30], [120, 30], [120, 90], [20, 90], [20, 30]]
    assert level.tolist() == [[20, 60], [120, 60]]
    assert upright.tolist() == [[70, 30], [70, 90]]
    for name in ("streamlines-u", "streamlines-v"):
        lines = np.concatenate(lines_in(layers[name]))
        assert (lines >= (19, 29)).all()
        assert (lines <= (121, 91)).all()


@for_each(
    "size, expected",
    [
        ('width="75mm" height="55mm"', ["75mm", "55mm"]),
        ('width="1&quot;&gt;" height="javascript:1"', ["150", "110"]),
    ],
)
def test_the_page_has_the_size_that_the_drawing_declares(tmp_path, size, expected):
    drawing = svg(tmp_path / "a.svg")
    (tmp_path / "b.svg").write_text(drawing.read_text().replace("viewBox", f"{size} viewBox"))
    root, _ = layers_of(cf.draw(field_of(drawing), tmp_path / "over.svg", underlay=tmp_path / "b.svg"))
    assert [root.get("width"), root.get("height")] == expected


def test_a_page_that_the_field_reaches_beyond_grows_in_the_unit_that_the_drawing_declares(tmp_path):
    drawing = svg(tmp_path / "a.svg")
    beyond = (
        drawing.read_text()
        .replace("0 0 150 110", "0 0 100 80")
        .replace("<svg", '<svg width="5in" height="5in"')
    )
    (tmp_path / "b.svg").write_text(beyond)
    root, _ = layers_of(cf.draw(field_of(drawing), tmp_path / "over.svg", underlay=tmp_path / "b.svg"))
    left, top, width, height = map(float, root.get("viewBox").split())
    assert (left, top, width) == (0, 0, 100)
    assert height == pytest.approx(90, abs=0.1)
    assert root.get("width") == "5in"
    assert float(root.get("height").removesuffix("in")) == pytest.approx(4.5, abs=0.01)


def test_nothing_of_a_hostile_drawing_but_its_strokes_comes_out(tmp_path):
    (tmp_path / "evil.svg").write_bytes(HOSTILE)
    field = field_of(tmp_path / "evil.svg")
    path = cf.draw(field, tmp_path / "over.svg", underlay=tmp_path / "evil.svg")
    text = path.read_text().lower()
    for word in ("evil", "script", "alert", "onload", "onclick", "image", "use", "iframe", "style>",
                 "url(", "href=", "<text", "animate", "entity", "doctype"):  # fmt: skip
        assert word not in text, word
    tags = {element.tag for element in ElementTree.fromstring(path.read_bytes()).iter()}
    assert tags <= {f"{SVG}{name}" for name in ("svg", "g", "path", "circle")}
    entity = '<!DOCTYPE svg [<!ENTITY x SYSTEM "file:///etc/passwd">]>' + svg(tmp_path / "b.svg").read_text()
    (tmp_path / "entity.svg").write_text(entity.replace("</svg>", "<text>&x;</text></svg>"))
    with pytest.raises(cf.InputError, match="entities"):
        cf.draw(field, tmp_path / "never.svg", underlay=tmp_path / "entity.svg")
    assert not (tmp_path / "never.svg").exists()


def test_a_bitmap_is_embedded_as_its_ink_alone(tmp_path):
    image = Image.new("RGB", (150, 110), "#f4efe4")
    for line in ((20, 30, 120, 30), (120, 30, 120, 90), (120, 90, 20, 90), (20, 90, 20, 30)):
        ImageDraw.Draw(image).line(line, fill="#222222", width=3)
    ImageDraw.Draw(image).line((20, 60, 120, 60), fill="#d00000", width=3)
    image.save(tmp_path / "a.jpg", comment=b"secret", quality=95)
    field = field_of(tmp_path / "a.jpg")
    root, layers = layers_of(cf.draw(field, tmp_path / "over.svg", underlay=tmp_path / "a.jpg"))
    assert numbers(root.get("viewBox")).tolist() == [0, 0, 150, 110]
    (element,) = layers["drawing"]
    assert (element.get("width"), element.get("height")) == ("150", "110")
    kind, data = element.get("{http://www.w3.org/1999/xlink}href").split(",")
    assert kind == "data:image/png;base64"
    embedded = Image.open(io.BytesIO(base64.b64decode(data)))
    pixels = np.asarray(embedded.convert("RGBA"))
    assert embedded.info.keys() <= {"transparency"}
    assert pixels[5, 5, 3] == 0
    assert pixels[60, 70].tolist() == [*bytes.fromhex(INK["red"][1:]), 255]
    assert pixels[30, 70].tolist() == [*bytes.fromhex(INK["black"][1:]), 255]
    picture = Image.open(cf.draw(field, tmp_path / "over.png", underlay=tmp_path / "a.jpg")).convert("L")
    dark = np.asarray(picture.resize((150, 110), Image.Resampling.BOX)) < 140
    assert dark[30, 25:115].mean() > 0.9
    assert not dark[:25].any()


def test_pen_strokes_may_lie_beyond_their_page(tmp_path):
    rows = ("{\n#0 0\n0 -20 1\n60 -20 1\n60 20 1\n}", "{\n#1 1\n60 20 1\n0 20 1\n0 -20 1\n}",
            "{\n#2 2\n0 0 1\n60 0 1\n}")  # fmt: skip
    path = tmp_path / "a.scap"
    path.write_text("#80 30\n@1\n" + "\n".join(rows) + "\n")
    field = field_of(path)
    assert read_underlay(path, on=field.instance).page == (0, -20, 80, 50)
    root, layers = layers_of(cf.draw(field, tmp_path / "over.svg", underlay=path))
    assert numbers(root.get("viewBox")).tolist() == [0, -20, 80, 50]
    assert lines_in(layers["drawing"])[0].tolist() == [[0, -20], [60, -20], [60, 20]]


def test_a_drawing_in_space_lies_below_its_field_as_the_field_saw_it(tmp_path):
    rows = ("0 0 0\n2 0 0\n2 1 0\n0 1 0\n0 0 0", "0 0.5 0\n2 0.5 0", "1 0 0\n1 1 0", "1 0.5 0\n1 0.5 1")
    path = tmp_path / "a.curves"
    path.write_text("".join(f"v {len(row.splitlines())}\n{row}\n" for row in rows))
    instance = cf.read_sketch(path, size=12, view="60, 25")
    assert (instance.source, instance.view) == ("a.curves", "60, 25")
    with pytest.raises(cf.InputError, match=r"lies elsewhere .* from the same side"):
        read_underlay(path, on=replace(instance, view=None))
    cf.write_instance(instance, tmp_path / "a.json")
    assert read_underlay(path, on=cf.read_instance(tmp_path / "a.json")).page == instance.reading.page
    with pytest.raises(cf.InputError, match=r"b.svg: is flat: only a .curves file can be seen from 60, 25"):
        read_underlay(svg(tmp_path / "b.svg"), on=instance)


def test_another_drawing_and_another_kind_are_refused(tmp_path):
    field = field_of(svg(tmp_path / "a.svg"))
    far = BOXES.replace("<g ", '<g transform="translate(900 900)" ')
    (tmp_path / "far.svg").write_text(svg(tmp_path / "b.svg", far).read_text().replace("0 0", "900 900"))
    other = '<path d="M20 30H120V90H20Z" stroke="#000"/><path d="M20 40H120" stroke="#e00000"/>'
    with pytest.raises(cf.InputError, match="lies elsewhere"):
        cf.draw(field, tmp_path / "over.svg", underlay=svg(tmp_path / "other.svg", other))
    with pytest.raises(cf.InputError, match="lies elsewhere") as caught:
        cf.draw(field, tmp_path / "over.svg", underlay=tmp_path / "far.svg")
    assert "give the drawing that its instance was read from" in str(caught.value)
    with pytest.raises(cf.InputError, match="use kind layers"):
        cf.draw(field, tmp_path / "over.png", kind="crosses", underlay=tmp_path / "a.svg")
    with pytest.raises(cf.InputError, match="lies elsewhere"):  # before anything is searched for
        cf.run(field.instance, tmp_path / "run", drawing=tmp_path / "far.svg")
    assert not (tmp_path / "run").exists()
    with pytest.raises(cf.InputError, match="computed, not drawn"):
        cf.draw(field, tmp_path / "over.png", underlay="wave_sheet")


def test_the_command_lays_a_field_over_a_sample(tmp_path, capsys):
    field = str(cf.write_field(cf.power_field(cf.sample("ring", 10)), tmp_path / "f.npz"))
    assert invoke(["draw", field, "--underlay", "ring", "-o", str(tmp_path / "over.svg")]) == 0
    assert "drawing" in layers_of(tmp_path / "over.svg")[1]
    assert invoke(["draw", field, "--underlay", "no.svg", "-o", str(tmp_path / "o.svg")]) == 1
    assert "no.svg: cannot be read" in capsys.readouterr().err


@pytest.mark.slow
def test_a_run_lays_its_best_field_over_the_drawing_and_reports_its_warnings(tmp_path):
    drawing = svg(tmp_path / "a.svg", BOXES + '<path d="M160 30V90" stroke="#000"/>')  # off the page
    arguments = ["run", str(drawing), "--size", "9", "--time-limit", "0.1", "-o", str(tmp_path / "run")]
    assert invoke(arguments) == 0
    root, layers = layers_of(tmp_path / "run" / "overlay.svg")
    assert numbers(root.get("viewBox")).tolist() == [0, 0, 150, 110]
    assert "drawing" in layers
    assert (tmp_path / "run" / "overlay.png").read_bytes().startswith(b"\x89PNG")
    report = json.loads((tmp_path / "run" / "report.json").read_text())
    assert report["interrupted"] is None
    assert report["warnings"] == list(cf.read_sketch(drawing, size=9).reading.warnings) != []


def test_the_sheet_of_a_photograph_lies_below_its_field(tmp_path):
    path = tmp_path / "photo.jpg"
    path.write_bytes(encode(photograph(draw_sheet("mouse"), "wood", turn=20, pitch=15)))
    instance = cf.read_sketch(path, size=40)
    underlay = read_underlay(path, on=instance)
    assert underlay.page == instance.reading.page
    assert underlay.ink.shape[:2] == (round(underlay.page[3]), round(underlay.page[2]))
