"""Drawings as people make them, read as they look: tests/data/drawings.

The expected pictures come from the geometry of the drawings alone. A pixel is outside (0), in the mask (1) or
has a curvature line, whose direction in steps of two degrees is its value less 2.
"""

import re
import tomllib

import crossfield as cf
import numpy as np
import pytest
from PIL import Image
from places import ROOT
from scipy import ndimage

FOLDER = ROOT / "tests/data/drawings"
TABLE = tomllib.loads((FOLDER / "drawings.toml").read_text())
LINE, STEP = 2, 2.0
MOST_DIFFERENT = {True: 0.1, False: 0.16}
"""Pixels that differ in SVG and in pictures, as a share of those of lines and of the mask's border."""
MOST_TURNED = 8.0  # degrees, of a curvature line; the expectation has steps of 2


def parts_of(picture):
    """The mask and the curvature lines of a picture of classes."""
    return {"mask": picture > 0, "curvature lines": picture >= LINE}


def picture_of(instance):
    """The classes of an instance's pixels, with directions as in the expected pictures."""
    picture = instance.mask.astype(int)
    steps = np.round(np.degrees(instance.theta) / STEP).astype(int) % round(180 / STEP)
    picture[tuple(instance.stroke_pixels.T)] = LINE + steps
    return picture


def both_as_text(expected, read):
    """Both pictures side by side, expected left: a dot is outside, o in the mask, # a curvature line."""
    rows = ("".join(".o#"[min(value, LINE)] for value in row) for row in np.hstack([expected, read]))
    return "\n".join(f"{row[: expected.shape[1]]}   {row[expected.shape[1] :]}" for row in rows)


def options_of(drawing):
    return {key: drawing[key] for key in ("size", "curvature") if key in drawing}


DRAWINGS = [
    pytest.param(
        drawing, id=f"{drawing['file']}-{drawing.get('size', 24)}", marks=pytest.mark.slow if at % 3 else ()
    )
    for at, drawing in enumerate(TABLE["drawing"])
]
"""One of each three is quick, in table order: some of every kind."""


@pytest.mark.parametrize("drawing", DRAWINGS)
def test_a_drawing_is_read_as_it_looks(drawing):
    path = FOLDER / drawing["file"]
    if "error" in drawing:
        with pytest.raises(cf.InputError, match=drawing["error"]):
            cf.read_sketch(path)
        return
    instance = cf.read_sketch(path, **options_of(drawing))
    expected = np.asarray(Image.open(FOLDER / "expected" / f"{drawing['picture']}.png")).astype(int)
    read = picture_of(instance)
    assert read.shape == expected.shape, f"the grid has {read.shape} pixels instead of {expected.shape}"
    both = "expected, read:\n" + both_as_text(expected, read)
    near = np.ones((3, 3), dtype=bool)
    for name, of_expected in parts_of(expected).items():
        of_read = parts_of(read)[name]
        for missing, text in ((of_expected & ~of_read, "missing"), (of_read & ~of_expected, "too many")):
            other = of_read if text == "missing" else of_expected
            far = missing & ~ndimage.binary_dilation(other, near)
            assert not far.any(), f"{name}: {far.sum()} pixels {text}, more than a pixel off; {both}"
    lines = parts_of(expected)["curvature lines"]
    border = (expected > 0) & ~ndimage.binary_erosion(expected > 0)
    different = (np.minimum(read, LINE) != np.minimum(expected, LINE)).sum()
    most = MOST_DIFFERENT[path.suffix == ".svg"] * (lines | border).sum()
    assert different <= most, f"{different} pixels differ, more than {most:.0f}; {both}"
    shared = lines & (read >= LINE)
    turned = np.abs((STEP * (read - expected)[shared] + 90) % 180 - 90)
    assert turned.max() <= MOST_TURNED, f"a curvature line is turned by {turned.max():.0f} degrees; {both}"
    warnings, patterns = instance.reading.warnings, drawing.get("notes", [])
    for pattern in patterns:
        assert any(re.search(pattern, line) for line in warnings), f"{pattern!r} is not reported: {warnings}"
    for line in warnings:
        assert any(re.search(pattern, line) for pattern in patterns), f"an unexpected warning: {line}"


def test_the_table_lists_every_file_and_the_folder_is_small():
    rows = TABLE["drawing"]
    listed = {row["file"] for row in rows} | {f"{row['picture']}.png" for row in rows if "picture" in row}
    files = [path for path in FOLDER.rglob("*") if path.is_file()]
    assert {path.name for path in files} == {*listed, "drawings.toml"}
    assert sum(path.stat().st_size for path in files) < 400_000
    assert {row["kind"] for row in rows} <= set(TABLE["kinds"])
