"""Help of the commands: it lists the names of the tables and fits a terminal of 80 columns."""

import re
import shlex
from typing import Annotated

import highspy
import pytest
import typer
from crossfield.export.cli.app import app, invoke
from crossfield.export.cli.help_texts import Command
from crossfield.export.formats.registry import FORMATS
from crossfield.export.library.plan.spec import RUNGS
from crossfield.export.pictures.draw import KINDS
from crossfield.export.runs.methods import METHODS
from crossfield.export.solvers_table import PROGRAMS, SOLVERS
from crossfield.models.formulations.catalogue import FORMULATIONS, short_names
from crossfield.models.sketch.read import DEFAULT_SIZE
from crossfield.models.sketch.samples import SAMPLES
from typer.testing import CliRunner

NAMED = {
    "run": [SAMPLES, METHODS],
    "instance": [SAMPLES],
    "export": [SAMPLES, FORMULATIONS, short_names(), FORMATS],
    "solve": [SAMPLES, FORMULATIONS, short_names(), METHODS, SOLVERS],
    "prove": [SAMPLES],
    "read": [],
    "draw": [KINDS],
    "shade": [SAMPLES],
    "verify": [PROGRAMS],
    "library solve": [SOLVERS, RUNGS],
    "library build": [],
}
"""Tables whose names the help of a command lists."""
OTHERS = (
    "",
    "studio",
    "list",
    "library",
    "library verify",
)


SPECIFICATION = """
format = "crossfield-library-spec"
version = 1
title = "A small library"
formulations = ["milp-mccormick", "miqp-exact"]

[rungs.tiny]
sizes = [5]
formats = ["mps", "nl"]

[release]
version = "1.0.0"
date = "2026-01-31"
authors = ["The crossfield authors"]

[[sketches]]
name = "skew"
sample = "skew"
"""


@pytest.fixture
def text(monkeypatch, capsys):
    """Function that returns the help of a command on a terminal of 80 columns."""
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TERM", "dumb")

    def shown(command):
        assert invoke([*command.split(), "--help"]) == 0
        return capsys.readouterr().out

    return shown


def words(shown):
    """Words of a help text without its frames; names that are broken at hyphens are joined."""
    cells = [re.sub(r"[│╭╮╰╯─]", " ", line) for line in shown.splitlines()]
    return re.sub(r"(?<=\w-) (?=\w)", "", " ".join(" ".join(cells).split()))


def test_the_help_lists_the_names_of_the_tables_within_80_columns(text):
    for command in (*NAMED, *OTHERS):
        shown = text(command)
        assert max(map(len, shown.splitlines())) <= 80, command
        assert not re.search(r"\{[a-z ]+\}", shown), command
        for table in NAMED.get(command, ()):
            missing = [name for name in table if not re.search(rf"\b{name}\b", words(shown))]
            assert missing == [], command


@pytest.mark.parametrize("markup", ["rich", None])
def test_brackets_in_a_help_are_shown(text, markup):
    """Rich parses `[word]` as markup unless it is escaped; other modes print the escape."""
    toy = typer.Typer(rich_markup_mode=markup)

    @toy.command(cls=Command)
    def toy_command(option: Annotated[str, typer.Option(help="A [bold] word.")] = "x") -> None:
        """Show [red] and {size} twice."""

    for _ in range(2):
        shown = words(CliRunner().invoke(toy, ["--help"]).output)
        assert f"Show [red] and {DEFAULT_SIZE} twice." in shown
        assert "A [bold] word." in shown


def test_files_and_samples_have_the_same_default_size(tmp_path, capsys):
    import crossfield as cf

    drawing = tmp_path / "a.svg"
    drawing.write_text('<svg viewBox="0 0 9 9"><path d="M0 0L9 9M0 9L9 0" stroke="black"/></svg>')
    written = tmp_path / "a.json"
    assert invoke(["instance", str(drawing), "-o", str(written)]) == 0
    assert cf.read_instance(written).sha256 == cf.read_sketch(drawing).sha256
    assert max(cf.sample("skew").mask.shape) == max(cf.read_sketch(drawing).mask.shape) == DEFAULT_SIZE
    assert f"{DEFAULT_SIZE} x " in capsys.readouterr().out


def commands_of(group=None, prefix=""):
    """All commands by name."""
    for name, command in (group or typer.main.get_command(app)).commands.items():
        if hasattr(command, "commands"):
            yield from commands_of(command, f"{name} ")
        else:
            yield f"{prefix}{name}", command


def test_every_help_ends_with_an_example_and_shows_what_is_written_in_a_panel_of_its_own(text):
    for name in (*(name for name, _ in commands_of()), "", "library"):
        shown = text(name)
        _, example = words(shown).split("Example: ")
        assert example.startswith(" ".join(("crossfield", *name.split()))), name
        for panel in re.split(r"^╭─ ", shown, flags=re.MULTILINE):
            written = set(re.findall(r"^│[ *]+--(output|force|quiet|json) ", panel, re.MULTILINE))
            assert bool(written) == panel.startswith("Output ─"), name


@pytest.mark.slow
def test_examples_run(tmp_path, monkeypatch):
    """Each example uses files of earlier ones.

    The README has that of `run`, and its commands are run. That of `studio` serves until it is stopped.
    """
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.toml").write_text(SPECIFICATION)
    for name, command in commands_of():
        if name == "read":
            solver = highspy.Highs()
            solver.readModel("files/skew.milp-mccormick.mps")
            solver.run()
            solver.writeSolution("skew.sol", 0)
        if name not in {"run", "studio"}:
            program, *arguments = shlex.split(command.epilog.removeprefix("Example: "))
            assert (program, invoke(arguments)) == ("crossfield", 0), name
