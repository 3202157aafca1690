"""Output of the commands: progress, tables that fit 80 columns, JSON, and one-line messages."""

from __future__ import annotations

import io
import json
import re
import shutil
import sys
import textwrap
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import typer

from ...models.errors import printable
from ...models.processes.deadline import Progress, silent
from ..statuses import Status

if TYPE_CHECKING:
    from ...models.instance.instance import Instance
    from ...models.surface.surface import Surface
    from ..runs.report import Report

WIDTH: Final = 80
"""Columns of the tables where the output is no terminal."""

_NARROWEST: Final = 30  # columns for the last cells of a table


def show_progress() -> AbstractContextManager[Progress]:
    """Function that shows the current step on a terminal, next to a spinner and the time."""
    return _show_spinner() if sys.stderr.isatty() else nullcontext(silent)


@contextmanager
def _show_spinner() -> Iterator[Progress]:
    """Function that shows the current step next to a spinner and the time."""
    from rich import progress as rich
    from rich.console import Console

    columns = (
        rich.SpinnerColumn(),
        rich.TextColumn("{task.description}", markup=False),
        rich.TimeElapsedColumn(),
    )
    with rich.Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("starting")
        yield lambda text: bar.update(task, description=text)


def escape_unencodable() -> None:
    """Write characters that the encoding of the terminal lacks as escapes, rather than fail."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def print_line(text: str) -> None:
    """Print a line on standard output."""
    typer.echo(text, file=sys.stdout)  # another stream would lack the escapes of `escape_unencodable`


def print_result(document: object, show: Callable[[], None], *, as_json: bool) -> None:
    """Print a document as JSON, or call the function that shows it."""
    if as_json:
        typer.echo(json.dumps(document, indent=1, allow_nan=False))
    else:
        show()


def print_facts(title: str, facts: dict[str, Any], *lines: str, as_json: bool) -> None:
    """Print facts as JSON, or as a table with some lines below."""

    def show() -> None:
        show_facts(title, facts)
        for line in lines:
            print_line(line)

    print_result(facts, show, as_json=as_json)


def print_notice(text: str) -> None:
    """Print one line on standard error."""
    typer.echo(f"crossfield: {printable(text)}", err=True)


def show_table(
    title: str,
    columns: Sequence[str],
    rows: list[list[str]],
    *,
    numbers: Sequence[str] = (),
    header: bool = True,
) -> None:
    """Print a title and a table; columns in `numbers` are right-aligned, and the last one is wrapped."""
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else WIDTH
    shown = [[printable(cell) for cell in row] for row in ([list(columns), *rows] if header else rows)]
    widths = [max(map(len, column)) for column in zip(*shown, strict=True)]
    if header:
        shown.insert(1, ["-" * wide for wide in widths[:-1]] + ["-" * len(columns[-1])])
    last = max(width - sum(widths[:-1]) - 2 * len(widths) + 2, _NARROWEST)
    print_line(typer.style(printable(title), bold=True))
    for *cells, text in shown:
        parts = zip(cells, widths, columns, strict=False)
        lead = "".join(
            (cell.rjust(wide) if name in numbers else cell.ljust(wide)) + "  " for cell, wide, name in parts
        )
        lines = _wrap(text, last, indent="").split("\n")
        print_line("\n".join((lead if k == 0 else " " * len(lead)) + line for k, line in enumerate(lines)))
    if header:
        print_line("")


_LEGEND: Final = """\
  start: the field from which methods begin; off: mean angle from a stroke to
  the nearer line; <45°: {points} whose lines are less than 45 degrees apart;
  sing.: singularities; s: seconds"""


def show_report(report: Report, folder: Path) -> None:
    """Print the fields and files of a run, and which methods failed."""
    from ..runs.methods import table_cells

    gap = ("gap",) if report.proof else ()  # the bound is the same for all
    columns = ("method", "2-norm", *gap, "1-norm", "off", "<45°", "sing.", "s", "status")
    rows = []
    for candidate in report.candidates:
        facts = report.facts(candidate)
        mark = "*" if candidate is report.kept else ""
        rows.append([candidate.method + mark, *table_cells(facts), _describe_status(facts)])
    show_table(report.instance.summary, columns, rows, numbers=columns[1:-1])
    print_line(_LEGEND.format(points=f"{report.instance.domain.kind}s"))
    print_line(f"* kept: {folder / 'field.npz'} (.json, .rawfield)")
    words = ", proven optimal" if report.facts(report.best).get("proven_optimal") else ""
    print_line(f"  least 2-norm energy{words}: {report.best.method}, {folder / 'lowest.npz'}")
    if report.proof:
        bound = f"{report.facts(report.best)['bound_2_norm']:.10g}"
        certificate = report.folder / report.proof["certificate"]
        print_line(f"  no field has less than {bound}; certificate: {certificate}")
    if report.surface is not None:
        layers = f"surface, as layers for the drawing: {folder / 'shaded.png'} and normals.png"
        missing = "no shaded surface: time was over before it had settled; crossfield shade draws it"
        print_line(_wrap(layers if report.shaded else missing))
        _show_choices(report.surface)
    print_line(f"  {report.files} solver files: {folder / 'models'}; all results: {folder / 'index.html'}")
    print_line(f"  {report.seconds:.1f} s in all")
    for candidate in report.candidates:
        if candidate.interrupted:
            print_notice(f"{candidate.method}: interrupted; its best field so far was kept")
    for method, reason in report.failures.items():
        print_notice(f"{method}: {reason}")


def _describe_status(facts: dict[str, Any]) -> str:
    """Status of a solver's answer, or that it is the start, without a proof that the start is optimal."""
    status = str(facts.get("status", ""))
    return "start returned" if facts.get("start_returned") and not Status(status).is_optimal else status


