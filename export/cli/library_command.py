"""The commands of `library`: build, get, solve, verify."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from .option_groups import command as command_of
from .options import Folder, Force, PrintOptions, Processes, Seconds
from .output import print_line, print_notice, show_progress

library = typer.Typer(
    help="Build, check and solve a library: instances in every formulation, with best known points.",
    epilog="Example: crossfield library build default -o library",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
command = partial(command_of, library)

_fact = partial(typer.Option, rich_help_panel="Facts about the run")

Library = Annotated[Path, typer.Argument(metavar="DIR", help="Folder that `crossfield library build` wrote.")]


@command("build", "crossfield library build small.toml -o library")
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
    force: Force = False,
    search: Annotated[
        bool,
        typer.Option("--search", help="Search for points and proofs even where the specification has them."),
    ] = False,
    points: Annotated[
        Path | None,
        typer.Option(
            "--points",
            metavar="DIR",
            help="Folder with points, fields and certificates of others.",
        ),
    ] = None,
    printing: PrintOptions,
) -> None:
    """Build a library: every instance that the specification asks for, in its formulations and formats.

    Each entry (an instance in one formulation) has its best known point, and a sidecar: a JSON file with all
    facts about it. Complete files in the folder are kept, so an interrupted build continues.
    A size that is too small for a sketch is skipped with a message. A tightened entry awaits its certificate.
    library.json lists both. If an instance or entry fails, the others are built, and the exit code is 1.

    --points checks solution files of {answers}; fields; and certificates of `crossfield prove`. Those that
    improve an entry are kept. If a file is refused, the exit code is 1.
    """
    from dataclasses import replace

    from ..library.building.build import build, records_of_changed_problems
    from ..library.contributions.points import add_points
    from ..library.documents.documents import existing_folder
    from ..library.plan.spec import default_spec, read_spec

    checked: dict[Path, list[str]] = {}
    refused: dict[Path, str] = {}
    with show_progress(quiet=printing.quiet) as show:
        show("reading the specification")
        wanted = default_spec() if spec == "default" else read_spec(spec)
        wanted = replace(wanted, points=None) if search else wanted
        if points is not None:
            existing_folder(points)
        built = build(wanted, output, jobs=jobs, scheduler=scheduler, force=force, progress=show)
        if points is not None:
            checked, refused = add_points(built, points, show)
            if any(checked.values()):
                built = build(wanted, output, jobs=jobs, scheduler=scheduler, progress=show)
    waiting = sum(name.endswith("_tight") for name in built.skipped)
    too_small = {
        name: why
        for name, why in built.skipped.items()
        if name not in built.failed and not name.endswith("_tight")
    }
    line = f"{output}: {len(built.document['entries'])} entries"
    line += f", {len(built.failed)} instances or entries failed" if built.failed else ""
    line += f", {len(too_small)} instances skipped" if too_small else ""
    line += f"; {waiting} tightened entries await a certificate" if waiting else ""
    if points is not None:
        better = sum(map(bool, checked.values()))
        line += f"; {better} of {len(checked) + len(refused)} points and certificates improve it"
    printing.show(built.document, lambda: print_line(line))
    for name, reason in too_small.items():
        print_notice(f"{name} is skipped: {reason}")
    for name, error in built.failed.items():
        print_notice(f"{name} failed: {error}")
    for reason in refused.values():
        print_notice(reason)
    if stale := sorted({record.entry for record in records_of_changed_problems(built)}):
        print_notice(
            f"{output / 'ledger.json'}: records of {len(stale)} entries do not count, for their problems have"
            f" changed since: {', '.join(stale[:3])}{', ...' if stale[3:] else ''}; measure them again with"
            " `crossfield library solve`"
        )
    if built.failed or refused:
        raise typer.Exit(1)


@command("get", "crossfield library get cf_mouse_n004_exact -o models")
def get_command(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="NAME...", help="Entries; by default all that are selected.")
    ] = None,
    *,
    rung: Annotated[
        str | None, typer.Option("--rung", metavar="RUNG", help="Only entries of this rung: {rungs}.")
    ] = None,
    output: Folder,
    force: Force = False,
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
        written = write_entries(output, chosen, force=force, progress=show)
    number = sum(map(len, written.values()))
    printing.show(written, lambda: print_line(f"{output}: {number} files of {len(written)} entries"))


@command("solve", "crossfield library solve library --solver highs --time-limit 2")
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
    machine: Annotated[str | None, _fact("--machine", metavar="TEXT", help="Processor and memory.")] = None,
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


@command("verify", "crossfield library verify library")
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
