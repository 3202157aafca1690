"""Curvature lines of a drawing: strokes chosen by label, and silhouettes that are excluded."""

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.cli.app import invoke
from crossfield.models.errors import InputError
from crossfield.models.instance.angles import line_difference
from crossfield.models.sketch.labels import LabelMatcher, label_of, labels_of
from loops import for_each
from PIL import Image, ImageDraw
from small_drawings import png, read, svg

LAYER = 'inkscape:groupmode="layer" inkscape:label="Flow lines"'
LINES = '<path d="M20 50H80"/><path d="M50 20V80"/>'
RIM = '<circle cx="50" cy="50" r="40" fill="none" stroke="black"/>'
CIRCLE = f'<g fill="none" stroke="black"><circle cx="50" cy="50" r="40"/>{LINES}</g>'


def lines(attributes, colour="#0044cc"):
    return svg(f'{RIM}<g fill="none" stroke="{colour}" {attributes}><g>{LINES}</g></g>')


def radius(instance, side=100):
    """The distance of the stroke pixels from the middle of a page, in hundredths of its side."""
    at = (instance.stroke_pixels[:, ::-1] + 0.5) * instance.pixel_size + instance.origin
    return np.hypot(*(at * 100 / side - 50).T)


# --- labels -------------------------------------------------------------------------------------------------

CHOICES = {
    "colour=#0044cc": "",
    "color=rgb(0,68,204)": "",
    "class=flow": 'class="late flow"',
    "id=layer2": 'id="layer2"',
    "layer=Flow lines": LAYER,
    "layer=flow": 'id="Flow1" xmlns:serif="http://www.serif.com/" serif:id="Flow"',
    "layer=Flow & lines": 'id="Flow_x0020__x26__x0020_lines_1_"',
}


@for_each("selector", CHOICES)
def test_chosen_strokes_make_the_instance_that_red_ones_make(selector):
    red = read(lines("", "red"))
    chosen = read(lines(CHOICES[selector]), curvature=(selector,))
    assert chosen.sha256 == red.sha256
    assert read(lines(CHOICES[selector])).sha256 != red.sha256


def test_several_labels_add_up_and_groups_pass_theirs_on_to_what_is_used():
    body = (
        f'{RIM}<defs><g id="cross" class="never">{LINES}</g></defs><g class="outer"><g class="inner">'
        '<use href="#cross" fill="none" stroke="#0044cc"/></g></g>'
    )
    red = read(lines("", "red")).sha256
    for chosen in (["class=outer"], ["class=inner", "class=outer"], ["id=cross"], ["class=never"]):
        assert read(svg(body), curvature=tuple(chosen)).sha256 == red
    everything = read(svg(body), curvature=("colour=black", "class=inner"))
    assert everything.sha256 == read(svg(body)).sha256


def test_red_strokes_that_are_not_chosen_cut_the_field():
    body = (
        '<g fill="none"><path d="M10 10H90V90H10Z" stroke="black"/><path d="M50 10V90" stroke="red"/>{}</g>'
    )
    across = '<path class="flow" stroke="blue" d="M20 50H80"/>'
    assert read(svg(body.format(across)), curvature=("class=flow",)).grid.parts == 2


INKSCAPE = "{http://www.inkscape.org/namespaces/inkscape}"
NAMED = {
    "layer=flow LINES": {f"{INKSCAPE}groupmode": "layer", f"{INKSCAPE}label": " Flow lines ", "id": "layer2"},
    "layer=Flow & lines": {"id": "Flow_x0020__x26__x0020_lines_1_"},  # Illustrator, Save As
    "layer=Flow lines": {"id": "Flow_lines-2", "data-name": "Flow lines"},  # Illustrator, Export As
    "layer=Flow": {"id": "Flow1", "{http://www.serif.com/}id": "Flow"},  # Affinity
    "layer=Curves / red": {"id": "Curves / red"},  # Figma
    "class=Flow": {"class": "late flow"},
    "id=GROUP2": {"id": "group2"},
    "id=flow lines": {"id": "Flow_lines"},
}


@for_each("selector", NAMED)
def test_names_are_those_that_the_program_shows_whatever_their_case(selector):
    matcher = LabelMatcher(frozenset([label_of(selector)]))
    assert matcher.matches(labels_of("g", NAMED[selector]))
    assert not matcher.matches(labels_of("g", {"id": "Flowing", "class": "flow-late"}))
    matcher.check(any_stroke=True)
    as_path = list(labels_of("path", {"id": "Flow"}))
    assert as_path == ["id=Flow"]  # no layer


