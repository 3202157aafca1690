"""Output of the commands: progress, tables that fit 80 columns, JSON, and one-line messages."""

from __future__ import annotations

import io
import json
import re
import shutil
import sys
import textwrap
import threading
import time
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import typer

from ...models.errors import CrossfieldError, printable
from ...models.processes.deadline import Progress, silent
from ..statuses import Status

if TYPE_CHECKING:
    from ...models.instance.instance import Instance
    from ...models.surface.surface import Surface
    from ..runs.report import Report

WIDTH: Final = 80
"""Columns of the tables where the output is no terminal."""

EVERY: Final = 5.0
"""Seconds between two lines of progress, and before the first one: shorter work prints no line."""

INTERRUPTED: Final = "interrupted; all written files are complete"


class InterruptedRunError(CrossfieldError):
    """Ctrl-C before there is a result to keep."""


@contextmanager
def show_progress(*, quiet: bool = False) -> Iterator[Progress]:
    """Function that shows the current step on standard error, unless quiet.

    A terminal shows it next to a spinner and the time; elsewhere it is a line every few seconds. Raises
    InterruptedRunError for Ctrl-C, unless the work itself handles it.
    """
    shown = nullcontext(silent) if quiet else _show_spinner() if sys.stderr.isatty() else _print_lines()
    try:
        with shown as show:
            yield show
    except KeyboardInterrupt as stop:
        raise InterruptedRunError(INTERRUPTED) from stop


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


@contextmanager
def _print_lines() -> Iterator[Progress]:
    """Function that sets the current step, which a thread prints every few seconds with the time so far."""
    steps, ended, begin = deque(["starting"], maxlen=1), threading.Event(), time.monotonic()

    def watch() -> None:
        with suppress(OSError, ValueError):  # the stream was closed: the work continues without lines
            while not ended.wait(EVERY):
                typer.echo(printable(f"[{time.monotonic() - begin:.0f} s] {steps[-1]}"), err=True)

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield steps.append
    finally:
        ended.set()
        thread.join()


def escape_unencodable() -> None:
    """Write characters that the encoding of the terminal lacks as escapes, rather than fail."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def print_line(text: str) -> None:
    """Print a line on standard output."""
    typer.echo(text, file=sys.stdout)  # another stream would lack the escapes of `escape_unencodable`


def print_json(value: object) -> None:
    """Print a value as JSON on standard output."""
    typer.echo(json.dumps(value, indent=1, allow_nan=False))


def print_notice(text: str) -> None:
    """Print one line on standard error."""
    typer.echo(f"crossfield: {printable(text)}", err=True)


def print_warnings(instance: Instance, *, quiet: bool) -> None:
    """Print the warnings of the drawing's reader on standard error, one per line, unless quiet."""
    reading = None if quiet else instance.reading
    for text in reading.warnings if reading else ():
        print_notice(f"warning: {instance.source}: {text}")


def show_table(
    title: str,
    columns: Sequence[str],
    rows: list[list[str]],
    *,
    numbers: Sequence[str] = (),
    header: bool = True,
) -> None:
    """Print a title and a table without broken words; the columns in `numbers` are right-aligned.

    If the longest words of a row do not fit next to each other, each cell is printed on its own line.
    """
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else WIDTH
    cells = [[printable(cell) for cell in row] for row in rows]
    shown = [list(columns), *cells] if header else cells
    print_line(typer.style(printable(title), bold=True))
    fitting = ((widths, gap) for gap in ("  ", " ") if (widths := _fit_widths(shown, width, len(gap))))
    widths, gap = next(fitting, (None, ""))
    if widths is None:
        for row in cells:
            named = (f"{name}: {cell}" for name, cell in zip(columns, row, strict=True))
            print_line("\n".join(_wrap(text, width) for text in named) + "\n")
        return
    if header:
        shown.insert(1, ["-" * column_width for column_width in widths])
    right = [name in numbers for name in columns]
    lines = [gap.join(parts).rstrip() for row in shown for parts in _wrap_row(row, widths, right)]
    print_line("\n".join([*lines, ""] if header else lines))


