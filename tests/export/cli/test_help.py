"""Help of the commands: it fits 80 columns, states the names of tables, and its examples run."""

import re
import shlex

import crossfield as cf
import pytest
from answers import by_highs
from command_line import examples, invoke
from libraries import write_spec

UNKNOWN = {
    "solve": ("solve skew -m none -o a", "solve skew -f qp-fixed --solver none -o a"),
    "verify": ("verify . --program none",),
    "library get": ("library get --rung none -o a",),
    "library solve": ("library get --rung none -o a", "library solve . --solver none"),
    "export": ("export skew -F none -o a",),
    "draw": ("draw it.json -o a.png --kind none",),
}
"""By command: lines with an unknown name, whose refusals state the names that the help has to state."""


def test_the_help_fits_80_columns_and_lists_the_names_of_tables(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    cf.write_instance(cf.sample("skew", 4), "it.json")
    commands = ["", "library", *dict(examples())]
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TERM", "dumb")
    for command in commands:
        assert invoke([*command.split(), "--help"]) == 0
        shown = capsys.readouterr().out
        assert max(map(len, shown.splitlines())) <= 80, command
        words = re.sub(r"(?<=\w-)[\s│]+(?=\w)", "", shown)
        for line in UNKNOWN.get(command, ()):
            assert invoke(line.split()) == 1
            names = {*re.findall(r"[\w-]+", capsys.readouterr().err.partition("; choose one of ")[2])}
            assert len(names) > 3
            missing = [name for name in names if not re.search(rf"(?<![\w-]){name}\b", words)]
            assert set(missing) <= {"prove"}, command  # a command of its own


SPECIFICATION = """formulations = ["milp-mccormick", "miqp-exact"]
[rungs.tiny]
sizes = [5]
formats = ["mps", "nl"]
[[sketches]]
name = "skew"
sample = "skew"
points = "greedy"
"""


@pytest.mark.slow
def test_examples_run(tmp_path, monkeypatch):
    """Each example uses files of earlier ones.

    The README has that of `run`, and its commands are run. That of `studio` serves until it is stopped.
    """
    monkeypatch.chdir(tmp_path)
    write_spec(tmp_path, SPECIFICATION).rename("small.toml")
    for name, example in examples():
        if name == "read":
            by_highs("files/skew.milp-mccormick.mps", "skew.sol")
        if name not in {"run", "studio"}:
            program, *arguments = shlex.split(example)
            assert (program, invoke(arguments)) == ("crossfield", 0), name
