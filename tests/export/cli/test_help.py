"""The help of the commands: its names are those of the tables, and it fits a terminal of 80 columns."""

import re
import typing

import pytest
import typer
from crossfield.export.cli import options
from crossfield.export.cli.app import app, invoke
from crossfield.export.cli.help_texts import NAMES, Command, filled
from crossfield.export.formats.registry import FORMATS
from crossfield.models.formulations.declaration import FACETS
from crossfield.models.instance.instance import GAUGES
from crossfield.models.sketch.read import DEFAULT_SIZE
from typer.testing import CliRunner

NAMED = {
    "run": ["samples", "size", "methods"],
    "instance": ["samples", "size", "most weight", "stroke weight", "skew weight"],
    "export": ["samples", "size", "formulations", "short names", "formats", "default formats"],
    "solve": ["samples", "size", "formulations", "short names", "methods", "all solvers", "bundled solvers"],
    "prove": ["samples", "size"],
    "evaluate": ["samples", "size", "methods", "default methods"],
    "read": ["answers"],
    "draw": ["pictures"],
    "shade": ["samples", "size", "methods", "kept method", "picture side", "light"],
    "verify": ["programs"],
    "library solve": ["all solvers", "rungs"],
    "library submit": ["answers", "logs", "run statuses"],
}
OTHERS = (
    "",
    "list",
    "samples",
    "library",
    "library build",
    "library verify",
    "library release",
    "library site",
)


@pytest.fixture
def text(monkeypatch, capsys):
    """The help of a command at 80 columns, as lines and as words in a row."""
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TERM", "dumb")

    def shown(command):
        assert invoke([*command.split(), "--help"]) == 0
        return capsys.readouterr().out

    return shown


def words(shown):
    """The words of a help without its frames, names broken at hyphens put together."""
    cells = [re.sub(r"[│╭╮╰╯─]", " ", line) for line in shown.splitlines()]
    return re.sub(r"(?<=\w-) (?=\w)", "", " ".join(" ".join(cells).split()))


def test_the_help_names_what_the_tables_have_within_80_columns(text):
    for command in (*NAMED, *OTHERS):
        shown = text(command)
        assert max(map(len, shown.splitlines())) <= 80, command
        assert not re.search(r"\{[a-z ]+\}", shown), command
        for table in NAMED.get(command, ()):
            missing = [name for name in NAMES[table]() if not re.search(rf"\b{name}\b", words(shown))]
            assert missing == [], (command, table)


def test_brackets_in_a_help_are_shown(text):
    """Rich takes `[word]` for markup unless it is escaped."""
    assert "the table [release] of its specification" in words(text("library release"))
    toy = typer.Typer()

    @toy.command(cls=Command)
    def toy_command(option: typing.Annotated[str, typer.Option(help="A [bold] word.")] = "x") -> None:
        """Show [red] and {size} twice."""

    for _ in range(2):
        shown = words(CliRunner().invoke(toy, ["--help"]).output)
        assert f"Show [red] and {DEFAULT_SIZE} twice." in shown
        assert "A [bold] word." in shown


def test_every_table_in_a_help_is_named_there():
    assert set(NAMES) == {table for tables in NAMED.values() for table in tables}
    assert filled("{size}, at most") == f"{DEFAULT_SIZE}, at most"


def test_choices_are_those_of_the_models_and_of_the_formats():
    chosen = {
        options.GaugeName: GAUGES,
        options.Facet: FACETS,
        options.GamsLayout: FORMATS["gms"].dialects,
        options.NlForm: FORMATS["nl"].dialects,
    }
    for option, table in chosen.items():
        (literal, _) = typing.get_args(typing.get_args(option)[0])
        assert typing.get_args(literal) == tuple(table)


def test_commands_are_listed_in_the_order_of_their_use():
    assert list(typer.main.get_command(app).commands) == [
        "run", "instance", "export", "solve", "prove", "evaluate", "read", "draw", "shade", "verify",
        "list", "samples", "library",
    ]  # fmt: skip


def test_the_default_size_stands_once(tmp_path, capsys):
    import crossfield as cf

    drawing = tmp_path / "a.svg"
    drawing.write_text('<svg viewBox="0 0 9 9"><path d="M0 0L9 9M0 9L9 0" stroke="black"/></svg>')
    made = tmp_path / "a.json"
    assert invoke(["instance", str(drawing), "-o", str(made)]) == 0
    assert cf.read_instance(made).sha256 == cf.read_sketch(drawing).sha256
    assert max(cf.sample("skew").mask.shape) == max(cf.read_sketch(drawing).mask.shape) == DEFAULT_SIZE
    assert f"{DEFAULT_SIZE} x " in capsys.readouterr().out
