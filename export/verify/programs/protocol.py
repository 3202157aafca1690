"""What the module of a program has, and what it raises.

Which programs there are stands in the table of solvers.
A program's module is imported in a child process only (worker.py). It has

    version() -> str                                 of the program
    read(path) -> Meaning                            the algebra of an LP or MPS file, where it tells it
    evaluate(path, points) -> Evaluation             the behaviour of a file of another format
    solve(path, seconds, solver, gap) -> RawSolution its answer, where it solves

The gap is the relative one that is enough. A solver for which the table has a file of starting points takes
the path of one as a fifth argument, `start`. A module raises Refused, NotTold or TooLarge. Files come
unpacked; the current folder is its own.
"""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from ...solvers_table import PROGRAMS


class Refused(Exception):  # noqa: N818 - it is an answer
    """What a program says when it does not take a file."""


class NotTold(Exception):  # noqa: N818 - it is an answer
    """What a program read, but does not tell in a form that can be compared."""


class TooLarge(Exception):  # noqa: N818 - it is an answer
    """A file beyond the size of a program's free edition."""


def started(name: str, *arguments: str, folder: Path | None = None) -> subprocess.CompletedProcess[str]:
    """How a run of a program's executable ended, and what it said."""
    command = [shutil.which(PROGRAMS[name].needs) or PROGRAMS[name].needs, *arguments]
    return subprocess.run(
        command, check=False, capture_output=True, encoding="utf-8", errors="replace", cwd=folder
    )


def file_names(path: Path) -> tuple[list[str], list[str]]:
    """Names of columns and rows of an .nl file, from the .col and .row beside it, the objective left out."""
    columns, rows = (path.with_suffix(suffix).read_text("utf-8").split() for suffix in (".col", ".row"))
    return columns, [name for name in rows if name != "obj"]
