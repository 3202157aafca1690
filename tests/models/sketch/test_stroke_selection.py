"""Curvature lines of a drawing: strokes chosen by label, and silhouettes that are excluded."""

from functools import cache

import crossfield as cf
import numpy as np
import pytest
from angles import line_difference
from command_line import invoke
from loops import for_each
from PIL import Image, ImageDraw
from small_drawings import BLACK, png, read, svg

LINES = '<path d="M20 50H80"/><path d="M50 20V80"/>'
RIM = f'<circle id="Flow" class="flow-late Flowing" cx="50" cy="50" r="40" {BLACK}/>'
"""An outline with almost the labels of the strokes that are chosen below."""
CIRCLE = f'<g {BLACK}><circle cx="50" cy="50" r="40"/>{LINES}</g>'


def lines(attributes, colour="#0044cc"):
    return svg(f'{RIM}<g fill="none" stroke="{colour}" {attributes}><g>{LINES}</g></g>')


def radius(instance, side=100):
    """The distance of the stroke pixels from the middle of a page, in hundredths of its side."""
    at = (instance.stroke_pixels[:, ::-1] + 0.5) * instance.pixel_size + instance.origin
    return np.hypot(*(at * 100 / side - 50).T)


# --- labels -------------------------------------------------------------------------------------------------


@for_each(
    "selector, attributes",
    [
        ("colour=#0044cc", ""),
        ("color=rgb(0,68,204)", ""),
        ("class=Flow", 'class="late flow"'),
        ("id=LAYER2", 'id="layer2"'),
        ("id=flow lines", 'id="Flow_lines"'),
        ("layer=flow LINES", 'inkscape:groupmode="layer" inkscape:label=" Flow lines " id="layer2"'),
        ("layer=flow", 'id="Flow1" xmlns:serif="http://www.serif.com/" serif:id="Flow"'),  # Affinity
        ("layer=Flow & lines", 'id="Flow_x0020__x26__x0020_lines_1_"'),  # Illustrator, Save As
        ("layer=Flow lines", 'id="Flow_lines-2" data-name="Flow lines"'),  # Illustrator, Export As
        ("layer=Curves / red", 'id="Curves / red"'),  # Figma
    ],
)
def test_chosen_strokes_make_the_instance_that_red_ones_make(selector, attributes):
    chosen = read(lines(attributes), curvature=[selector])
    assert chosen.sha256 == red_strokes().sha256


@cache
def red_strokes():
    red = read(lines("", "red"))
    assert red.sha256 != read(lines("")).sha256
    return red


def test_several_labels_add_up_and_groups_pass_theirs_on_to_what_is_used():
    body = (
        f'{RIM}<defs><g id="cross" class="never">{LINES}</g></defs><g class="outer"><g class="inner">'
        '<use href="#cross" fill="none" stroke="#0044cc"/></g></g>'
    )
    red = red_strokes().sha256
    for chosen in (["class=outer"], ["class=inner", "class=outer"], ["id=cross"], ["class=never"]):
        assert read(svg(body), curvature=chosen).sha256 == red
    everything = read(svg(body), curvature=["colour=black", "class=inner"])
    assert everything.sha256 == read(svg(body)).sha256


def test_red_strokes_that_are_not_chosen_cut_the_field():
    body = f'<path d="M10 10H90V90H10Z" {BLACK}/><path d="M50 10V90" fill="none" stroke="red"/>'
    across = '<path class="flow" fill="none" stroke="blue" d="M20 50H80"/>'
    assert read(svg(body + across), curvature=["class=flow"]).grid.parts == 2


@for_each(
    "selector, message",
    [
        ("class=none", "has no stroke of class=none; it has colour=#000000, colour=#0044cc, class=flow"),
        ("colour=red", "has no stroke of colour=#ff0000; it has colour=#000000"),
        ("cluster=3", "has no stroke of cluster=3; it has"),
        ("#ff0000", "'#ff0000' chooses no strokes; write colour=red, class=flow, id=group2"),
        ("class=", "'class=' chooses no strokes"),
        ("colour=redish", "'redish' is not a colour; write a name or #rrggbb"),
        ("id=empty", "draws nothing of id=empty"),
        ("layer=alone", "has no stroke of layer=alone; it has .*id=alone"),  # a path is no layer
    ],
)
def test_labels_that_nothing_has_are_refused_with_those_that_there_are(selector, message):
    more = b'<g id="empty"/><path id="alone" d="M0 0h9" stroke="black"/></svg>'
    drawing = lines('class="flow" id="g2"').replace(b"</svg>", more)
    with pytest.raises(cf.InputError, match=message):
        read(drawing, curvature=[selector])


def test_an_error_lists_few_labels_and_all_of_them_in_short():
    paths = (f'<path class="c{n} {"x" * 999}" id="i{n}&#10;" d="M0 {n}h9"/>' for n in range(50))
    with pytest.raises(cf.InputError, match="it has colour=#000000, class=c0") as caught:
        read(svg(f"<g {BLACK}>{''.join(paths)}</g>"), curvature=["class=none"])
    assert len(str(caught.value)) < 400
    assert "\n" not in str(caught.value)


SCAP = b"""#100 100
{\n#0 0\n10 10 0\n90 10 0\n90 90 0\n10 90 0\n10 10 0\n}
{\n#1 3\n20 30 0\n80 30 0\n}
{\n#2 4\n20 40 0\n80 40 0\n}
{\n#3 4\n20 50 0\n80 50 0\n}
"""
"""A box, cluster 0, and level strokes in it."""