def _fit_widths(rows: list[list[str]], width: int, gap: int) -> list[int] | None:
    """Widths of columns that fit, the widest ones narrowed first; None if a word would break."""
    columns = list(zip(*rows, strict=True))
    least = [max(len(word) for cell in column for word in [*cell.split(), "-"]) for column in columns]
    most = [max(map(len, column)) for column in columns]
    room = width - gap * (len(columns) - 1)
    caps = ([max(n, min(m, cap)) for n, m in zip(least, most, strict=True)] for cap in range(room, -1, -1))
    return next((widths for widths in caps if sum(widths) <= room), None)


def _wrap_row(row: list[str], widths: list[int], right: list[bool]) -> list[list[str]]:
    """Lines of a row, in which longer cells are wrapped."""
    cells = [_wrap(cell, width, indent="").split("\n") for cell, width in zip(row, widths, strict=True)]
    return [
        [
            part.rjust(width) if at else part.ljust(width)
            for part, width, at in zip(line, widths, right, strict=True)
        ]
        for line in zip_longest(*cells, fillvalue="")
    ]


_LEGEND: Final = """\
  start: the field from which methods begin; off: mean angle from a stroke to
  the nearer line; <45°: {points} whose lines are less than 45 degrees apart;
  sing.: singularities; s: seconds"""


def show_report(report: Report, folder: Path) -> None:
    """Print the fields and files of a run, and which methods failed."""
    from ..runs.methods import table_cells

    gap = ("gap",) if report.proven else ()  # the bound is the same for all
    columns = ("method", "2-norm", *gap, "1-norm", "off", "<45°", "sing.", "s", "status")
    rows = []
    for candidate in report.candidates:
        facts = report.facts(candidate)
        mark = "*" if candidate is report.kept else ""
        rows.append([candidate.method + mark, *table_cells(facts), _describe_status(facts)])
    show_table(report.instance.summary, columns, rows, numbers=columns[1:-1])
    print_line(_LEGEND.format(points=f"{report.instance.domain.kind}s"))
    for candidate in report.candidates:
        if candidate.solution and (answer := _describe_gap(report.facts(candidate))):
            print_line(f"  {candidate.method} {answer}")
    kept_facts, best_facts = report.facts(report.kept), report.facts(report.best)
    print_line(f"* kept: {folder / 'field.npz'} (.json, .rawfield)")
    quantile = f"{kept_facts['stroke_deviation_90_percent_degrees']:.1f}°"
    far = f"{kept_facts['strokes_beyond_10_degrees']:.0%}"
    print_line(f"  90% of its strokes are at most {quantile} off, and {far} more than 10°")
    words = ", proven optimal" if best_facts.get("proven_optimal") else ""
    print_line(f"  least 2-norm energy{words}: {report.best.method}, {folder / 'lowest.npz'}")
    _print_proof(report, best_facts)
    if report.interrupted in ("", "surface") and report.instance.domain.kind == "pixel":
        print_line(f"  pictures: {folder / 'overview.png'} and others in the same folder")
        print_line(f"  layers in the coordinates of the drawing: {folder / 'overlay.svg'}")
    if report.surface is not None:
        doubts = "; ".join(report.surface.doubts)
        layers = f"surface, as layers for the drawing: {folder / 'shaded.png'} and normals.png"
        print_line(_wrap(f"no shaded surface: {doubts}; crossfield shade draws it" if doubts else layers))
    print_line(f"  {report.files} solver files: {folder / 'models'}; all facts: {folder / 'report.json'}")
    stages = ", ".join(f"{stage} {seconds:.1f}" for stage, seconds in report.stages.items())
    print_line(_wrap(f"{report.seconds:.1f} s: {stages}"))
    for candidate in report.candidates:
        if candidate.interrupted:
            print_notice(f"{candidate.method}: interrupted; its best field so far was kept")
    for method, reason in report.failures.items():
        print_notice(f"{method}: {reason}")


def _print_proof(report: Report, best: dict[str, Any]) -> None:
    """Print the bound; that none was proven is among the failures."""
    if report.proven:
        bound = f"{best['bound_2_norm']:.10g}"
        print_line(f"  no field has less than {bound}; certificate: {report.proven.certificate}")


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


def _describe_status(facts: dict[str, Any]) -> str:
    """Status of a solver's answer, or that it is the start, without a proof that the start is optimal."""
    status = str(facts.get("status", ""))
    return "start returned" if _has_returned_start(facts) else status


