"""The commands of `library`: build, get, solve, verify, submit, site."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from .help_texts import FACTS, Group
from .option_groups import command as command_of
from .options import Folder, PrintOptions, Processes, Seconds
from .output import print_line, print_notice, show_progress, show_table

if TYPE_CHECKING:
    from ..library.contributions.submit import Submission

_SUMMARY: Final = (
    "Build, check, solve and show a library: instances in every formulation, with best known points."
)

library = typer.Typer(
    cls=Group,
    help=f"Example: crossfield library build default -o library\n\n{_SUMMARY}",
    short_help=_SUMMARY,
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
command = partial(command_of, library)

_fact = partial(typer.Option, rich_help_panel=FACTS)

Machine = Annotated[str | None, _fact("--machine", metavar="TEXT", help="Processor and memory.")]
Library = Annotated[Path, typer.Argument(metavar="DIR", help="Folder that `crossfield library build` wrote.")]


@command("build")
def build_command(
    spec: Annotated[
        str,
        typer.Argument(metavar="SPEC", help="Specification (.toml), or `default` for the one that ships."),
    ],
    output: Folder,
    *,
    jobs: Processes = 1,
    scheduler: Annotated[
        str | None,
        typer.Option("--scheduler", metavar="ADDRESS", help="Build on the workers of a dask scheduler."),
    ] = None,
    search: Annotated[
        bool,
        typer.Option("--search", help="Search for points and proofs even where the specification has them."),
    ] = False,
    printing: PrintOptions,
) -> None:
    """Build a library: every instance that the specification asks for, in its formulations and formats.

    Each entry (an instance in one formulation) has its best known point, and a sidecar: a JSON file with all
    facts about it. Complete files in the folder are kept, so an interrupted build continues.
    A size that is too small for a sketch is skipped with a message. A tightened entry awaits its certificate.
    library.json lists both.
    """
    from dataclasses import replace

    from ..library.building.build import build, records_of_changed_problems
    from ..library.plan.spec import default_spec, read_spec

    with show_progress(quiet=printing.quiet) as show:
        show("reading the specification")
        wanted = default_spec() if spec == "default" else read_spec(spec)
        wanted = replace(wanted, points=None) if search else wanted
        built = build(wanted, output, jobs=jobs, scheduler=scheduler, progress=show)
    waiting = sum(name.endswith("_tight") for name in built.skipped)
    too_small = {name: why for name, why in built.skipped.items() if not name.endswith("_tight")}
    line = f"{output}: {len(built.document['entries'])} entries"
    line += f", {len(too_small)} instances skipped" if too_small else ""
    line += f"; {waiting} tightened entries await a certificate" if waiting else ""
    printing.show(built.document, lambda: print_line(line))
    for name, reason in too_small.items():
        print_notice(f"{name} is skipped: {reason}")
    if stale := sorted({record.entry for record in records_of_changed_problems(built)}):
        print_notice(
            f"{output / 'ledger.json'}: records of {len(stale)} entries do not count, for their problems have"
            f" changed since: {', '.join(stale[:3])}{', ...' if stale[3:] else ''}; measure them again with"
            " `crossfield library solve`"
        )


@command("get")
def get_command(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="NAME...", help="Entries; by default all that are selected.")
    ] = None,
    *,
    rung: Annotated[
        str | None, typer.Option("--rung", metavar="RUNG", help="Only entries of this rung: {rungs}.")
    ] = None,
    output: Folder,
    printing: PrintOptions,
) -> None:
    """Write model files of the library that ships, without a build: the same bytes as a build.

    Each entry comes with its instance and a manifest, with which `crossfield read` reads an answer back.
    Names and --rung select entries together; at least one of them is needed.
    """
    from ...models.errors import InputError
    from ..library.building.shipped_entries import entries, entry, write_entries

    if not names and rung is None:
        raise InputError("no entry is selected; name entries, or select them with --rung")
    asked = {entry(name).name for name in names or []}
    chosen = [one for one in entries(rung=rung) if not asked or one.name in asked]
    if not chosen:
        raise InputError("no entry of the library that ships is selected; relax --rung")
    with show_progress(quiet=printing.quiet) as show:
        written = write_entries(output, chosen, progress=show)
    number = sum(map(len, written.values()))
    printing.show(written, lambda: print_line(f"{output}: {number} files of {len(written)} entries"))


@command("solve")
def solve_command(
    folder: Library,
    *,
    solver: Annotated[
        list[str] | None,
        typer.Option(
            "--solver",
            metavar="NAME",
            help="{all solvers}; those that are installed by default, may be repeated.",
        ),
    ] = None,
    time_limit: Seconds = 10.0,
    up_to: Annotated[
        str | None,
        typer.Option("--up-to", metavar="RUNG", help="Largest rung (class of sizes) to solve: {rungs}."),
    ] = None,
    by: Annotated[
        str | None,
        _fact("--by", metavar="TEXT", help="Name of the person who runs them, for the ledger."),
    ] = None,
    machine: Machine = None,
    printing: PrintOptions,
) -> None:
    """Run the installed solvers on a library and add bounds, times and better points to its ledger.json."""
    from ..library.contributions.solve import solve_library

    with show_progress(quiet=printing.quiet) as show:
        records = solve_library(
            folder,
            solvers=solver,
            time_limit=time_limit,
            up_to=up_to,
            by=by,
            machine=machine,
            progress=show,
        )
    failed = sum(record["status"] == "no point" for record in records)
    without = f", {failed} from runs without a point" if failed else ""
    line = f"{folder / 'ledger.json'}: {len(records)} new records{without}"
    printing.show(records, lambda: print_line(line))


@command("verify")
def verify_command(
    folder: Library,
    *,
    jobs: Processes = 1,
    printing: PrintOptions,
) -> None:
    """Check a library: build it again from its own inputs, compare every file, and check its points.

    The exit code is 1 if there is a defect.
    """
    from dataclasses import asdict

    from ..library.building.verification import verify_library

    with show_progress(quiet=printing.quiet) as show:
        defects = verify_library(folder, jobs=jobs, progress=show)
    result = f"defects: {len(defects)}" if defects else "no defects found"
    printing.show([asdict(defect) for defect in defects], lambda: print_line(f"{folder}: {result}"))
    for defect in defects:
        print_notice(str(defect))
    if defects:
        raise typer.Exit(1)


@command("submit")
def submit_command(
    folder: Library,
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Files and folders.")],
    *,
    entry: Annotated[
        str | None,
        _fact("--entry", metavar="NAME", help="Entry of all files; by default each file shows its own."),
    ] = None,
    solver: Annotated[
        str | None, _fact("--solver", metavar="NAME", help="Solver that found the points.")
    ] = None,
    version: Annotated[str | None, _fact("--version", metavar="TEXT", help="Version of the solver.")] = None,
    machine: Machine = None,
    by: Annotated[str | None, _fact("--by", metavar="TEXT", help="Name of the submitter.")] = None,
    date: Annotated[str | None, _fact("--date", metavar="YYYY-MM-DD", help="Day of the run.")] = None,
    printing: PrintOptions,
) -> None:
    """Check files against a library, keep what improves it, and rebuild what depends on them once.

    Accepted are solution files of {answers}; fields; and certificates of `crossfield prove`.
    Their kind is detected from their content. The exit code is 1 if a file is refused; the others are kept.
    """
    from ..library.contributions.submit import RunFacts, submit

    facts = RunFacts(solver, version, machine, by, date)
    with show_progress(quiet=printing.quiet) as show:
        results = submit(folder, files, entry=entry, facts=facts, progress=show)
    columns = ("file", "result", "entry", "now")
    printing.show(
        list(map(_submission_document, results)),
        lambda: show_table(str(folder), columns, list(map(_submission_row, results))),
    )
    for result in results:
        if result.reason:
            print_notice(result.reason)
    if any(result.error is not None for result in results):
        raise typer.Exit(1)


def _submission_document(result: Submission) -> dict[str, object]:
    """A result as JSON."""
    from dataclasses import asdict

    return asdict(result) | {
        "file": str(result.file),
        "error": None if result.error is None else str(result.error),
    }


def _submission_row(result: Submission) -> list[str]:
    """A row of the table of results, which leaves numbers to JSON so that it fits 80 columns."""
    more = f" +{len(result.entries) - 1}" if result.entries[1:] else ""
    return [
        result.file.name,
        result.outcome,
        f"{result.entries[0]}{more}" if result.entries else "",
        result.status or "",
    ]


@command("site")
def site_command(folder: Library, output: Folder) -> None:
    """Write a static site about a library: a table of all entries and a page for each."""
    from ..library.site.site import write_site

    with show_progress() as show:
        pages = write_site(folder, output, progress=show)
    print_line(f"{output}: {len(pages)} pages; open index.html")
