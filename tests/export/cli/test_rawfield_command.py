"""Fields by other programs on the command line, for pictures and as starts."""

from pathlib import Path

import crossfield as cf
import pytest
from crossfield.export.cli.app import invoke


@pytest.fixture(autouse=True)
def files(tmp_path, monkeypatch):
    """A raw field, its instance, and a field on another instance, in the current folder."""
    monkeypatch.chdir(tmp_path)
    instance = cf.sample("bottle", 10)
    cf.write_instance(instance, "bottle.json")
    cf.write_field(cf.greedy_field(instance), "theirs.rawfield")
    cf.write_field(cf.greedy_field(cf.sample("mouse", 10)), "mouse.npz")


def test_a_raw_field_is_drawn_on_its_instance_and_no_other(capsys):
    assert invoke(["draw", "theirs.rawfield", "--on", "bottle.json", "-o", "field.svg"]) == 0
    assert Path("field.svg").exists()
    assert invoke(["draw", "theirs.rawfield", "-o", "other.svg"]) == 1
    assert "holds no instance; give its instance with --on" in capsys.readouterr().err
    assert invoke(["draw", "mouse.npz", "--on", "bottle.json", "-o", "other.svg"]) == 1
    assert "the field is on another instance" in capsys.readouterr().err


@pytest.mark.slow
def test_a_search_starts_at_a_raw_field():
    line = "solve bottle.json -m search --time-limit 2 --start theirs.rawfield -o {}"
    assert invoke(line.format("out").split()) == 0
    (path,) = Path("out").glob("*.field.npz")
    start = cf.read_field("theirs.rawfield", on=cf.read_instance("bottle.json")).energy().total
    assert cf.read_field(path).energy().total <= start + 1e-9
