"""The commands of `library`: build, get, solve, verify."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from .options import RUNGS, Folder, Force, Json, LibrarySolvers, Processes, Seconds, add_command
from .output import print_line, print_notice, print_result, show_progress

library = typer.Typer(
    help="Build, check and solve a library: instances in every formulation, with best known points.",
    epilog="Example: crossfield library build default -o library",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
_fact = partial(typer.Option, rich_help_panel="Facts about the run")

Library = Annotated[Path, typer.Argument(metavar="DIR", help="Folder that `crossfield library build` wrote.")]


@add_command(library, "build", "crossfield library build small.toml -o library")
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
    as_json: Json = False,
) -> None:
    """Build a library: every instance that the specification asks for, in its formulations and formats.

    Each entry (an instance in one formulation) has its best known point, and a sidecar: a JSON file with all
    facts about it. Complete files in the folder are kept, so an interrupted build continues.
    A size that is too small for a sketch is skipped with a message. A tightened entry awaits its certificate.
    library.json lists both. If an instance or entry fails, the others are built, and the exit code is 1.

    --points checks solution files of solvers, fields, and certificates of `crossfield prove`. Those that
    improve an entry are kept. If a file is refused, the exit code is 1.
    """
    from dataclasses import replace

    from ..library.building.build import build, rebuild
    from ..library.contributions.points import add_points
    from ..library.documents.documents import existing_folder
    from ..library.plan.spec import default_spec, read_spec

    checked: dict[Path, list[str]] = {}
    refused: dict[Path, str] = {}
    with show_progress() as show:
        show("reading the specification")
        wanted = default_spec() if spec == "default" else read_spec(spec)
        wanted = replace(wanted, points=None) if search else wanted
        if points is not None:
            existing_folder(points)
        built = build(wanted, output, jobs=jobs, scheduler=scheduler, force=force, progress=show)
        notices = built.notices
        if points is not None:
            checked, refused = add_points(built, points, show)
            if any(checked.values()):
                built = rebuild(output, jobs=jobs, progress=show)
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
    print_result(built.document, lambda: print_line(line), as_json=as_json)
    for name, reason in too_small.items():
        print_notice(f"{name} is skipped: {reason}")
    for name, error in built.failed.items():
        print_notice(f"{name} failed: {error}")
    for text in (*notices, *refused.values()):
        print_notice(text)
    if built.failed or refused:
        raise typer.Exit(1)


@add_command(library, "get", "crossfield library get cf_mouse_n004_exact -o models")
def get_command(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="NAME...", help="Entries; by default all that are selected.")
    ] = None,
    *,
    rung: Annotated[
        str | None, typer.Option("--rung", metavar="RUNG", help=f"Only entries of this rung: {RUNGS}.")
    ] = None,
    output: Folder,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write model files of the library that ships, without a build: the same bytes as a build.

    Each entry comes with its instance and a manifest, with which `crossfield read` reads an answer back.
    Names and --rung select entries together; at least one of them is needed.
    """
    from ...models.errors import InputError
    from ..library.building.shipped_entries import entries, write_entries

    if not names and rung is None:
        raise InputError("no entry is selected; name entries, or select them with --rung")
    chosen = entries(*names or (), rung=rung)
    if not chosen:
        raise InputError("no entry of the library that ships is selected; relax --rung")
    with show_progress() as show:
        written = write_entries(output, chosen, force=force, progress=show)
    number = sum(map(len, written.values()))
    print_result(
        written, lambda: print_line(f"{output}: {number} files of {len(written)} entries"), as_json=as_json
    )


@add_command(library, "solve", "crossfield library solve library --solver highs --time-limit 2")
def solve_command(
    folder: Library,
    *,
    solver: LibrarySolvers = None,
    time_limit: Seconds = 10.0,
    up_to: Annotated[
        str | None,
        typer.Option("--up-to", metavar="RUNG", help=f"Largest rung (class of sizes) to solve: {RUNGS}."),
    ] = None,
    by: Annotated[
        str | None,
        _fact("--by", metavar="TEXT", help="Name of the person who runs them, for the ledger."),
    ] = None,
    machine: Annotated[str | None, _fact("--machine", metavar="TEXT", help="Processor and memory.")] = None,
    as_json: Json = False,
) -> None:
    """Run the installed solvers on a library and add bounds, times and better points to its ledger.json."""
    from ..library.contributions.solve import solve_library

    with show_progress() as show:
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
    print_result(records, lambda: print_line(line), as_json=as_json)


@add_command(library, "verify", "crossfield library verify library")
def verify_command(
    folder: Library,
    *,
    jobs: Processes = 1,
    as_json: Json = False,
) -> None:
    """Check a library: build it again from its own inputs, compare every file, and check its points.

    The exit code is 1 if there is a defect.
    """
    from dataclasses import asdict

    from ..library.building.verification import verify_library

    with show_progress() as show:
        defects = verify_library(folder, jobs=jobs, progress=show)
    result = f"defects: {len(defects)}" if defects else "no defects found"
    print_result(
        [asdict(defect) for defect in defects], lambda: print_line(f"{folder}: {result}"), as_json=as_json
    )
    for defect in defects:
        print_notice(str(defect))
    if defects:
        raise typer.Exit(1)
