"""Interface of the module of a program, and its errors.

The table of solvers lists the programs. Each has a module here, which is imported in a child process only:

    version() -> str                  version of the program
    read(path) -> Algebra                   the coefficients of an LP or MPS file, where it reports them
    evaluate(path, points) -> Behaviour     the values of a file of another format at points
    solve(job) -> Outcome                   solve a model file and write a solution file, where it solves

A module raises RefusedError, NotReportedError or TooLargeError. Files are not compressed; the current folder
is the child's own.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any, Final, NamedTuple

from ...models.errors import CrossfieldError
from ...models.processes.child_program import is_stopped, on_stop
from ...models.processes.deadline import Deadline
from ..statuses import Status

FEASIBILITY: Final = 1e-6
"""Violation up to which a point counts as feasible: the solvers' own tolerance."""
_WRITING: Final = 0.2
_LEAST: Final = 0.01


class RefusedError(CrossfieldError):
    """A program does not take a file; the message is the program's own."""


class FailedError(CrossfieldError):
    """An error of a program or of its interface that does not concern the file."""


class NotReportedError(CrossfieldError):
    """A program read a file, but does not report it in a form that can be compared."""


class TooLargeError(CrossfieldError):
    """A model is larger than the program's free edition takes."""


class Job(NamedTuple):
    """A request to a program to solve a file.

    solver: name in the table of solvers. model: the file to solve; solution: the file to write, in the
    solver's own layout. start: a file with a starting point, or None. limit: most seconds for the search;
    deadline: when it has to end, the solution written. gap: relative gap at which a discrete search may stop.
    threads: 0 for the solver's choice. precise: whether tolerances are as tight as the solver allows.
    stamp: names the problem, for files that can hold a message.
    """

    solver: str
    model: Path
    solution: Path
    start: Path | None
    limit: float
    deadline: Deadline
    gap: float
    threads: int
    precise: bool
    stamp: str

    @property
    def seconds(self) -> float:
        """Seconds for the search: the limit, or the time left minus the time to write the solution."""
        return max(min(self.limit, self.deadline.left() - _WRITING), _LEAST)


class Outcome(NamedTuple):
    """Facts that a solution file lacks: status, the solver's message, dual bound and number of nodes.

    status: None if the file states it. bound and nodes: None if the solver reports none.
    """

    status: Status | None = None
    message: str = ""
    bound: float | None = None
    nodes: int | None = None


def call_program(program: str, step: str, *arguments: Any) -> Any:
    """Call a function of a program's module: `version`, `read`, `evaluate` or `solve` (see protocol.py).

    A program that ends with an error after a request to stop has no answer: an interrupt ends GLPK and CBC at
    once. Raises the module's own errors, and FailedError for errors of the program's interface.
    """
    try:
        return getattr(import_module(f"{__package__}.{program}"), step)(*arguments)
    except RefusedError:
        if step != "solve" or not is_stopped():
            raise
        return Outcome(Status.LIMIT_WITHOUT_POINT, "interrupted")
    except CrossfieldError:
        raise
    except Exception as error:
        raise FailedError(f"{type(error).__name__}: {error}") from error


def part_path(solution: Path) -> Path:
    """Return the path of a solution while it is written; programs choose the layout by its suffix."""
    return solution.with_name(f".part-{solution.name}")


@contextmanager
def write_in_full(solution: Path) -> Iterator[Path]:
    """Yield the path for a program to write a solution to; the file gets its name once it is complete.

    So a file that exists after the program was killed is a whole answer.
    """
    part = part_path(solution)
    part.unlink(missing_ok=True)
    try:
        yield part
        if part.exists():
            part.replace(solution)
    finally:
        part.unlink(missing_ok=True)


def run_program(name: str, *arguments: str) -> str:
    """Run an executable and return its output. Raises RefusedError if it ends with an error.

    When the parent requests a stop, the program receives SIGINT.
    """
    done = run_command([shutil.which(name) or name, *arguments])
    if done.returncode:
        raise RefusedError(f"{name} ends with code {done.returncode}: {done.stdout.strip()[-300:]}")
    return done.stdout


def run_command(command: list[str]) -> subprocess.CompletedProcess[str]:
    """Run a command, print its output, and return how it ended; standard error goes to the same text."""
    with (
        subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            errors="replace",
        ) as process,
        on_stop(lambda: process.send_signal(signal.SIGINT)),
    ):
        text, _ = process.communicate()
    print(text, flush=True)  # noqa: T201 - the output of a child is its log
    return subprocess.CompletedProcess(command, process.returncode, text)


def interrupt_self() -> None:
    """Send this process SIGINT, for a solver that handles it itself."""
    os.kill(os.getpid(), signal.SIGINT)


def file_names(path: Path) -> tuple[list[str], list[str]]:
    """Names of columns and rows of an .nl file, from its .col and .row files, without the objective."""
    columns, rows = (path.with_suffix(suffix).read_text("utf-8").split() for suffix in (".col", ".row"))
    return columns, [name for name in rows if name != "obj"]
