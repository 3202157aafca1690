"""Hidden curves of the study: the curve of each stroke pixel, what is removed, the angle to a field."""

from __future__ import annotations

from types import SimpleNamespace

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.field.field import CrossField
from crossfield.models.instance.symmetries import mirrored, turned

SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><g fill="none" stroke="black">{}</g></svg>'
)


@pytest.fixture(scope="module")
def study(docs_module):
    """The modules of the study that hide curves."""
    return SimpleNamespace(**{name: docs_module(f"studying.{name}") for name in ("hidden", "tracing")})


def drawn(study, tmp_path, content):
    """The instance of an SVG, and the curve of each of its stroke pixels."""
    path = tmp_path / "drawing.svg"
    path.write_text(SVG.format(content))
    instance = cf.read_sketch(path, size=25)
    return instance, study.tracing.curves_of(instance, path)


def traced(study, name, size=24):
    instance = cf.sample(name, size)
    return instance, study.tracing.curves_of(instance, name)


def counts(curve):
    """The numbers of pixels of the curves, the most first."""
    return sorted(np.unique(curve[curve >= 0], return_counts=True)[1].tolist(), reverse=True)


def test_each_run_of_a_path_is_a_curve_and_crossings_belong_to_none(study, tmp_path):
    paths = '<path d="M10 30 H90 M10 70 H90"/><line x1="50" y1="10" x2="50" y2="90"/>'
    instance, curve = drawn(study, tmp_path, paths)
    several = study.tracing.SEVERAL
    assert set(curve) <= {several, 0, 1, 2}
    level = np.minimum(instance.theta, np.pi - instance.theta) < 0.1
    assert set(curve[level]) - {several} == {0, 1}
    assert set(curve[~level]) - {several} == {2}
    assert (curve == several).sum() <= 8


def test_a_stroke_that_redraws_another_is_hidden_with_it(study, tmp_path):
    line = '<path d="M10 {0} H90"/>'
    twice = line.format(31) + '<path d="M15 31.2 H60"/>' + line.format(71) + line.format(53)
    _, curve = drawn(study, tmp_path, twice)
    assert sorted(set(curve)) == [0, 2, 3]
    assert len(set(counts(curve))) == 1


def test_chains_do_not_depend_on_how_the_drawing_is_turned(study):
    for name in ("mouse", "singular", "torus_patch"):
        instance = cf.sample(name, 24)
        chains = [study.tracing.chains(moved) for moved in (instance, turned(instance), mirrored(instance))]
        assert counts(chains[0]) == counts(chains[1]) == counts(chains[2])


def strokes_of(instance):
    """Direction and reliability by pixel."""
    pixels = map(tuple, instance.stroke_pixels.tolist())
    return dict(zip(pixels, zip(instance.theta, instance.w, strict=True), strict=True))


def test_the_nearer_line_counts_whichever_it_is(study):
    instance, curve = traced(study, "skew")
    for hidden in study.hidden.hidden_curves(instance, curve, 3):
        grid, off = instance.grid, 0.2
        on_curve = np.zeros(grid.size)
        on_curve[instance.stroke_index[hidden.stroke]] = instance.theta[hidden.stroke]
        for label, sign in ((0.0, 1), (np.pi / 2, -1)):  # line u, then line v
            beta = np.full(grid.size, 0.1)
            field = CrossField(instance, on_curve + off - label - sign * beta, beta, 0 * grid.first)
            assert hidden.deviation(field) == pytest.approx(off, abs=1e-9)


def test_hiding_changes_neither_the_mask_nor_the_other_strokes(study):
    for name in ("mouse", "ring", "saddle"):
        instance, curve = traced(study, name)
        strokes = strokes_of(instance)
        curves = study.hidden.hidden_curves(instance, curve, 100)
        assert len(curves) > 3
        assert [len(hiding.stroke) for hiding in curves] == sorted(
            (len(h.stroke) for h in curves), reverse=True
        )
        for hidden in curves:
            rest = hidden.rest
            gone = {tuple(pixel) for pixel in instance.stroke_pixels[hidden.stroke].tolist()}
            assert np.array_equal(rest.mask, instance.mask)
            assert strokes_of(rest) == {at: value for at, value in strokes.items() if at not in gone}
            assert study.hidden.SHORTEST <= len(gone) <= study.hidden.MOST * len(strokes)
            assert (curve[hidden.stroke] == hidden.number).all()
        assert {hiding.number for hiding in study.hidden.hidden_curves(instance, curve, 2)} == {
            h.number for h in curves[:2]
        }


def test_a_part_of_the_mask_keeps_a_stroke(study):
    mask = np.ones((5, 9), dtype=bool)
    mask[:, 4] = False  # two parts: one curve on the left, two on the right
    pixels = np.array([[row, column] for row in range(5) for column in (1, 5, 7)])
    instance = cf.Instance.on_pixels("two", mask, pixels, np.full(15, np.pi / 2), np.ones(15))
    curve = np.tile(np.array([0, 1, 2], dtype=np.int32), 5)
    assert [hidden.number for hidden in study.hidden.hidden_curves(instance, curve, 9)] == [1, 2]