REFUSED = {
    "class=none": "has no stroke of class=none; it has colour=#000000, colour=#0044cc, class=flow, id=g2",
    "colour=red": "has no stroke of colour=#ff0000; it has colour=#000000",
    "cluster=3": "has no stroke of cluster=3; it has",
    "#ff0000": "'#ff0000' chooses no strokes; write colour=red, class=flow, id=group2",
    "red": "'red' chooses no strokes",
    "class=": "'class=' chooses no strokes",
    "colour=redish": "'redish' is not a colour; write a name or #rrggbb",
    "id=empty": "draws nothing of id=empty",
}


@for_each("selector", REFUSED)
def test_labels_that_nothing_has_are_refused_with_those_that_there_are(selector, tmp_path):
    path = tmp_path / "drawing.svg"
    path.write_bytes(lines('class="flow" id="g2"').replace(b"</svg>", b'<g id="empty"/></svg>'))
    with pytest.raises(InputError) as caught:
        cf.read_sketch(path, curvature=[selector])
    assert REFUSED[selector] in str(caught.value)


def test_an_error_lists_few_labels_and_all_of_them_in_short():
    many = "".join(f'<path class="c{n} {"x" * 999}" id="i{n}&#10;" d="M0 {n}h9"/>' for n in range(50))
    with pytest.raises(InputError) as caught:
        read(svg(many), curvature=("class=none",))
    assert len(str(caught.value)) < 400
    assert "\n" not in str(caught.value)


def test_a_label_of_an_outer_group_chooses_the_strokes_deep_inside():
    depth = 40
    groups = "".join(f'<g id="g{number}" class="a b c">' for number in range(depth))
    content = svg(f'{RIM}{groups}<g fill="none" stroke="blue">{LINES}</g>{"</g>" * depth}')
    assert read(content, curvature=("id=g7",)).sha256 == read(lines("", "red")).sha256


def scap(clusters):
    """A ring, cluster 0, and level strokes in it, each of a cluster."""
    angle = np.linspace(0, 2 * np.pi, 100)
    ring = np.stack([50 + 40 * np.cos(angle), 50 + 40 * np.sin(angle)], axis=1)
    level = [np.array([[20.0, 30 + 10 * row], [80.0, 30 + 10 * row]]) for row in range(len(clusters))]
    strokes = [
        f"{{\n#{number}\t{cluster}\n" + "".join(f"{x:.4f}\t{y:.4f}\t0\n" for x, y in samples) + "}\n"
        for number, (cluster, samples) in enumerate(zip(("0", *clusters), (ring, *level), strict=True))
    ]
    return ("#100\t100\n@1\n" + "".join(strokes)).encode()


def test_clusters_of_scap_are_chosen(tmp_path):
    file = tmp_path / "a.scap"
    file.write_bytes(scap(["3", "4", "4"]))
    whole = cf.read_sketch(file, size=40)
    chosen = cf.read_sketch(file, size=40, curvature=["cluster=3", "cluster=4"])
    assert radius(whole).max() > 36 > radius(chosen).max()
    one = cf.read_sketch(file, size=40, curvature=["cluster=4"])
    assert len(one.theta) < len(chosen.theta)
    with pytest.raises(InputError, match=r"no stroke of cluster=5; it has cluster=0, cluster=3, cluster=4"):
        cf.read_sketch(file, curvature=["cluster=5"])
    with pytest.raises(InputError, match="no stroke of class=flow; it has cluster=0"):
        cf.read_sketch(file, curvature=["class=flow"])


# --- silhouettes --------------------------------------------------------------------------------------------


def picture(side=400, width=4):
    image = Image.new("L", (side, side), "white")
    draw = ImageDraw.Draw(image)
    scale = side / 100
    draw.ellipse([10 * scale, 10 * scale, 90 * scale, 90 * scale], outline=0, width=width)
    for ends in ((20, 50, 80, 50), (50, 20, 50, 80)):
        draw.line([scale * end for end in ends], fill=0, width=width)
    return png(image)


@pytest.mark.parametrize(
    "size", [16, 40, *(pytest.param(size, marks=pytest.mark.slow) for size in (24, 100))]
)
def test_the_rim_of_a_drawing_in_one_colour_carries_no_direction(size):
    thick = picture(width=12)
    for data, source, side in ((svg(CIRCLE), "a.svg", 100), (picture(), "a.png", 400), (thick, "a.png", 400)):
        whole, inner = read(data, size, source), read(data, size, source, silhouette="outer")
        assert np.array_equal(whole.mask, inner.mask)
        # Left are the two lines, which end 30 from the middle.
        pixel = inner.pixel_size * 100 / side
        assert radius(whole, side).max() > 40 - pixel
        assert 30 - 2 * pixel < radius(inner, side).max() < 31 + pixel
        level = np.abs(np.sin(2 * inner.theta)) < 0.1
        assert level.mean() > 0.9
        inside = radius(whole, side) < 31
        assert np.isin(whole.stroke_index[inside], inner.stroke_index).all()