def _has_returned_start(facts: dict[str, Any]) -> bool:
    return bool(facts.get("start_returned")) and not Status(facts["status"]).is_optimal


def _describe_gap(facts: dict[str, Any]) -> str:
    """Gap between a solver's answer and its bound; empty if it is closed, or if there is no bound."""
    if Status(facts["status"]).is_optimal:
        return ""
    how = "returned its start" if _has_returned_start(facts) else ""
    if facts["gap"] is None:
        return how and f"{how}, without a bound"
    words = f"objective {facts['objective_recomputed']:.4g}, bound {facts['dual_bound']:.4g}"
    return f"{how or 'did not close its gap'}: {words}, gap {facts['gap']:.0%}"


def show_manifests(
    instance: Instance, documents: list[dict[str, Any]], folder: Path, *, complete: bool = False
) -> None:
    """Print the files of an export by their manifests, and the reasons for files that were refused.

    complete: whether all formulations were asked for, so that those left out are named.
    """
    from ...models.formulations.catalogue import FORMULATIONS, declare, reason_against

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


_ONLY_IF_ANY: Final = (
    "lifted",
    "furthest_rounding",
    "unknown_names",
    "contradictions",
    "claims",
    "interrupted",
    "dual_bound",
    "gap",
    "start_returned",
    "reason",
    "worst_family",
    "message",
)


def show_surface(surface: Surface, facts: dict[str, Any], folder: Path) -> None:
    """Print the fit of a surface, its undetermined parts, doubts about it, and the folder of its files.

    facts: its report.
    """
    show_facts(
        surface.instance.summary, {key: value for key, value in facts.items() if isinstance(value, float)}
    )
    for name, text in facts["support"].items():
        print_line(_wrap(f"{name}: {text}"))
    for text in surface.freedom:
        print_line(_wrap(f"undetermined: {text}"))
    if surface.freedom:
        print_line(
            _wrap("--flip turns it inside out, --hint ROW,COLUMN,SLANT,TILT gives the normal at a pixel")
        )
    for doubt in surface.doubts:
        print_notice(f"in doubt: {doubt}")
    pictures = facts["pictures"]
    print_line(_wrap(f"pictures show {pictures['show']}, {pictures['width']} x {pictures['height']} pixels"))
    print_line(f"pictures, heights, mesh: {folder}")


def show_facts(title: str, facts: dict[str, Any]) -> None:
    """Print facts as a table of two columns."""
    shown = {key: value for key, value in facts.items() if value or key not in _ONLY_IF_ANY}
    rows = [[key.replace("_", " "), _format_value(value)] for key, value in shown.items()]
    show_table(title, ("fact", "value"), rows, header=False)


def _format_value(value: object) -> str:
    if value is None:
        return "not in the file"
    if isinstance(value, list):
        return "; ".join(map(str, value))
    return f"{value + 0.0:.10g}" if isinstance(value, float) else str(value)


def show_lists(tables: dict[str, list[dict[str, Any]]]) -> None:
    """Print all tables, from samples to readers of solution files."""

    def show(title: str, name: str, *columns: str) -> None:
        columns = columns or tuple(tables[name][0])
        show_table(title, columns, [[str(row[column]) for column in columns] for row in tables[name]])

    show("samples", "samples")
    show("formulations", "formulations", "name", "short", "paper", "class", "summary")
    formats = [row["name"] for row in tables["formats"]]
    carried = [
        [row["name"], *(re.split("[:,]", row[name])[0] for name in formats)] for row in tables["formulations"]
    ]
    show_table("formulations in each format (--json: alternatives)", ("formulation", *formats), carried)
    (first, *bundled), rows = tables["solvers"][0], tables["solvers"]
    marked = [[row[first], *("yes" if row[name] == "yes" else "-" for name in bundled)] for row in rows]
    show_table("formulations that each bundled solver solves (--json: reasons)", (first, *bundled), marked)
    (first, *solvers), rows = tables["externals"][0], tables["externals"]
    takes = [[name, ", ".join(row[first] for row in rows if row[name] == "yes")] for name in solvers]
    title = "formulations whose optimum each solver proves from our files (--json: reasons)"
    show_table(title, ("solver", "formulations"), takes)
    show("formats", "formats")
    show("methods (of run; of solve --method, except prove)", "methods")
    show("readers of solution files", "readers")
