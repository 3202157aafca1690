"""The command `verify`: exported files, read and solved by every installed solver."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from . import options
from .inputs import check_names
from .output import print_line, print_notice, show_progress, show_table

if TYPE_CHECKING:
    from ..verify.checks import Verification


def verify_command(
    folder: options.Exported,
    *,
    solve: options.SolveSeconds = None,
    program: options.ProgramNames = None,
    force: options.Force = False,
    printing: options.PrintOptions,
) -> None:
    """Read every exported file with every installed solver, and compare the result with the problem.

    Prints the number of files by program and result, and every fault. Writes verify.json with the reasons
    and numbers of all checks. The exit code is 1 if any file differs.
    """
    from ..solvers_table import PROGRAMS
    from ..verify.verify import verify

    programs = check_names(program, PROGRAMS, "program")
    with show_progress(quiet=printing.quiet) as show:
        verification = verify(folder, seconds=solve, programs=programs, force=force, progress=show)
    printing.show(verification.document(), lambda: _show_verification(verification))
    for check in verification.failed_checks:
        print_notice(f"{check.file}: {check.program}: {check.verdict}: {check.reason}")
    if not verification.is_ok:
        raise typer.Exit(1)


def _show_verification(verification: Verification) -> None:
    """Print the number of files by program, step and verdict, and the absent programs."""
    verdicts = list(dict.fromkeys(check.verdict for check in verification.checks))
    columns = ("program", "step", *map(str, verdicts))
    rows = []
    for program, step in dict.fromkeys((check.program, check.step) for check in verification.checks):
        mine = [
            result.verdict
            for result in verification.checks
            if (result.program, result.step) == (program, step)
        ]
        rows.append([program, step, *(str(mine.count(verdict) or "-") for verdict in verdicts)])
    show_table(f"files in {verification.folder}", columns, rows, numbers=columns[2:])
    for why in verification.absent.values():
        print_line(f"not used: {why}")
    print_line(f"reasons and numbers: {verification.folder / 'verify.json'}")