def test_lines_that_end_at_the_outline_are_kept_to_their_ends():
    across = CIRCLE.replace("M20 50H80", "M10 50H90").replace("M50 20V80", "M50 10V90")
    inner = read(svg(across), 60, silhouette="outer")
    assert radius(inner).max() > 36
    assert (np.abs(np.sin(2 * inner.theta)) < 0.3).all()


def test_corners_of_an_outline_are_of_the_outline():
    box = '<g fill="none" stroke="black"><path d="M10 20H90V80H10ZM30 35L70 65"/></g>'
    inner = read(svg(box), 48, silhouette="outer")
    assert np.degrees(line_difference(inner.theta, np.arctan2(-30, 40))).max() < 1


def test_an_open_drawing_has_no_silhouette():
    strokes = '<g fill="none" stroke="black"><path d="M10 10H90M10 50H90M10 90H90"/></g>'
    assert read(svg(strokes), silhouette="outer").sha256 == read(svg(strokes)).sha256


def test_a_part_that_has_nothing_but_its_outline_is_left_out():
    two = f'{CIRCLE}<g fill="none" stroke="black"><circle cx="120" cy="50" r="20"/><path d="M119 50h2"/></g>'
    drawing = svg(two, 'viewBox="0 0 150 100"')
    whole, inner = read(drawing, 60), read(drawing, 60, silhouette="outer")
    assert whole.grid.parts == 2
    assert inner.grid.parts == 1
    assert radius(inner).max() < 32


def test_the_border_of_a_given_mask_is_the_outline(tmp_path):
    file, mask = tmp_path / "a.svg", tmp_path / "mask.png"
    file.write_bytes(svg('<g fill="none" stroke="black"><path d="M10 30H90M10 50H90M10 70H90"/></g>'))
    white = Image.new("L", (100, 100))
    ImageDraw.Draw(white).rectangle((10, 29, 70, 90), fill=255)
    ImageDraw.Draw(white).rectangle((71, 40, 90, 90), fill=255)
    white.save(mask)
    whole, inner = (cf.read_sketch(file, size=40, mask=mask, silhouette=kind) for kind in ("none", "outer"))
    assert len(np.unique(whole.stroke_pixels[:, 0])) > len(np.unique(inner.stroke_pixels[:, 0]))
    assert np.array_equal(whole.mask, inner.mask)


def test_a_drawing_of_nothing_but_its_outline_and_unknown_silhouettes_are_refused(tmp_path):
    with pytest.raises(InputError, match="every stroke runs along the outline; choose the silhouette none"):
        read(svg(RIM), silhouette="outer")
    with pytest.raises(InputError, match="there is no silhouette 'inner'; choose one of none, outer"):
        cf.read_sketch(tmp_path / "none.svg", silhouette="inner")


def test_computed_samples_have_no_silhouette():
    with pytest.raises(InputError, match="torus_patch is computed, not drawn; choose the silhouette none"):
        cf.sample("torus_patch", 16, silhouette="outer")


# --- pictures -----------------------------------------------------------------------------------------------


def test_pictures_have_no_labels_and_flat_drawings_no_views(tmp_path):
    (tmp_path / "a.png").write_bytes(picture())
    with pytest.raises(InputError, match=r"a.png: is a picture, whose strokes have no labels"):
        cf.read_sketch(tmp_path / "a.png", curvature=["colour=red"])
    (tmp_path / "a.svg").write_bytes(svg(CIRCLE))
    for name in ("a.png", "a.svg"):
        with pytest.raises(InputError, match=r"is flat: only a \.curves file can be seen from "):
            cf.read_sketch(tmp_path / name, view="top")


def test_commands_read_what_python_reads(tmp_path, capsys):
    file, instance = str(tmp_path / "a.svg"), str(tmp_path / "a.json")
    (tmp_path / "a.svg").write_bytes(lines('class="flow"'))
    options = ["--curvature", "class=flow", "--curvature", "id=a", "--silhouette", "outer"]
    assert invoke(["instance", file, *options, "-o", instance]) == 1
    assert "has no stroke of id=a; it has colour=#000000" in capsys.readouterr().err
    options = ["--curvature", "class=flow", "--silhouette", "outer"]
    assert invoke(["instance", file, *options, "--size", "20", "-o", instance]) == 0
    expected = cf.read_sketch(file, size=20, curvature=["class=flow"], silhouette="outer")
    assert cf.read_instance(instance).sha256 == expected.sha256
    for wrong in (options, ["--view", "top"]):
        for source, reason in ((instance, "has its own curvature lines"), ("ring", "leave --curvature and")):
            assert invoke(["instance", source, *wrong, "-o", str(tmp_path / "b.json")]) == 1
            assert reason in capsys.readouterr().err
    assert not (tmp_path / "b.json").exists()
