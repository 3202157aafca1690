"""Which curve a stroke pixel comes from: runs of paths, clusters, what redraws them, chains of pixels."""

import io

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.errors import InputError
from crossfield.models.sketch.read import curves_in
from crossfield.models.sketch.tracing import SEVERAL, chains, curves_of
from PIL import Image, ImageDraw

SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><g fill="none" stroke="black">{}</g></svg>'
)


def drawn(tmp_path, content, suffix=".svg", size=25):
    """The instance of a drawing, and the curve of each of its stroke pixels."""
    path = tmp_path / f"drawing{suffix}"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    instance = cf.read_sketch(path, size=size)
    return instance, curves_of(instance, path)


def counts(curve):
    """The numbers of pixels of the curves, the most first."""
    return sorted(np.unique(curve[curve >= 0], return_counts=True)[1].tolist(), reverse=True)


def test_each_run_of_a_path_is_a_curve_and_crossings_belong_to_none(tmp_path):
    paths = '<path d="M10 30 H90 M10 70 H90"/><line x1="50" y1="10" x2="50" y2="90"/>'
    instance, curve = drawn(tmp_path, SVG.format(paths))
    assert set(curve) <= {SEVERAL, 0, 1, 2}
    level = np.minimum(instance.theta, np.pi - instance.theta) < 0.1
    assert set(curve[level]) - {SEVERAL} == {0, 1}
    assert set(curve[~level]) - {SEVERAL} == {2}
    rows = instance.stroke_pixels[:, 0]
    assert rows[curve == 0].max() < rows[curve == 1].min()
    assert (curve == SEVERAL).sum() <= 8


def test_the_next_shape_is_another_curve_even_where_it_goes_on(tmp_path):
    paths = '<path d="M10 50 L50 50 L90 50"/><path d="M90 50 L90 90"/>'
    content = SVG.format(paths).encode()
    assert curves_in(content, ".svg").curve.tolist() == [0, 0, 1]


def test_a_stroke_that_redraws_another_is_hidden_with_it(tmp_path):
    line = '<path d="M10 {0} H90"/>'
    twice = line.format(31) + '<path d="M15 31.2 H60"/>' + line.format(71) + line.format(53)
    _, curve = drawn(tmp_path, SVG.format(twice))
    assert sorted(set(curve)) == [0, 2, 3]
    assert len(set(counts(curve))) == 1


def scap(clusters):
    """Level strokes, one below the other, each of a cluster; the last one without its line of numbers."""
    strokes = [
        f"{{\n#{number}\t{cluster}\n"
        + "".join(f"{x}\t{10 + 20 * number}\t0\n" for x in range(10, 91))
        + "}\n"
        for number, cluster in enumerate(clusters)
    ]
    return "#100\t100\n@1\n" + "".join(strokes)


def test_the_strokes_of_a_cluster_are_one_curve(tmp_path):
    _, curve = drawn(tmp_path, scap([0, 0, 7, 3]), ".scap")
    assert len(counts(curve)) == 3
    assert counts(curve)[0] == 2 * counts(curve)[1] == 2 * counts(curve)[2]


def test_a_file_of_one_cluster_says_nothing_of_curves(tmp_path):
    for content in (scap([5, 5, 5]), scap([0, 1, 2]).replace("\t0\n", "\n").replace("#1\t1\n", "")):
        assert len(counts(drawn(tmp_path, content, ".scap")[1])) == 3


def test_chains_of_a_bitmap_end_at_corners_and_go_on_over_crossings(tmp_path):
    image = Image.new("L", (200, 200), 255)
    draw = ImageDraw.Draw(image)
    draw.line([(20, 20), (180, 20), (180, 180)], fill=0, width=4)
    draw.line([(20, 100), (180, 100)], fill=0, width=4)
    draw.line([(60, 40), (60, 180)], fill=0, width=4)
    held = io.BytesIO()
    image.save(held, "PNG")
    instance, curve = drawn(tmp_path, held.getvalue(), ".png")
    long = [number for number in range(curve.max() + 1) if (curve == number).sum() > 8]
    assert len(long) == 4
    for number in long:
        theta = instance.theta[curve == number]
        assert np.abs(np.exp(2j * theta).mean()) > 0.98


def test_chains_do_not_depend_on_how_the_drawing_is_turned():
    for name in ("mouse", "singular", "torus_patch"):
        instance = cf.sample(name, 24)
        found = counts(chains(instance))
        assert found == counts(chains(instance.turned())) == counts(chains(instance.mirrored()))


def test_what_is_at_hand_decides(tmp_path):
    instance = cf.sample("saddle", 16)
    file = tmp_path / "saddle.npz"
    cf.write_instance(instance, file)
    assert np.array_equal(curves_of(instance, file), chains(instance))
    assert np.array_equal(curves_of(instance), chains(instance))
    torus = cf.sample("torus_patch", 16)
    assert np.array_equal(curves_of(torus, "torus_patch"), chains(torus))
    assert len(counts(curves_of(instance, "saddle"))) == 10


def test_another_sketch_than_that_of_the_instance_is_refused():
    with pytest.raises(InputError, match=r"mouse: draws nothing at \d+ stroke pixels of saddle"):
        curves_of(cf.sample("saddle", 16), "mouse")