def test_clusters_of_scap_are_chosen():
    whole, both, one = (
        read(SCAP, 40, "a.scap", curvature=chosen)
        for chosen in ([], ["cluster=3", "cluster=4"], ["cluster=4"])
    )
    assert radius(whole).max() > 50 > 37 > radius(both).max()
    assert len(one.theta) < len(both.theta)
    for missing in ("cluster=5", "class=flow"):
        with pytest.raises(cf.InputError, match=f"no stroke of {missing}; it has cluster=0, cluster=3"):
            read(SCAP, source="a.scap", curvature=[missing])


# --- silhouettes --------------------------------------------------------------------------------------------


def picture(width=4):
    image = Image.new("L", (400, 400), "white")
    draw = ImageDraw.Draw(image)
    draw.ellipse([40, 40, 360, 360], outline=0, width=width)
    for ends in ((80, 200, 320, 200), (200, 80, 200, 320)):
        draw.line(ends, fill=0, width=width)
    return png(image)


@for_each(
    "data, source, side, size",
    [(svg(CIRCLE), "a.svg", 100, 16), (picture(), "a.png", 400, 40), (picture(12), "a.png", 400, 16)],
)
def test_the_rim_of_a_drawing_in_one_colour_carries_no_direction(data, source, side, size):
    whole, inner = read(data, size, source), read(data, size, source, silhouette="outer")
    assert np.array_equal(whole.mask, inner.mask)
    # Left are the two lines, which end 30 from the middle.
    pixel = inner.pixel_size * 100 / side
    assert radius(whole, side).max() > 40 - pixel
    assert 30 - 2 * pixel < radius(inner, side).max() < 31 + pixel
    assert (np.abs(np.sin(2 * inner.theta)) < 0.1).mean() > 0.9
    inside = radius(whole, side) < 31
    assert np.isin(whole.stroke_index[inside], inner.stroke_index).all()


def test_lines_that_end_at_the_outline_are_kept_to_their_ends():
    across = CIRCLE.replace("M20 50H80", "M10 50H90").replace("M50 20V80", "M50 10V90")
    inner = read(svg(across), 60, silhouette="outer")
    assert radius(inner).max() > 36
    assert (np.abs(np.sin(2 * inner.theta)) < 0.3).all()


def test_corners_of_an_outline_are_of_the_outline():
    box = f'<path d="M10 20H90V80H10ZM30 35L70 65" {BLACK}/>'
    inner = read(svg(box), 48, silhouette="outer")
    assert np.degrees(line_difference(inner.theta, np.arctan2(-30, 40))).max() < 1


def test_an_open_drawing_has_no_silhouette():
    strokes = svg(f'<path d="M10 10H90M10 50H90M10 90H90" {BLACK}/>')
    assert read(strokes, silhouette="outer").sha256 == read(strokes).sha256


def test_a_part_that_has_nothing_but_its_outline_is_left_out():
    two = f'{CIRCLE}<g {BLACK}><circle cx="120" cy="50" r="20"/><path d="M119 50h2"/></g>'
    drawing = svg(two, 'viewBox="0 0 150 100"')
    whole, inner = read(drawing, 60), read(drawing, 60, silhouette="outer")
    assert (whole.grid.parts, inner.grid.parts) == (2, 1)
    assert radius(inner).max() < 32
    with pytest.raises(cf.InputError, match="every stroke runs along the outline; choose"):
        read(svg(RIM), silhouette="outer")


def test_the_border_of_a_given_mask_is_the_outline(tmp_path):
    white = Image.new("L", (100, 100))
    ImageDraw.Draw(white).rectangle((10, 29, 70, 90), fill=255)
    ImageDraw.Draw(white).rectangle((71, 40, 90, 90), fill=255)
    white.save(tmp_path / "mask.png")
    drawing = svg(f'<path d="M10 30H90M10 50H90M10 70H90" {BLACK}/>')
    whole, inner = (
        read(drawing, 40, mask=tmp_path / "mask.png", silhouette=kind) for kind in ("none", "outer")
    )
    assert len(np.unique(whole.stroke_pixels[:, 0])) > len(np.unique(inner.stroke_pixels[:, 0]))
    assert np.array_equal(whole.mask, inner.mask)


# --- commands -----------------------------------------------------------------------------------------------


@for_each(
    "source, data, options, message",
    [
        ("a.png", picture(), {"curvature": ["colour=red"]}, "is a picture, whose strokes have no labels"),
        ("a.png", picture(), {"view": "top"}, r"is flat: only a \.curves file can be seen from "),
        ("a.svg", svg(CIRCLE), {"view": "top"}, r"is flat: only a \.curves file can be seen from "),
    ],
)
def test_pictures_have_no_labels_and_flat_drawings_no_views(source, data, options, message):
    with pytest.raises(cf.InputError, match=message):
        read(data, source=source, **options)


def test_commands_read_what_python_reads(tmp_path, capsys):
    file, instance = str(tmp_path / "a.svg"), str(tmp_path / "a.json")
    (tmp_path / "a.svg").write_bytes(lines('class="flow"'))
    options = ["--curvature", "class=flow", "--silhouette", "outer"]
    assert invoke(["instance", file, *options, "--curvature", "id=a", "-o", instance]) == 1
    assert "has no stroke of id=a; it has colour=#000000" in capsys.readouterr().err
    assert invoke(["instance", file, *options, "--size", "20", "-o", instance]) == 0
    expected = cf.read_sketch(file, size=20, curvature=["class=flow"], silhouette="outer")
    assert cf.read_instance(instance).sha256 == expected.sha256
    for wrong in (options, ["--view", "top"]):
        for source, reason in ((instance, "is no drawing; leave --"), ("ring", "is a sample; leave --")):
            assert invoke(["instance", source, *wrong, "-o", str(tmp_path / "b.json")]) == 1
            assert reason in capsys.readouterr().err
    assert not (tmp_path / "b.json").exists()
