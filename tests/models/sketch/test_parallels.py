"""Hatching and ruled paper, and families of curvature lines that are neither."""

import re
from functools import cache

import crossfield as cf
import numpy as np
import pytest
from loops import for_each
from places import ROOT
from small_drawings import read, svg

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


@cache
def drawing(*parts):
    return read(svg("".join(parts), 'viewBox="0 0 300 300"'))


HATCHING = rows((90, 180, 130, 200), (3, -3), 14, "gray")
RULED = rows((0, 20, 300, 20), (0, 30), 9, "steelblue")
ACROSS = rows((80, 150, 110, 90), (0, 0), 1, "red")


@for_each(
    "parallels, flow",
    [
        (HATCHING, FLOW),
        (HATCHING + rows((90.5, 180, 130.5, 201), (3, -3), 14, "gray"), FLOW),  # drawn twice
        (RULED, FLOW),
        (RULED + rows((36, 0, 36, 300), (0, 0), 1, "red"), FLOW),  # with a margin
        (RULED + rows((15, 0, 15, 300), (30, 0), 10, "steelblue"), FLOW),
        (rows((90, 180, 110, 190), (3, -3), 8, "gray"), FLOW + ACROSS),  # a line across them is no margin
    ],
)
def test_hatching_and_ruled_paper_are_left_out_and_reported(parallels, flow):
    plain, full = drawing(BODY, flow), drawing(parallels, BODY, flow)
    assert full.sha256 == plain.sha256
    assert full.reading.warnings
    assert all("are left out as hatching" in warning for warning in full.reading.warnings)


@for_each(
    "lines",
    [
        BODY.replace("/>", ' stroke-width="9"/>') + HATCHING.replace("gray", "red"),
        BODY + rows((90, 180, 110, 200), (3, -3), 7, "gray"),
        BODY
        + "".join(
            rows((150, 150, *end), (0, 0), 1, "black")  # a fan
            for end in 300 * np.random.default_rng(0).random((40, 2))
        ),
        BODY + rows((110, 80, 140, 80), (0, 14), 9, "black"),  # a grille
        "".join(  # an edge in pieces
            rows((x, 150 - x / 50, x + 4, 150 - (x + 4) / 50), (0, 0), 1, "black") for x in range(80, 220, 4)
        ),
        BODY + rows((80, 150, 80, 155), (9, 0), 15, "gray"),  # ticks in a row
    ],
)
def test_other_lines_are_neither_hatching_nor_construction_lines(lines):
    assert not any("left out as" in warning for warning in drawing(lines, FLOW).reading.warnings)


@for_each(
    "ends, named",
    [
        (("M20 150H280", "M150 20V280"), "2 straight lines leave .* both sides, first round"),
        (("M55 150H280",), None),  # overshoots
    ],
)
def test_straight_lines_through_the_outline_are_named(ends, named):
    lines = "".join(f'<path d="{line}" fill="none" stroke="black"/>' for line in ends)
    warnings = drawing(BODY, FLOW, lines).reading.warnings
    assert [bool(re.match(named or "", line)) for line in warnings] == ([True] if named else [])


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the drawings in ../shared/sketches")
def test_real_drawings_have_no_hatching():
    for path in sorted(SHARED.iterdir()):
        if path.suffix in (".svg", ".scap", ".curves"):
            warnings = cf.read_sketch(path).reading.warnings
            assert not any("hatching" in warning for warning in warnings), path.name
