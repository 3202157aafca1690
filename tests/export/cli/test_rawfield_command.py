"""Fields by other programs on the command line, for pictures and as starts."""

import crossfield as cf
import pytest
from crossfield.export.cli.app import invoke


@pytest.fixture
def theirs(tmp_path):
    """Files of a raw field, the greedy field, and of its instance."""
    instance = cf.sample("bottle", 10)
    cf.write_instance(instance, tmp_path / "bottle.json")
    return cf.write_field(cf.greedy_field(instance), tmp_path / "theirs.rawfield"), tmp_path / "bottle.json"


def test_a_raw_field_is_drawn_on_its_instance(theirs, tmp_path):
    field, instance = theirs
    picture = tmp_path / "field.svg"
    assert invoke(["draw", str(field), "--on", str(instance), "-o", str(picture)]) == 0
    assert picture.exists()


def test_a_raw_field_alone_is_refused_with_the_remedy(theirs, tmp_path, capsys):
    assert invoke(["draw", str(theirs[0]), "-o", str(tmp_path / "field.svg")]) == 1
    assert "holds no instance; give its instance with --on" in capsys.readouterr().err


def test_a_field_of_another_instance_is_refused(theirs, tmp_path, capsys):
    other = cf.write_field(cf.greedy_field(cf.sample("mouse", 10)), tmp_path / "mouse.npz")
    assert invoke(["draw", str(other), "--on", str(theirs[1]), "-o", str(tmp_path / "field.svg")]) == 1
    assert "the field is on another instance" in capsys.readouterr().err


@pytest.mark.slow
def test_a_search_starts_at_a_raw_field(theirs, tmp_path):
    field, instance = theirs
    folder = tmp_path / "out"
    assert (
        invoke(
            [
                "solve",
                str(instance),
                "-m",
                "search",
                "--time-limit",
                "2",
                "--start",
                str(field),
                "-o",
                str(folder),
            ]
        )
        == 0
    )
    (found,) = folder.glob("*.field.npz")
    start = cf.read_field(field, on=cf.read_instance(instance)).energy().total
    assert cf.read_field(found).energy().total <= start + 1e-9
