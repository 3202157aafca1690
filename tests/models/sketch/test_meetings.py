"""Pixels in which two curves meet: both directions, each with its own weight, where they are asked for."""

from __future__ import annotations

import json

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.cli.app import invoke
from crossfield.models.errors import InputError
from crossfield.models.instance.angles import line_difference
from crossfield.models.sketch.read import LEAST_WEIGHT
from crossfield.models.sketch.tracing import SEVERAL, curves_of
from PIL import Image, ImageDraw

SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><g fill="none" stroke="black">'
    '<path d="M10 10 H90 V90 H10 Z"/>{}</g></svg>'
)


def read(tmp_path, lines, **given):
    """A drawing of lines from one side of a square to another one, given as numbers of SVG's path data."""
    path = tmp_path / "drawing.svg"
    path.write_text(SVG.format("".join(f'<path d="M{a} {b}L{c} {d}"/>' for a, b, c, d in lines)))
    return path, cf.read_sketch(path, size=21, **given)


@pytest.mark.parametrize("degrees, meets", [(90, True), (60, True), (33, True), (27, False)])
def test_two_curves_that_meet_keep_their_directions(tmp_path, degrees, meets):
    rise = 36 * np.tan(np.radians(degrees / 2))
    middle = 50.0
    lines = [(14, middle + s * min(rise, 36), 86, middle - s * min(rise, 36)) for s in (1, -1)]
    path, instance = read(tmp_path, lines, crossings=True)
    at = instance.stroke_pixels[instance.crossings]
    here = np.nonzero((at == instance.grid.height // 2).all(axis=1))[0]
    assert len(here) == meets
    if meets:
        (place,) = here
        both = instance.theta[instance.crossings[place]], instance.theta_cross[place]
        expected = np.radians([degrees / 2, 180 - degrees / 2])
        assert sorted(both) == pytest.approx(sorted(expected), abs=1e-9)
        assert instance.w_cross[place] >= LEAST_WEIGHT
        curve = curves_of(instance, path)
        found = {curve[instance.crossings[place]], curve[len(instance.theta) + place]}
        assert found == {1, 2}
        assert SEVERAL not in found


def test_crossings_are_there_only_when_they_are_asked_for(tmp_path):
    lines = [(14, 14, 86, 86), (14, 86, 86, 14)]
    _, plain = read(tmp_path, lines)
    _, both = read(tmp_path, lines, crossings=True)
    assert not len(plain.crossings)
    assert len(both.crossings)
    assert (both.mask == plain.mask).all()
    far = set(map(tuple, both.stroke_pixels.tolist())) - set(
        map(tuple, both.stroke_pixels[both.crossings].tolist())
    )
    assert far <= set(map(tuple, plain.stroke_pixels.tolist()))
    apart = line_difference(both.theta[both.crossings], both.theta_cross)
    assert (apart >= np.pi / 6 - 1e-9).all()


def test_three_curves_in_one_pixel_leave_none(tmp_path):
    lines = [(14, 14, 86, 86), (14, 86, 86, 14), (14, 50, 86, 50)]
    _, instance = read(tmp_path, lines, crossings=True)
    centre = instance.grid.height // 2
    assert not (instance.stroke_pixels[instance.crossings] == centre).all(axis=1).any()


def test_commands_keep_both_directions_when_they_are_asked_to(tmp_path, capsys):
    path, both = read(tmp_path, [(14, 14, 86, 86), (14, 86, 86, 14)], crossings=True)
    made, sketch = tmp_path / "a.json", [str(path), "--size", "21", "--crossings"]
    assert invoke(["instance", *sketch, "-q", "-o", str(made)]) == 0
    assert cf.read_instance(made).sha256 == both.sha256
    assert invoke(["evaluate", *sketch, "-m", "power", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["instance"]["sha256"] == both.sha256
    assert {curve["curve"] for curve in found["curves"]} >= {1, 2}
    assert invoke(["prove", *sketch, "-o", str(tmp_path / "proof")]) == 1
    assert "no proof knows what two strokes at one pixel cost" in capsys.readouterr().err
    assert invoke(["instance", str(made), "--crossings", "-o", str(tmp_path / "b.json")]) == 1
    assert "leave --silhouette, --curvature, --view and --crossings out" in capsys.readouterr().err


def test_drawn_samples_keep_both_directions_and_what_names_no_curves_is_refused(tmp_path):
    both = cf.sample("skew", 24, crossings=True)
    assert len(both.crossings)
    assert both.without_crossings().grid.size == cf.sample("skew", 24).grid.size
    assert not len(cf.sample("skew", 24).crossings)
    with pytest.raises(InputError, match=r"torus_patch is computed, not drawn; .* leave crossings out"):
        cf.sample("torus_patch", 8, crossings=True)
    image = Image.new("L", (60, 60), "white")
    ImageDraw.Draw(image).line((5, 5, 55, 55), fill=0, width=2)
    image.save(tmp_path / "a.png")
    with pytest.raises(InputError, match="is a picture, which does not say which curves meet"):
        cf.read_sketch(tmp_path / "a.png", crossings=True)
