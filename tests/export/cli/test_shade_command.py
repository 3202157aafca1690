"""The command `shade`: its inputs, its files and its errors."""

import json

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.cli.app import invoke
from crossfield.export.surfaces.files import FILES
from folders import contents
from PIL import Image


@pytest.fixture(scope="module")
def field():
    """A field on a small sample."""
    return cf.bend_field(cf.polyvector_field(cf.sample("mouse", 12)))


@pytest.fixture
def saved(field, tmp_path):
    """Path of a file with that field."""
    return str(cf.write_field(field, tmp_path / "saved.npz"))


def report(folder):
    return json.loads((folder / "surface.json").read_text())


def test_a_sample_gets_its_field_and_its_surface(tmp_path, capsys):
    command = ["shade", "mouse", "--size", "12", "--side", "48", "-o", str(tmp_path / "out")]
    assert invoke(command) == 0
    out = capsys.readouterr().out
    assert "mouse: 12 x 11" in out
    assert "undetermined: inside out it has the same crosses" in out
    assert "--flip" in out
    assert "pictures show the page of the drawing, 48 x 40 pixels" in out
    assert str(tmp_path / "out") in out
    assert set(contents(tmp_path / "out")) == {*FILES, "field.npz"}
    assert report(tmp_path / "out")["method"] == "bend"
    field = cf.read_field(tmp_path / "out" / "field.npz")
    lifted = cf.surface(field)
    heights = np.load(tmp_path / "out" / "heights.npy")
    assert np.array_equal(heights, lifted.heights, equal_nan=True)
    cf.write_surface(lifted, tmp_path / "again", drawing="mouse", side=48)
    for name in set(FILES) - {"surface.json"}:
        assert (tmp_path / "again" / name).read_bytes() == (tmp_path / "out" / name).read_bytes(), name


def test_a_saved_field_is_flipped_hinted_and_lit(saved, tmp_path, capsys):
    plain, turned = tmp_path / "plain", tmp_path / "turned"
    assert invoke(["shade", saved, "--side", "36", "-q", "-o", str(plain)]) == 0
    assert capsys.readouterr().out == ""
    options = "--flip --hint 5,6,20,90 --hint 2,8,30.5,-45 --light 0,30 --underlay mouse".split()  # noqa: SIM905
    assert invoke(["shade", saved, *options, "--side", "36", "--json", "-o", str(turned)]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert report(turned) == printed | {"files": FILES}
    assert printed["method"] is None
    assert printed["flipped"] is True
    assert printed["hints"] == [
        {"row": 5, "column": 6, "slant": 20.0, "tilt": 90.0},
        {"row": 2, "column": 8, "slant": 30.5, "tilt": -45.0},
    ]
    assert printed["light"] == {"azimuth": 0.0, "elevation": 30.0}
    with Image.open(plain / "overlay.png") as one, Image.open(turned / "overlay.png") as other:
        assert (one.size, other.size) == ((36, 33), (36, 30))  # the grid, and the page of the drawing
    assert "field.npz" not in {path.name for path in plain.iterdir()}


def test_a_rawfield_and_an_instance_are_taken(field, tmp_path):
    cf.write_field(field, tmp_path / "f.rawfield")
    cf.write_instance(field.instance, tmp_path / "i.json")
    instance = str(tmp_path / "i.json")
    options = ["-q", "--side", "24", "-o"]
    raw = ["shade", str(tmp_path / "f.rawfield"), "--on", instance, *options, str(tmp_path / "raw")]
    assert invoke(raw) == 0
    plain = ["shade", instance, *options, str(tmp_path / "made")]
    assert invoke(plain) == 0
    assert report(tmp_path / "made")["method"] == "bend"
    assert report(tmp_path / "raw")["instance"] == report(tmp_path / "made")["instance"]


REFUSED = [
    (["--hint", "1,2,3"], "give numbers as in 12,30,45,90"),
    (["--hint", "1,2,3,x"], "give numbers as in 12,30,45,90"),
    (["--hint", "1.5,2,3,4"], "row and column must be whole numbers"),
    (["--hint", "1,2,nan,4"], "give numbers as in 12,30,45,90"),
    (["--hint", "0,0,30,90"], "mask"),
    (["--hint", "5,5,95,90"], "90"),
    (["--light", "30"], "give numbers as in 135,45"),
    (["--light", "30,-20"], "elevation is between 0 and 90"),
    (["--side", "100000"], "on its longer side; give 1 to"),
    (["--size", "12"], "is a field, which has its own grid"),
    (["--underlay", "nothing.svg"], "cannot be read"),
]


def test_bad_options_are_refused_in_one_line_and_no_file_is_written(saved, tmp_path, capsys):
    for options, reason in REFUSED:
        assert invoke(["shade", saved, "-q", "-o", str(tmp_path / "out"), *options]) == 1, options
        line = capsys.readouterr().err
        assert reason in line, (options, line)
        assert len(line.splitlines()) == 1
        assert not (tmp_path / "out").exists() or not any((tmp_path / "out").iterdir())
    assert invoke(["shade", "nothing", "-o", str(tmp_path / "out")]) == 1
    assert "no such file and no such sample" in capsys.readouterr().err
    (tmp_path / "bad.npz").write_bytes(b"no archive")
    assert invoke(["shade", str(tmp_path / "bad.npz"), "-o", str(tmp_path / "out")]) == 1
    assert "is neither a field" in capsys.readouterr().err
