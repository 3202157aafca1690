"""A size that does not suit a sketch is skipped with a message, and the library verifies."""

import json

import pytest
from children import complaints
from crossfield.export.cli.app import invoke
from crossfield.export.library.building.build import build
from crossfield.export.library.building.verification import verify_library
from crossfield.export.library.plan.spec import read_spec
from crossfield.models.errors import InputError
from libraries import HEAD

pytestmark = [pytest.mark.usefixtures("short_searches"), pytest.mark.slow]

SPEC = """formulations = ["milp", "qp"]
[rungs.tiny]
sizes = [2, 3]
formats = ["mps"]
gauges = ["strokes", "box"]
prove = false
[[sketches]]
name = "bottle"
sample = "bottle"
sizes = { tiny = [3] }
"""
MOUSE = '[[sketches]]\nname = "mouse"\nsample = "mouse"\n'
COARSE = "its outline leaves no room for a curvature line on so coarse a grid; choose a larger size"


@pytest.fixture
def spec(tmp_path):
    path = tmp_path / "spec.toml"
    path.write_text(HEAD + SPEC + MOUSE)
    return path


def test_a_size_that_does_not_suit_is_skipped_with_a_message(spec, tmp_path, capfd):
    folder = tmp_path / "library"
    assert invoke(["library", "build", str(spec), "-o", str(folder)]) == 0
    shown = capfd.readouterr()
    names = ["cf_bottle_n003", "cf_bottle_n003_box"]
    assert shown.out == f"{folder}: 8 entries, 2 instances skipped\n"
    stated = complaints(shown.err).splitlines()
    assert [line for line in stated if "is skipped" in line] == stated
    assert all(f"{name} is skipped: {COARSE}" in line for name, line in zip(names, stated, strict=True))
    index = json.loads((folder / "library.json").read_text())
    assert index["skipped"] == dict.fromkeys(names, COARSE)
    assert {name.split("_")[1] for name in index["entries"]} == {"mouse"}
    assert not list(folder.glob("cf_bottle_n*"))
    assert "Omitted" in (folder / "README.md").read_text()
    assert verify_library(folder) == []
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert invoke(["library", "build", str(spec), "-o", str(folder), "-q", "--jobs", "2"]) == 0
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_a_library_of_which_nothing_is_left_is_an_error(spec, tmp_path):
    spec.write_text(HEAD + SPEC)
    with pytest.raises(InputError, match="none of its instances can be made; cf_bottle_n003"):
        build(read_spec(spec), tmp_path / "library")
    assert not (tmp_path / "library" / "library.json").exists()
