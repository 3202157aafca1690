"""Solving with any program of the table, through the modules that verification has for it.

Each program is a child process that starts when it is asked first; it reads the file that is written for it.
"""

from __future__ import annotations

from contextlib import ExitStack
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed
from pathlib import Path
from typing import Any, Self

from ...models.errors import SolverError, UnsupportedBySolverError
from ...models.field.field import CrossField
from ...models.formulations.problem import Problem
from ..bundle.starts import STARTS, write_start
from ..formats.registry import FORMATS, write
from ..solutions.readers.text import RawSolution
from ..solutions.solution import Solution
from ..solvers_table import PROGRAMS, SOLVERS, takes_in
from .programs.reading import load
from .programs.worker import Worker
from .verify import READING_SECONDS, finite, told_point


def format_for(problem: Problem, solver: str) -> str:
    """The first format in which a solver takes a problem and its program reads it; empty where none is."""
    entry = SOLVERS[solver]
    willing = (name for name in entry.formats if name in PROGRAMS[entry.program].formats)
    return next((name for name in willing if takes_in(problem, solver, name).answer == "yes"), "")


class Programs:
    """The programs of the table at work in a folder; a context that ends their processes."""

    def __init__(self, folder: Path) -> None:
        """Start nothing yet."""
        self._folder, self._stack = folder, ExitStack()
        self._workers: dict[str, Worker] = {}
        self._versions: dict[str, str] = {}

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End every child."""
        self._stack.close()

    def version(self, solver: str) -> str:
        """The version of a solver; that of its package, named, where the package is not the solver's own.

        Raises SolverError when the program does not say it.
        """
        if solver not in self._versions:
            self._versions[solver] = self._version(solver)
        return self._versions[solver]

    def _version(self, solver: str) -> str:
        program = PROGRAMS[SOLVERS[solver].program]
        if program.name != solver:
            try:
                return f"{program.needs} {installed(program.needs)}"
            except PackageNotFoundError:
                return "not installed"
        answer = self._worker(program.name).ask({"step": "version"}, READING_SECONDS)
        if answer["kind"] != "done":
            raise SolverError(f"{program.title} does not say its version: {answer['words']}")
        return str(answer["words"])

    def solve(
        self,
        problem: Problem,
        solver: str,
        seconds: float,
        *,
        gap: float = 0.0,
        start: CrossField | None = None,
    ) -> Solution:
        """What a solver finds within the time, its point read by name; a bound where it tells one.

        gap: the relative one that is enough; GAMS has 1e-6. start: a field whose complete point it starts
        from, in the file itself (.nl, GAMS) or beside it; CBC and GLPK do without. `seconds` of the answer:
        reading the file and solving, the start of the process left out. Raises UnsupportedBySolverError for a
        problem that it does not take or that is too large for its free edition, SolverError for a run that
        failed.
        """
        entry, name = SOLVERS[solver], format_for(problem, solver)
        program = PROGRAMS[entry.program]
        if not name:
            raise UnsupportedBySolverError(f"{entry.title} does not take {problem.name}")
        folder = self._folder / program.name
        folder.mkdir(exist_ok=True)
        path, result = folder / f"model{FORMATS[name].suffix}", folder / "result.npz"
        result.unlink(missing_ok=True)
        held = write(problem, path, start=start).problem
        task = {"step": "solve", "path": str(path), "result": str(result), "solver": solver}
        task |= self._beside(problem, solver, start, folder)
        answer = self._worker(program.name).ask(task | {"seconds": seconds, "gap": gap}, seconds)
        if answer["kind"] == "too large":
            raise UnsupportedBySolverError(
                f"{entry.title}: {held.columns} columns and {held.row_count} rows are too many for its free "
                f"edition, which takes {program.free}"
            )
        if answer["kind"] != "done":
            raise SolverError(f"{entry.title}: {answer['words']}")
        return _solution(held, load(RawSolution, result), answer["seconds"])

    @staticmethod
    def _beside(problem: Problem, solver: str, start: CrossField | None, folder: Path) -> dict[str, Any]:
        """The file of a starting point in the folder, for a solver that takes one."""
        if start is None or solver not in STARTS or not problem.integer.any():
            return {}
        path = folder / f"start{STARTS[solver].suffix}"
        try:
            write_start(problem, start, path, solver)
        except UnsupportedBySolverError:  # Xpress, where the problem is not convex
            return {}
        return {"start": str(path)}

    def _worker(self, program: str) -> Worker:
        if program not in self._workers:
            self._workers[program] = self._stack.enter_context(Worker(program, self._folder / program))
        return self._workers[program]


def _solution(held: Problem, raw: RawSolution, seconds: float) -> Solution:
    """An answer as a solution of the problem that the file holds. Raises SolverError."""
    point = None
    if len(raw.values):
        point, wrong = told_point(held, raw)
        if wrong:
            raise SolverError(wrong)
    bound = finite(raw.bound)
    told = (raw.status, raw.message, raw.reader, raw.objective)
    return Solution(held, point, *told, bound=bound, seconds=seconds, nodes=raw.nodes)
