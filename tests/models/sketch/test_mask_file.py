"""mask.png: the mask that was found, in the size for `--mask`, and the same region when it is given back."""

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.cli.app import invoke
from crossfield.export.runs.methods import Candidate
from crossfield.export.runs.report import Report
from crossfield.export.runs.run import START
from crossfield.models.errors import InputError
from crossfield.models.instance.symmetries import turned
from crossfield.models.samples.samples import samples
from crossfield.models.sketch.samples import sample_svg
from PIL import Image, ImageDraw
from scipy import ndimage

SKETCHES = [known.name for known in samples() if known.kind == "sketch"]
OPEN = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">'
    '<path d="M84 30H10V70H90V30M50 30V70" fill="none" stroke="black"/></svg>'
)


def bitmap(path):
    image = Image.new("L", (300, 220), 255)
    draw = ImageDraw.Draw(image)
    draw.ellipse((20, 20, 280, 200), outline=0, width=3)
    draw.line((150, 20, 150, 200), fill=0, width=3)
    draw.line((20, 110, 280, 110), fill=0, width=3)
    image.save(path)
    return path


def drawings(folder):
    for name in SKETCHES:
        path = folder / f"{name}.svg"
        path.write_text(sample_svg(name))
        yield path
    yield bitmap(folder / "ellipse.png")


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


@pytest.mark.parametrize("size", [16, 24, 48])
def test_a_mask_given_back_unchanged_solves_the_same_up_to_the_border(size, tmp_path):
    for path in drawings(tmp_path):
        first = cf.read_sketch(path, size=size)
        mask = cf.write_mask(first, tmp_path / "mask.png")
        again = cf.read_sketch(path, size=size, mask=mask)
        assert max(again.mask.shape) == size
        assert_same_up_to_the_border(first, again)
        # White is all that is solved: both have the same area, that on the page.
        white = (np.asarray(Image.open(mask)) > 127).sum()
        for instance in (first, again):
            assert instance.mask.sum() * instance.pixel_size**2 == pytest.approx(white, rel=0.06)


def test_a_mask_that_is_painted_on_is_solved_as_painted(tmp_path):
    path = bitmap(tmp_path / "a.png")
    mask = cf.write_mask(cf.read_sketch(path, size=32), tmp_path / "mask.png")
    image = Image.open(mask)
    assert image.size == (300, 220)
    ImageDraw.Draw(image).rectangle((160, 120, 210, 160), fill=0)
    image.save(mask)
    hole = ~ndimage.binary_fill_holes(~cf.read_sketch(path, size=32, mask=mask).mask)
    assert not hole.all()
    solved = cf.read_sketch(path, size=32, mask=mask)
    column, row = ((np.array([185, 140]) - solved.origin) / solved.pixel_size).astype(int)
    assert not solved.mask[row, column]
    assert solved.mask[row - 8, column]


def test_an_instance_that_was_read_from_no_page_has_no_mask_file(tmp_path):
    (tmp_path / "a.svg").write_text(OPEN.replace(' viewBox="0 0 100 100"', ""))
    for instance in (cf.sample("wave_sheet", 12), cf.read_sketch(tmp_path / "a.svg", size=12)):
        with pytest.raises(
            InputError, match=r"m\.png: .* has no page that a mask could cover; give a sketch with"
        ):
            cf.write_mask(instance, tmp_path / "m.png")
    assert not (tmp_path / "m.png").exists()


def test_warnings_reach_standard_error_and_the_report_once(tmp_path, capsys):
    drawing = tmp_path / "open.svg"
    drawing.write_text(OPEN)
    instance = cf.read_sketch(drawing, size=48)
    (warning,) = instance.reading.warnings
    for output in ("a.json", "mask.png"):
        assert invoke(["instance", str(drawing), "-o", str(tmp_path / output), "--size", "48"]) == 0
        assert capsys.readouterr().err == f"crossfield: warning: open.svg: {warning}\n"
    assert (tmp_path / "mask.png").read_bytes() == cf.write_mask(instance, tmp_path / "m.png").read_bytes()
    report = Report(instance, (Candidate(START, cf.greedy_field(instance), 0.0),), ())
    assert report.document()["warnings"] == [warning]


def test_what_the_reader_says_is_no_part_of_the_instance(tmp_path):
    instance = cf.sample("mouse", 12)
    again = cf.read_instance(cf.write_instance(instance, tmp_path / "a.json"))
    assert again.sha256 == instance.sha256
    assert again.reading is None
    assert instance.with_gauge("box").with_weights(stroke_weight=2.0).reading is instance.reading
    assert turned(instance).reading is None
