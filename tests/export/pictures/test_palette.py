"""The style sheets of pages have the colours of the palette, light and dark."""

from __future__ import annotations

import re

import matplotlib as mpl
import pytest
from crossfield.export.pictures.palette import ANGLE_MAP, ANGLES, DARK, LIGHT
from places import ROOT


@pytest.mark.parametrize(
    "sheet, variables",
    [
        ("templates/site/site.css", {"curved": "stroke", "u": "u", "v": "v"}),
        ("templates/studio/studio.css", {"line": "stroke"}),
    ],
)
def test_a_style_sheet_has_the_colours_of_the_palette(sheet, variables):
    text = (ROOT / sheet).read_text()
    for variable, mark in variables.items():
        colours = re.findall(rf"--{variable}: (#[0-9a-f]{{6}});", text)
        assert colours == [LIGHT[mark], DARK[mark]], variable


def test_the_key_of_angles_has_the_colours_of_their_map():
    assert f"to right, {', '.join(ANGLES)})" in (ROOT / "templates/studio/studio.css").read_text()
    colours = mpl.colormaps[ANGLE_MAP]([0.0, 0.25, 0.5, 0.75, 1.0])
    for colour, expected in zip(ANGLES, colours, strict=True):
        assert mpl.colors.to_rgb(colour) == pytest.approx(tuple(expected[:3]), abs=0.01)
