"""The commands `library build`, `solve`, `verify`, `submit-point`, `points` and `site`."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from .help_texts import Command
from .options import Folder, Json, Processes, Quiet, Seconds
from .output import complain, progress, say, say_json

library = typer.Typer(
    help="Build, check, solve and show a library: instances in every formulation, with best known points.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)

command = partial(library.command, cls=Command)

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
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Build a library: every instance that the specification asks for, in its formulations and formats.

    Each entry (an instance in one formulation) has its best known point, and a sidecar: a JSON file of all
    that is known of it.
    What is whole in the folder is kept, so that a build that was stopped continues.
    """
    from dataclasses import replace

    from ..library.building.build import build, unmatched
    from ..library.plan.spec import default_spec, read_spec

    with progress(quiet=quiet) as show:
        show("reading the specification")
        wanted = default_spec() if spec == "default" else read_spec(spec)
        wanted = replace(wanted, points=None) if search else wanted
        built = build(wanted, output, jobs=jobs, scheduler=scheduler, progress=show)
    if as_json:
        say_json(built.document)
    elif not quiet:
        say(f"{output}: {len(built.document['entries'])} entries")
    if stale := sorted({record.entry for record in unmatched(built)}):
        complain(
            f"{output / 'ledger.json'}: records of {len(stale)} entries do not count, for their problems have"
            f" changed since: {', '.join(stale[:3])}{', ...' if stale[3:] else ''}; measure them again with"
            " `crossfield library solve`"
        )


@command("solve")
def solve_command(
    folder: Library,
    *,
    solver: Annotated[
        list[str] | None,
        typer.Option(
            "--solver", metavar="NAME", help="{solvers}; all that take an entry by default, may be repeated."
        ),
    ] = None,
    time_limit: Seconds = 10.0,
    up_to: Annotated[
        str | None,
        typer.Option("--up-to", metavar="RUNG", help="Largest rung (class of sizes) to solve: {rungs}."),
    ] = None,
    by: Annotated[
        str | None, typer.Option("--by", metavar="TEXT", help="Who measures, as the ledger is to say.")
    ] = None,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Run the installed solvers on a library; its ledger.json keeps their bounds, times and better points."""
    from ..library.contributions.solve import solve_library

    with progress(quiet=quiet) as show:
        records = solve_library(
            folder, solvers=solver, time_limit=time_limit, up_to=up_to, by=by, progress=show
        )
    if as_json:
        say_json(records)
    elif not quiet:
        say(f"{folder / 'ledger.json'}: {len(records)} new records")


@command("verify")
def verify_command(
    folder: Annotated[
        Path,
        typer.Argument(metavar="DIR|ARCHIVE", help="Folder, .zip or .tar (.gz, .bz2, .xz) of a library."),
    ],
    *,
    jobs: Processes = 1,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Check a library: every entry is made again and compared, with its points, files and checksums.

    The exit code is 1 when something is wrong.
    """
    from dataclasses import asdict

    from ..library.checking.check_library import verify_library

    with progress(quiet=quiet) as show:
        findings = verify_library(folder, jobs=jobs, progress=show)
    if as_json:
        say_json([asdict(finding) for finding in findings])
    elif not quiet and not findings:
        say(f"{folder}: everything is as it should be")
    for finding in findings:
        complain(str(finding))
    if findings:
        raise typer.Exit(1)


@command("submit-point")
def submit_command(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Solution file of {answers}.")],
    folder: Annotated[Path, typer.Option("--library", metavar="DIR", help="The library.")],
    *,
    entry: Annotated[
        str | None,
        typer.Option(
            "--entry", metavar="NAME", help="The entry that it solves; by default as the file is named."
        ),
    ] = None,
    solver: Annotated[
        str | None, typer.Option("--solver", metavar="NAME", help="The solver that found the point.")
    ] = None,
    version: Annotated[
        str | None, typer.Option("--version", metavar="TEXT", help="The solver's version.")
    ] = None,
    seconds: Annotated[
        float | None, typer.Option("--seconds", min=0.0, help="How long the solver took.")
    ] = None,
    by: Annotated[str | None, typer.Option("--by", metavar="TEXT", help="Who submits the point.")] = None,
    quiet: Quiet = False,
) -> None:
    """Check a solver's solution of an entry, and keep it with who found it when it is the best so far."""
    from ..library.contributions.submit import submit_point

    with progress(quiet=quiet) as show:
        happened = submit_point(
            file, folder, entry=entry, solver=solver, version=version, seconds=seconds, by=by, progress=show
        )
    if not quiet:
        say(str(happened))


@command("points")
def points_command(
    folder: Library,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE.zip", help="The archive.")],
    *,
    quiet: Quiet = False,
) -> None:
    """Keep the points of a library: an archive of fields and certificates that a specification may name.

    A build of that specification then searches for nothing, and its bytes are the same on every processor.
    """
    from ..library.ledger.given import write_points

    number = write_points(folder, output)
    if not quiet:
        say(f"{output}: points of {number} instances")


@command("site")
def site_command(folder: Library, output: Folder, *, quiet: Quiet = False) -> None:
    """Write a static site about a library: a table of all entries and a page for each."""
    from ..library.site.site import write_site

    with progress(quiet=quiet) as show:
        pages = write_site(folder, output, progress=show)
    if not quiet:
        say(f"{output}: {len(pages)} pages; open index.html")
