"""Ranges of numbers that help texts state: both ends are accepted, and what lies beyond is refused."""

import re
from pathlib import Path

import crossfield as cf
import pytest
from crossfield.export.cli.app import invoke
from meshes import box, write_obj

RANGES = {  # a command and an option; accepted ends; refused numbers; the words of the help
    "instance box.obj --sharp": (["1e-9", "180"], ["0", "-1", "180.1", "nan"], "above 0 (flat), up to 180"),
    "instance mouse --size 24 --stroke-weight": (["0", "1e6"], ["-1e-9", "1000001"], "0 to 1,000,000"),
    "instance mouse --size 24 --skew-weight": (["0", "1e6"], ["-1e-9", "1000001"], "0 to 1,000,000"),
    "solve tiny.json -m greedy --time-limit": (["0.1"], ["0.09"], "x>=0.1"),
    "export tiny.json -f milp -F lp --stroke-norm": (["1", "2"], ["0", "3", "1.5"], "1<=x<=2"),
    "export tiny.json -f milp -F lp --beta-norm": (["1", "2"], ["0", "3"], "1<=x<=2"),
}


@pytest.fixture(autouse=True)
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_obj(Path("box.obj"), box())
    cf.write_instance(cf.sample("skew", 4), "tiny.json")


@pytest.mark.parametrize("line", RANGES)
def test_the_range_in_the_help_is_the_one_that_is_accepted(line, capsys):
    accepted, refused, words = RANGES[line]
    command, *rest = line.split()
    assert invoke([command, "--help"]) == 0
    shown = re.sub(r"[\s│]+", " ", capsys.readouterr().out)
    option = shown[shown.rindex(f" {rest[-1]} ") :][:600]
    assert words in option
    for number, value in enumerate(accepted):
        output = f"out{number}.json" if command == "instance" else f"out{number}"
        assert invoke([command, *rest, value, "-o", output]) == 0, value
    for value in refused:
        output = "refused.json" if command == "instance" else "refused"
        assert invoke([command, *rest, value, "-o", output]) != 0, value
        assert not Path(output).exists()
