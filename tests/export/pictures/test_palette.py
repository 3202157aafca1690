"""The style sheet of the studio has the colours of the palette, light and dark."""

from __future__ import annotations

import re

import matplotlib as mpl
import pytest
from crossfield.export.pictures.palette import ANGLE_MAP, ANGLES, DARK, LIGHT
from places import ROOT


def test_the_style_sheet_of_the_studio_has_the_colours_of_the_palette():
    text = (ROOT / "templates/studio/studio.css").read_text()
    assert re.findall(r"--line: (#[0-9a-f]{6});", text) == [LIGHT["stroke"], DARK["stroke"]]


def test_the_key_of_angles_has_the_colours_of_their_map():
    assert f"to right, {', '.join(ANGLES)})" in (ROOT / "templates/studio/studio.css").read_text()
    colours = mpl.colormaps[ANGLE_MAP]([0.0, 0.25, 0.5, 0.75, 1.0])
    for colour, expected in zip(ANGLES, colours, strict=True):
        assert mpl.colors.to_rgb(colour) == pytest.approx(tuple(expected[:3]), abs=0.01)
