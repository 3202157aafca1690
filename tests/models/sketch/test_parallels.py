"""Hatching and ruled paper, and families of curvature lines that are neither."""

import numpy as np
import pytest
from crossfield.models.samples.samples import samples
from crossfield.models.sketch.drawing_file import parse_drawing
from crossfield.models.sketch.parallels import find_parallels, leave_out_parallels
from crossfield.models.sketch.read import instance_of_drawing
from crossfield.models.sketch.samples import sample_svg
from crossfield.models.sketch.svg import read_svg
from places import ROOT

SHARED = ROOT.parent / "shared" / "sketches"
BODY = '<circle cx="150" cy="150" r="90" fill="none" stroke="black"/>'
FLOW = '<path d="M70 150Q150 120 230 150M150 70Q130 150 150 230" fill="none" stroke="red"/>'


def rows(start, step, count, colour):
    """Lines from start, each a step further: (x, y) of the first end and of the second, and the step."""
    (x, y, u, v), (right, down) = start, step
    return "".join(
        f'<path d="M{x + k * right} {y + k * down}L{u + k * right} {v + k * down}" stroke="{colour}"/>'
        for k in range(count)
    )


def drawing(*parts):
    return read_svg(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 300 300">{"".join(parts)}</svg>'.encode()
    )


HATCHING = rows((90, 180, 130, 200), (3, -3), 14, "gray")
TWICE = HATCHING + rows((90.5, 180, 130.5, 201), (3, -3), 14, "gray")
RULED = rows((0, 20, 300, 20), (0, 30), 9, "steelblue")
NOTEBOOK = (
    RULED + rows((36, 0, 36, 300), (0, 0), 1, "red") + rows((0, 290, 120, 290), (150, 0), 2, "steelblue")
)
SQUARED = RULED + rows((15, 0, 15, 300), (30, 0), 10, "steelblue")


@pytest.mark.parametrize(
    "parallels, kinds",
    [
        (HATCHING, ["hatching"]),
        (TWICE, ["hatching"]),
        (RULED, ["ruled paper"]),
        (NOTEBOOK, ["ruled paper"]),
        (SQUARED, 2 * ["ruled paper"]),
    ],
)
def test_hatching_and_ruled_paper_are_left_out(parallels, kinds):
    plain, full = drawing(BODY, FLOW), drawing(parallels, BODY, FLOW)
    assert [family.kind for family in find_parallels(full)] == kinds
    left = leave_out_parallels(full)
    np.testing.assert_array_equal(left.points, plain.points)
    assert all("left out" in note for note in left.notes)
    options = {"name": "body", "source": "body.svg"}
    read = instance_of_drawing(full, 24, **options)
    assert (read.mask == instance_of_drawing(plain, 24, **options).mask).all()
    assert read.reading.warnings[: len(kinds)] == left.notes


def test_a_hatching_drawn_twice_is_counted_once():
    once, twice = (find_parallels(drawing(lines, BODY))[0] for lines in (HATCHING, TWICE))
    assert once.count == twice.count == 14
    assert len(twice.curve) == 28
    np.testing.assert_allclose(once.middle, [129.5, 170.5])


def test_hatching_among_curvature_lines_stays_with_a_warning():
    curves = drawing(BODY, FLOW, HATCHING.replace("gray", "red"))
    left = leave_out_parallels(curves)
    assert len(left.points) == len(curves.points)
    (note,) = left.notes
    assert note.startswith("14 parallel lines round (129.5, 170.5) look like hatching, but count as")


NEITHER = {
    "rulings of a cylinder": BODY + rows((110, 80, 110, 220), (10, 0), 9, "red"),
    "few close lines": BODY + rows((110, 80, 110, 220), (4, 0), 8, "red"),
    "uneven lines": BODY
    + "".join(rows((x, 90, x, 210), (0, 0), 1, "red") for x in 120 + np.arange(12) ** 1.7),
    "a sheet": rows((50, 50, 250, 50), (0, 20), 11, "black") + rows((50, 50, 50, 250), (20, 0), 11, "black"),
    "a fan": BODY
    + "".join(
        rows((150, 150, *end), (0, 0), 1, "gray") for end in 300 * np.random.default_rng(0).random((40, 2))
    ),
    "ticks in a row": BODY + rows((80, 150, 80, 155), (9, 0), 15, "gray"),
}


@pytest.mark.parametrize("name", NEITHER)
def test_other_lines_are_no_hatching(name):
    assert find_parallels(drawing(NEITHER[name])) == []


@pytest.mark.parametrize("name", [sample.name for sample in samples() if sample.kind == "sketch"])
def test_samples_have_no_hatching(name):
    assert find_parallels(read_svg(sample_svg(name).encode())) == []


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the drawings in ../shared/sketches")
def test_real_drawings_have_no_hatching():
    for path in sorted(SHARED.iterdir()):
        if path.suffix in (".svg", ".scap", ".curves"):
            assert find_parallels(parse_drawing(path.read_bytes(), path.suffix, 24)) == [], path.name
