"""The command `shade`: its inputs, its files and its errors."""

import json

import crossfield as cf
import numpy as np
import pytest
from command_line import invoke
from folders import contents
from loops import for_each
from PIL import Image

FILES = (
    *("normals.png", "shaded.png", "overlay.png", "drawing.png"),
    *("heights.npy", "surface.obj", "surface.mtl", "surface.json"),
)


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """Path of a file with a field on a small sample."""
    field = cf.bend_field(cf.polyvector_field(cf.sample("mouse", 6), hold=100))
    return str(cf.write_field(field, tmp_path_factory.mktemp("field") / "saved.npz"))


def test_a_sketch_an_instance_and_a_field_give_the_surface_of_the_function(saved, tmp_path, capsys):
    field = cf.read_field(saved)
    instance = str(cf.write_instance(field.instance, tmp_path / "instance.npz"))
    for number, source in enumerate((["mouse", "--size", "6"], [instance], [saved])):
        command = ["shade", *source, "--underlay", "mouse", "--side", "48", "-o", str(tmp_path / str(number))]
        assert invoke(command) == 0
        assert contents(tmp_path / str(number)) == contents(tmp_path / "0"), source
    out = capsys.readouterr().out
    assert "mouse: 6 x 6" in out
    assert "undetermined: the part at" in out
    assert "--concave" in out
    assert "pictures show the page of the drawing, 48 x 40 pixels" in out
    assert str(tmp_path / "2") in out
    surface = cf.surface(field)
    assert np.array_equal(np.load(tmp_path / "0" / "heights.npy"), surface.heights, equal_nan=True)
    cf.write_surface(surface, tmp_path / "again", drawing="mouse", side=48)
    again, written = contents(tmp_path / "again"), contents(tmp_path / "0")
    assert written.keys() == set(FILES)
    assert [name for name in FILES if written[name] != again.get(name)] in ([], ["surface.json"])


def test_a_surface_is_flipped_and_hinted(saved, tmp_path, capsys):
    side = cf.surface(cf.read_field(saved)).freedom[0]
    options = "--flip --hint 3,3,20,90 --hint 1,4,30.5,-45 --side 36 --json".split()  # noqa: SIM905
    assert invoke(["shade", saved, *options, *side.option.split(), "-o", str(tmp_path)]) == 0
    report = json.loads((tmp_path / "surface.json").read_text())
    assert report == json.loads(capsys.readouterr().out)
    assert report["flipped"] is True
    assert report["concave"] == [list(side.place)]
    assert report["hints"] == [
        {"row": 3, "column": 3, "slant": 20.0, "tilt": 90.0},
        {"row": 1, "column": 4, "slant": 30.5, "tilt": -45.0},
    ]
    with Image.open(tmp_path / "overlay.png") as picture:
        assert picture.size == (36, 36)  # the grid


@for_each(
    "options, reason",
    [
        ("--size 12", "leave --size out"),
        ("--hint 1,2,3", "as in 12,30,45,90"),
        ("--hint 1,2,3,x", "as in 12,30,45,90"),
        ("--hint 1.5,2,3,4", "as in 12,30,45,90"),
        ("--hint 3,3,nan,4", "0 to less than 90"),
        ("--hint 0,0,30,90", "mask"),
        ("--concave 3", "as in 120,80.5"),
        ("--concave -9,nan", "outside the mask"),
        ("--hint 3,3,95,90", "90"),
        ("--side 100000", "on its longer side; give 1 to"),
        ("--underlay nothing.svg", "cannot be read"),
    ],
)
def test_bad_options_are_refused_in_one_line_and_no_file_is_written(options, reason, saved, tmp_path, capsys):
    assert invoke(["shade", saved, "-o", str(tmp_path / "out"), *options.split()]) == 1
    line = capsys.readouterr().err
    assert reason in line
    assert line.count("\n") == 1
    assert contents(tmp_path) == {}
