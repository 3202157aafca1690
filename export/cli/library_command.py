"""The commands of `library`: build, solve, verify, release, points, submit-point, submit-run, site."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from .help_texts import Command
from .options import Folder, Json, Processes, Quiet, Seconds
from .output import print_json as say_json
from .output import print_line as say
from .output import print_notice as complain
from .output import progress

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
    A size at which nothing of a sketch is left is left out, which is said.
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
        left_out = f", {len(built.skipped)} instances left out" if built.skipped else ""
        say(f"{output}: {len(built.document['entries'])} entries{left_out}")
    for name, reason in built.skipped.items():
        complain(f"{name} is left out: {reason}")
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
        str | None, typer.Option("--by", metavar="TEXT", help="Who measures, as the ledger is to say.")
    ] = None,
    machine: Annotated[str | None, typer.Option("--machine", metavar="TEXT", help="On what machine.")] = None,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Run the installed solvers on a library; its ledger.json keeps their bounds, times and better points."""
    from ..library.contributions.solve import solve_library

    with progress(quiet=quiet) as show:
        records = solve_library(
            folder,
            solvers=solver,
            time_limit=time_limit,
            up_to=up_to,
            by=by,
            machine=machine,
            progress=show,
        )
    if as_json:
        say_json(records)
    elif not quiet:
        failed = sum(record["status"] == "no point" for record in records)
        say(
            f"{folder / 'ledger.json'}: {len(records)} new records"
            + (f", {failed} of them of runs that found no point" if failed else "")
        )


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


@command("release")
def release_command(
    folder: Library,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE", help="Archive to write: .tar.gz or .zip.")
    ],
    *,
    jobs: Processes = 1,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Freeze a library that verifies as one archive, to be published; its checksum lies beside it.

    The library states its version and day: the table [release] of its specification. The same library gives
    the same archive.
    """
    from ..library.checking.release import release_library

    with progress(quiet=quiet) as show:
        frozen = release_library(folder, output, jobs=jobs, progress=show)
    if as_json:
        say_json({"file": str(frozen.file), "sha256": frozen.sha256, "files": frozen.files})
    elif not quiet:
        say(f"{frozen.file}: {frozen.files} files, SHA-256 {frozen.sha256}")


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


@command("submit-run")
def submit_run_command(
    folder: Annotated[Path, typer.Option("--library", metavar="DIR", help="The library.")],
    *,
    point: Annotated[
        Path | None, typer.Option("--point", metavar="FILE", help="The solver's solution file.")
    ] = None,
    log: Annotated[Path | None, typer.Option("--log", metavar="FILE", help="The log of {logs}.")] = None,
    entry: Annotated[
        str | None,
        typer.Option("--entry", metavar="NAME", help="The entry that it is of; by default as the files say."),
    ] = None,
    bound: Annotated[
        float | None, typer.Option("--bound", help="The dual bound; by default as the log tells it.")
    ] = None,
    status: Annotated[
        str | None, typer.Option("--status", help="What the run came to: {run statuses}.")
    ] = None,
    solver: Annotated[str | None, typer.Option("--solver", metavar="NAME", help="The solver.")] = None,
    version: Annotated[str | None, typer.Option("--version", metavar="TEXT", help="Its version.")] = None,
    seconds: Annotated[float | None, typer.Option("--seconds", help="How long it took.")] = None,
    threads: Annotated[int | None, typer.Option("--threads", help="Threads it used.")] = None,
    limit: Annotated[float | None, typer.Option("--limit", help="Seconds it was allowed.")] = None,
    machine: Annotated[
        str | None, typer.Option("--machine", metavar="TEXT", help="What it ran on: processor, memory.")
    ] = None,
    by: Annotated[str | None, typer.Option("--by", metavar="TEXT", help="Who submits the run.")] = None,
    date: Annotated[
        str | None, typer.Option("--date", metavar="YYYY-MM-DD", help="The day of the run.")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Check a run of a solver (bound, point or both) and keep it, with its log, when it is its solver's best.

    Of --point, --log and --bound at least one is needed. A bound above a feasible point is refused. An
    entry is solved by a certificate, or when three programs of different makers agree; until then a proof is
    told as claimed.
    """
    from ..library.contributions.submit_run import Told, submit_run

    told = Told(solver, version, status, bound, seconds, threads, limit, machine, by, date)  # type: ignore[arg-type]
    with progress(quiet=quiet) as show:
        happened = submit_run(folder, point=point, log=log, entry=entry, told=told, progress=show)
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
