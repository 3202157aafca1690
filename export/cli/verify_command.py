"""The command `verify`: exported files handed to every solver that is here."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .inputs import known
from .options import Json, Quiet, Seconds
from .output import complain, progress, say, say_json, show_table

if TYPE_CHECKING:
    from ..verify.verify import Verification


def verify_command(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder that `crossfield export` wrote.")],
    *,
    solve: Annotated[
        bool, typer.Option("--solve", help="Solve every problem too, and compare the optima.")
    ] = False,
    time_limit: Seconds = 10.0,
    program: Annotated[
        list[str] | None,
        typer.Option(
            "-p",
            "--program",
            metavar="NAME",
            help="{programs}; all that are installed by default, may be repeated.",
        ),
    ] = None,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Hand every exported file to every solver that is installed, and compare what it reads with the problem.

    All results go to verify.json in the folder. The exit code is 1 when something differs.
    """
    from ..solvers_table import PROGRAMS
    from ..verify.verify import verify

    programs = known(program, PROGRAMS, "program")
    with progress(quiet=quiet) as show:
        found = verify(folder, seconds=time_limit if solve else None, programs=programs, progress=show)
    if as_json:
        say_json(found.document())
    elif not quiet:
        _show(found)
    for check in found.bad:
        complain(f"{check.file}: {check.program}: {check.verdict}: {check.reason}")
    if not found.ok:
        raise typer.Exit(1)


def _show(found: Verification) -> None:
    """Print how many files each program read and solved, how that ended, and what is absent."""
    verdicts = list(dict.fromkeys(check.verdict for check in found.checks))
    columns = ("program", "step", *map(str, verdicts))
    rows = []
    for program, step in dict.fromkeys((check.program, check.step) for check in found.checks):
        mine = [f.verdict for f in found.checks if (f.program, f.step) == (program, step)]
        rows.append([program, step, *(str(mine.count(verdict) or "-") for verdict in verdicts)])
    show_table(f"files in {found.folder}", columns, rows, numbers=columns[2:])
    for name, how in found.absent.items():
        say(f"absent: {name}; {how}")
    say(f"reasons and numbers: {found.folder / 'verify.json'}")