def _wrap(text: str, width: int = WIDTH, indent: str = "  ") -> str:
    """The text in lines of at most this width, unless a word is longer."""
    return textwrap.fill(
        text,
        width,
        initial_indent=indent,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    )


def show_manifests(
    instance: Instance, documents: list[dict[str, Any]], folder: Path, *, complete: bool = False
) -> None:
    """Print the files of an export by their manifests, and the reasons for files that were refused.

    complete: whether all formulations were asked for, so that those left out are named.
    """
    from ...models.formulations.catalogue import FORMULATIONS
    from ...models.formulations.choice import declare, reason_against

    names = list(dict.fromkeys(name for document in documents for name in _sizes_of_models(document)))
    columns = ("formulation", "class", "columns", "rows", *names)
    rows = []
    for document in documents:
        sizes, counts = _sizes_of_models(document), document["counts"]
        written = [f"{sizes[name] / 1e3:.0f}" if name in sizes else "-" for name in names]
        size = [str(counts["columns"]), str(counts["rows"])]
        rows.append([document["formulation"], document["class"], *size, *written])
    show_table(f"{instance.summary}; files in kB", columns, rows, numbers=columns[2:])
    for document in documents:
        for reason in document["refused"].values():
            print_line(f"not written: {reason}")
    present = {document["formulation"] for document in documents}
    left_out = [name for name in FORMULATIONS if complete and name not in present]
    for reason in dict.fromkeys(reason_against(declare(name), instance) for name in left_out):
        print_line(f"not written: {', '.join(left_out)}, which {reason}")
    print_line(f"files: {folder}")


def _sizes_of_models(document: dict[str, Any]) -> dict[str, int]:
    """Size in bytes of the model file in each format."""
    from ..formats.registry import FORMATS

    models = (file for file in document["files"] if FORMATS[file["format"]].is_model(file["name"]))
    return {file["format"]: file["bytes"] for file in models}


def show_surface(surface: Surface, facts: dict[str, Any], folder: Path) -> None:
    """Print the fit of a surface, its undetermined parts, and the folder of its files.

    facts: its report.
    """
    show_facts(
        surface.instance.summary, {key: value for key, value in facts.items() if isinstance(value, float)}
    )
    for name, text in facts["support"].items():
        print_line(_wrap(f"{name}: {text}"))
    _show_choices(surface)
    pictures = facts["pictures"]
    print_line(_wrap(f"pictures show {pictures['show']}, {pictures['width']} x {pictures['height']} pixels"))
    print_line(f"pictures, heights, mesh: {folder}")


def _show_choices(surface: Surface) -> None:
    """Print what crosses leave undetermined, with the options of `shade` that decide it."""
    for choice in surface.freedom:
        print_line(_wrap(f"undetermined: {choice}; choose, for example with shade {choice.option}"))


def show_facts(title: str, facts: dict[str, Any]) -> None:
    """Print the known facts as a table of two columns."""
    known = {key: value for key, value in facts.items() if value or (value == 0 and value is not False)}
    rows = [[key.replace("_", " "), _format_value(value)] for key, value in known.items()]
    show_table(title, ("fact", "value"), rows, header=False)


def _format_value(value: object) -> str:
    if isinstance(value, list):
        return "; ".join(map(str, value))
    return f"{value + 0.0:.10g}" if isinstance(value, float) else str(value)


def show_lists(tables: dict[str, list[dict[str, Any]]]) -> None:
    """Print all tables, from samples to readers of solution files."""

    def show(title: str, name: str, *columns: str) -> None:
        columns = columns or tuple(tables[name][0])
        show_table(title, columns, [[str(row[column]) for column in columns] for row in tables[name]])

    show("samples", "samples")
    show("formulations", "formulations", "name", "short", "class", "summary")
    formats = [row["name"] for row in tables["formats"]]
    carried = [
        [row["name"], *(re.split("[:,]", row[name])[0] for name in formats)] for row in tables["formulations"]
    ]
    show_table("formulations in each format (--json: alternatives)", ("formulation", *formats), carried)
    (first, *solvers), rows = tables["solvers"][0], tables["solvers"]
    takes = [[name, ", ".join(row[first] for row in rows if row[name] == "yes")] for name in solvers]
    title = "formulations whose optimum each solver proves from our files (--json: reasons)"
    show_table(title, ("solver", "formulations"), takes)
    show("formats", "formats", "name", "written", "summary")
    show("methods (of run; of solve --method, except prove)", "methods")
    show("readers of solution files", "readers")
