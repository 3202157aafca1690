"""Masks: what `--mask` takes, and mask.png, the mask that was found, given back."""

import re

import crossfield as cf
import numpy as np
import pytest
from command_line import invoke
from loops import for_each
from PIL import Image, ImageDraw
from scipy import ndimage
from small_drawings import BLACK, sample_svg, svg

LINE = f'<path d="M10 10 L90 90" {BLACK}/>'
OPEN = svg(f'<path d="M84 30H10V70H90V30M50 30V70" {BLACK}/>')
SCAP = b"#200\t200\n@1\n{\n\t#0\t0\n\t20\t100\t1\n\t180\t100\t1\n}\n"


def bitmap(path):
    image = Image.new("L", (300, 220), 255)
    draw = ImageDraw.Draw(image)
    draw.ellipse((20, 20, 280, 200), outline=0, width=3)
    draw.line((150, 20, 150, 200), fill=0, width=3)
    draw.line((20, 110, 280, 110), fill=0, width=3)
    image.save(path)
    return path


def mask_file(path, size, *boxes, value=255):
    """A picture that is white in boxes of left, top, right and bottom."""
    image = Image.new("L", size, 0)
    for left, top, right, bottom in boxes:
        ImageDraw.Draw(image).rectangle((left, top, right - 1, bottom - 1), fill=value)
    image.save(path)
    return path


def test_a_mask_crops_the_grid_and_decides_what_is_solved(tmp_path):
    drawing = tmp_path / "Drawing.svg"
    drawing.write_bytes(svg(LINE))
    mask = mask_file(tmp_path / "m.png", (100, 100), (20, 30, 80, 70))
    instance = cf.read_sketch(drawing, size=30, mask=mask)
    assert instance.mask.shape == (20, 30)
    assert instance.mask.all()
    assert instance.pixel_size == pytest.approx(2)
    assert instance.origin == pytest.approx((20, 30))
    np.testing.assert_allclose(instance.theta, 3 * np.pi / 4)
    assert (np.diff(instance.stroke_pixels, axis=1) == 10 - 5).all()  # y = x: column * 2 + 20 = row * 2 + 30


def test_a_mask_pixel_counts_from_half_its_area_on(tmp_path):
    (tmp_path / "a.svg").write_bytes(svg(LINE))
    white = mask_file(tmp_path / "m.png", (100, 100), (0, 0, 100, 55), (0, 0, 54, 100))
    mask = cf.read_sketch(tmp_path / "a.svg", size=10, mask=white).mask
    assert mask[:6].all()  # row 5 is white in half of it
    assert mask[:, :5].all()
    assert not mask[6:, 5:].any()  # column 5 in less than half


@for_each("name, size", [("a.png", (300, 220)), ("a.scap", (200, 200))])
def test_a_mask_belongs_to_bitmaps_and_to_scap_files_too(name, size, tmp_path):
    bitmap(tmp_path / "a.png")
    (tmp_path / "a.scap").write_bytes(SCAP)
    mask = mask_file(tmp_path / "m.png", size, (40, 60, 160, 140))
    instance = cf.read_sketch(tmp_path / name, size=30, mask=mask)
    assert instance.mask.shape == (20, 30)
    assert instance.origin == pytest.approx((40, 60))


@for_each(
    "size, box, value, head, message",
    [
        ((90, 80), (0, 0, 50, 50), 255, None, "m.png: the mask has 90 x 80 pixels, but"),
        ((100, 100), (0, 0, 5, 5), 0, None, "m.png: the mask is black all over"),
        ((100, 100), (60, 0, 100, 40), 255, None, "a.svg: no stroke lies inside the mask"),
        ((100, 100), (0, 0, 50, 50), 255, "", "neither a viewBox nor a width and height"),
        (None, (), 0, None, r"m.png: cannot be read"),
    ],
)
def test_masks_that_do_not_fit_are_refused(size, box, value, head, message, tmp_path):
    (tmp_path / "a.svg").write_bytes(svg(LINE) if head is None else svg(LINE, head))
    if size:
        mask_file(tmp_path / "m.png", size, box, value=value)
    with pytest.raises(cf.InputError, match=message):
        cf.read_sketch(tmp_path / "a.svg", mask=tmp_path / "m.png")


def assert_same_up_to_the_border(first, second):
    """The middle of every pixel of the second is solved as in the first, or lies at its border."""
    row, column = np.indices(second.mask.shape) + 0.5
    x, y = (
        (start + second.pixel_size * place - there) / first.pixel_size
        for start, place, there in zip(second.origin, (column, row), first.origin, strict=True)
    )
    mask = np.pad(first.mask, 8)
    at = (np.floor(y).astype(int) + 8, np.floor(x).astype(int) + 8)
    depth = ndimage.distance_transform_cdt(mask, "chessboard") + ndimage.distance_transform_cdt(
        ~mask, "chessboard"
    )
    wrong = mask[at] != second.mask
    assert (depth[at][wrong] == 1).all()
    assert wrong.mean() < 0.05


@for_each("name, size", [("ring", 48), ("bottle", 16), ("bitmap", 48)])
def test_a_mask_given_back_unchanged_solves_the_same_up_to_the_border(name, size, tmp_path):
    path = tmp_path / f"{name}.svg"
    path = bitmap(path.with_suffix(".png")) if name == "bitmap" else path
    if name != "bitmap":
        path.write_text(sample_svg(name))
    first = cf.read_sketch(path, size=size)
    mask = tmp_path / "mask.png"
    assert invoke(["instance", str(path), "--size", str(size), "-o", str(mask)]) == 0
    again = cf.read_sketch(path, size=size, mask=mask)
    assert max(again.mask.shape) == size
    assert_same_up_to_the_border(first, again)
    # White is all that is solved: both have the same area, that on the page.
    white = (np.asarray(Image.open(mask)) > 127).sum()
    for instance in (first, again):
        assert instance.mask.sum() * instance.pixel_size**2 == pytest.approx(white, rel=0.06)


def test_an_instance_that_was_read_from_no_page_has_no_mask_file(tmp_path, capsys):
    (tmp_path / "a.svg").write_bytes(OPEN.replace(b' viewBox="0 0 100 100"', b""))
    for source in ("wave_sheet", str(tmp_path / "a.svg")):
        assert invoke(["instance", source, "--size", "12", "-o", str(tmp_path / "m.png")]) == 1
        assert re.search(r"m\.png: .* has no page that a mask could cover", capsys.readouterr().err)
    assert not (tmp_path / "m.png").exists()


def test_warnings_reach_standard_error_and_are_no_part_of_the_instance(tmp_path, capsys):
    drawing = tmp_path / "open.svg"
    drawing.write_bytes(OPEN)
    instance = cf.read_sketch(drawing, size=48)
    (warning,) = instance.reading.warnings
    for output in ("a.json", "mask.png"):
        assert invoke(["instance", str(drawing), "-o", str(tmp_path / output), "--size", "48"]) == 0
        assert capsys.readouterr().err == f"crossfield: warning: open.svg: {warning}\n"
    again = cf.read_instance(tmp_path / "a.json")
    assert again.sha256 == instance.sha256
    assert again.reading is None
    assert instance.with_gauge("box").with_weights(stroke_weight=2.0).reading is instance.reading
