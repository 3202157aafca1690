"""Help of the commands: it fits 80 columns, states the names of tables, and its examples run."""

import re
import shlex

import pytest
import typer
from answers import by_highs
from crossfield.export.cli.app import app, invoke
from crossfield.export.formats.registry import FORMATS
from crossfield.export.library.plan.spec import RUNGS
from crossfield.export.pictures.draw import KINDS
from crossfield.export.runs.methods import METHODS
from crossfield.export.solvers_table import PROGRAMS, SOLVERS
from libraries import write_spec

NAMED = {
    "solve": {*METHODS, *SOLVERS} - {"prove"},
    "verify": PROGRAMS,
    "library get": RUNGS,
    "library solve": {*SOLVERS, *RUNGS},
    "export": FORMATS,
    "draw": KINDS,
}
"""Names that the help of a command states."""


def commands_of(group=None, prefix=""):
    """All commands by name."""
    for name, command in (group or typer.main.get_command(app)).commands.items():
        if hasattr(command, "commands"):
            yield from commands_of(command, f"{name} ")
        else:
            yield f"{prefix}{name}", command


def test_the_help_fits_80_columns_and_lists_the_names_of_tables(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TERM", "dumb")
    for command in ("", "library", *(name for name, _ in commands_of())):
        assert invoke([*command.split(), "--help"]) == 0
        shown = capsys.readouterr().out
        assert max(map(len, shown.splitlines())) <= 80, command
        words = re.sub(r"(?<=\w-)[\s│]+(?=\w)", "", shown)
        missing = [name for name in NAMED.get(command, ()) if not re.search(rf"(?<![\w-]){name}\b", words)]
        assert missing == [], command


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
    for name, command in commands_of():
        if name == "read":
            by_highs("files/skew.milp-mccormick.mps", "skew.sol")
        if name not in {"run", "studio"}:
            program, *arguments = shlex.split(command.epilog.removeprefix("Example: "))
            assert (program, invoke(arguments)) == ("crossfield", 0), name
