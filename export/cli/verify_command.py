"""The command `verify`: exported files, read and solved by every installed solver."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import typer

from . import options
from .inputs import check_names
from .output import print_line, print_notice, print_result, show_progress, show_table

if TYPE_CHECKING:
    from ..verify.checks import Verification


def verify_command(
    folder: options.Exported,
    *,
    solve: options.SolveSeconds = None,
    program: options.ProgramNames = None,
    force: options.Force = False,
    as_json: options.Json = False,
) -> None:
    """Read every exported file with every installed solver, and compare the result with the problem.

    Prints the number of files by program and result, and every fault. Writes verify.json with the reasons
    and numbers of all checks. The exit code is 1 if any file differs.
    """
    from ..solvers_table import PROGRAMS
    from ..verify.verify import verify

    programs = check_names(program, PROGRAMS, "program")
    with show_progress() as show:
        verification = verify(folder, seconds=solve, programs=programs, force=force, progress=show)
    print_result(verification.document(), lambda: _show_verification(verification), as_json=as_json)
    for check in verification.failed_checks:
        print_notice(f"{check.file}: {check.program}: {check.verdict}: {check.reason}")
    if not verification.is_ok:
        raise typer.Exit(1)


def _show_verification(verification: Verification) -> None:
    """Print the number of files by program, step and verdict, and the absent programs."""
    checks = verification.checks
    counts = Counter((check.program, check.step, check.verdict) for check in checks)
    verdicts = list(dict.fromkeys(check.verdict for check in checks))
    columns = ("program", "step", *map(str, verdicts))
    rows = [
        [*row, *(str(counts[*row, verdict] or "-") for verdict in verdicts)]
        for row in dict.fromkeys((check.program, check.step) for check in checks)
    ]
    show_table(f"files in {verification.folder}", columns, rows, numbers=columns[2:])
    for why in verification.absent.values():
        print_line(f"not used: {why}")
    print_line(f"reasons and numbers: {verification.folder / 'verify.json'}")
