"""Local solvers: each reads the file that was written, so that a solve tests the file too.

HiGHS reads the .mps in this process; Ipopt and Bonmin read the .nl in a child process, which a crash or a limit takes alone.
Each leaves a solution file, which goes through the same readers as anybody's.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from ...models.errors import (
    InputError,
    MissingSolverError,
    OutputError,
    SolutionError,
    SolverError,
    UnsupportedBySolverError,
)
from ...models.field.field import CrossField
from ...models.formulations.problem import Problem
from ...models.instance.grid import Floats
from ...models.processes.deadline import Deadline
from ...models.processes.side_by_side import checked
from ...models.storage import make_folder
from ..bundle.manifest import is_recordable, leave_manifest
from ..formats.nl import Layout
from ..formats.registry import FORMATS, carried, write
from ..solutions.readers.ampl import write_ampl_sol
from ..solutions.solution import Solution, read_solution
from ..solvers_table import takes_in
from ..writing.names import ONE, column_names
from .child import Ending, run_child

_TICK: Final = 0.1
"""Seconds between two looks at a running solver."""
_LEAST: Final = 0.01
"""Seconds of a solve for which nothing is left: still the point that it starts from comes back."""
_FEASIBLE: Final = 1e-6
"""Violation up to which a start is a point of the problem: the solvers' own tolerance."""
_LIMIT: Final = 400
"""AMPL's solve code for a limit."""


@dataclass(frozen=True)
class Limits:
    """Seconds of a solve, files included; relative gap at which a discrete search may stop; threads (0: the solver's choice)."""

    seconds: float = 60.0
    gap: float = 1e-6
    threads: int = 0

    def __post_init__(self) -> None:
        """Check the ranges."""
        if not (0 < self.seconds < np.inf and 0 <= self.gap < np.inf):
            raise InputError(
                f"a time limit of {self.seconds} s and a gap of {self.gap} cannot be; "
                "give a positive number of seconds, and a gap that is not negative"
            )
        checked(self.threads, "threads", least=0)

    def until(self, deadline: Deadline) -> Limits:
        """The same with what is left until then."""
        return replace(self, seconds=max(deadline.left(), _LEAST))


class Job(NamedTuple):
    """What a solver is to do: read `model`, leave `solution` and `log` by the deadline.

    start: a complete point (columns,), or None.
    """

    model: Path
    solution: Path
    log: Path
    problem: Problem
    start: Floats | None
    limits: Limits
    deadline: Deadline


class Answer(NamedTuple):
    """What is not in the solution file: the solver's dual bound where it tells one, and whether the user interrupted it."""

    bound: float | None
    interrupted: bool


Run = Callable[[Job], Answer]


@dataclass(frozen=True)
class Solver:
    """A local solver: the format it reads, what it is called in Python, and whether an answer without proof is wanted of it.

    What it takes stands in the table of capabilities.
    """

    name: str
    summary: str
    format: str
    package: str
    run: Run
    local: bool = False


def _run_highs(job: Job) -> Answer:
    import highspy

    limits = job.limits
    highs: Any = highspy.Highs()  # type: ignore[no-untyped-call]
    highs.setOptionValue("log_to_console", "false")
    highs.setOptionValue("log_file", str(job.log))
    if highs.readModel(str(job.model)) == highspy.HighsStatus.kError:
        raise SolverError(f"HiGHS cannot read it; see {job.log.name} beside it", file=job.model)
    for option, value in (("mip_rel_gap", limits.gap), ("threads", limits.threads)):
        highs.setOptionValue(option, value)
    if limits.threads:
        highspy.Highs.resetGlobalScheduler(True)  # noqa: FBT003 - one for the process, else kept from an earlier solve
    if job.start is not None:
        highs.setSolution(_highs_start(highs, job.problem, job.start))
    highs.setOptionValue("time_limit", job.deadline.left())
    interrupted = _highs_solve(highs)
    if highs.writeSolution(str(job.solution), 0) == highspy.HighsStatus.kError:
        raise OutputError(
            "HiGHS cannot write it; free some space or choose another folder", file=job.solution
        )
    bound = highs.getInfo().mip_dual_bound if job.problem.integer.any() else None
    return Answer(bound if bound is not None and np.isfinite(bound) else None, interrupted)


def _highs_solve(highs: Any) -> bool:
    """Solve. Whether the user interrupted: that ends the search and keeps the incumbent."""
    import highspy

    highs.HandleUserInterrupt = True
    highs.startSolve()
    try:
        _wait_for(highs)
    except KeyboardInterrupt:
        highs.cancelSolve()
        _wait_for(highs)
    finally:  # the thread must have ended before this process can
        highs.cancelSolve()
        highs.wait()
    return bool(highs.getModelStatus() == highspy.HighsModelStatus.kInterrupt)


def _wait_for(highs: Any) -> None:
    while not highs.wait(_TICK)[0]:
        pass


def _highs_start(highs: Any, problem: Problem, start: Floats) -> Any:
    import highspy

    names = [bytes(row).rstrip(b"\0").decode() for row in column_names(problem)]
    values = dict(zip(names, start.tolist(), strict=True)) | {ONE.decode(): 1.0}
    given = highspy.HighsSolution()
    given.col_value = [values[name] for name in highs.getLp().col_names_]
    return given


def _casadi(solver: str) -> Run:
    def run(job: Job) -> Answer:
        # -P: a folder `crossfield` or a file casadi.py where the user happens to be is not meant.
        command = [
            sys.executable,
            "-P",
            "-m",
            "crossfield.export.solving.casadi_driver",
            solver,
            str(job.model),
            str(job.solution),
            repr(job.deadline.at),
            repr(float(job.limits.gap)),
            job.problem.stamp,
        ]
        ending = run_child(command, job.log, job.deadline)
        if not job.solution.exists() and (ending.interrupted or ending.killed):
            _hand_over_start(solver, job)
        if not job.solution.exists():
            raise SolverError(_no_answer(solver, job, ending), file=job.model)
        return Answer(None, ending.interrupted)

    return run


def _no_answer(solver: str, job: Job, ending: Ending) -> str:
    """What is said of a solver that left nothing: how it ended, and its last words."""
    if ending.killed and not ending.interrupted:
        return f"{solver} left no answer within its time; give it more, or a start"
    last = job.log.read_text("utf-8", "replace").strip().splitlines()[-1:] or ["nothing in its log"]
    how = "interrupted" if ending.interrupted else f"exit code {ending.code}"
    return f"{solver} left no answer ({how}): {last[0][:200]}; see {job.log.name} beside it"


def _hand_over_start(solver: str, job: Job) -> None:
    """Leave the start as the answer of a solver that was stopped before it had one, if it is a point of the problem."""
    if job.start is not None and job.problem.violation(job.start).worst <= _FEASIBLE:
        message = (
            f"{solver}: stopped at its limit or by Ctrl-C, nothing better than the start\n{job.problem.stamp}"
        )
        point = job.start[Layout(job.problem).order]
        write_ampl_sol(job.solution, message, point, job.problem.row_count, _LIMIT)


SOLVERS: Final = {
    solver.name: solver
    for solver in (
        Solver("highs", "HiGHS on the .mps: MILP, LP, convex QP", "mps", "highspy", _run_highs),
        Solver(
            "ipopt", "Ipopt on the .nl: continuous problems, local optimum where they are not convex", "nl", "casadi", _casadi("ipopt"),
            local=True,
        ),
        Solver("bonmin", "Bonmin (branch and bound) on the .nl: convex mixed-integer problems of small size", "nl", "casadi", _casadi("bonmin")),
    )
}  # fmt: skip
"""The table of local solvers."""

_PREFERRED: Final = ("highs", "ipopt", "bonmin")


def solver_for(problem: Problem, name: str | None = None) -> Solver:
    """The solver of that name, or the preferred one for the problem's class, before those whose format holds a weaker relaxation of it.

    Raises UnsupportedBySolverError when it does not take the class, MissingSolverError when its package is absent.
    """
    if name is not None and name not in SOLVERS:
        raise InputError(f"there is no solver {name!r}; choose one of {', '.join(SOLVERS)}")
    candidates = (
        [name] if name else ["ipopt", "bonmin"] if problem.problem_class == "QP" else list(_PREFERRED)
    )
    refusals = {candidate: refusal(problem, SOLVERS[candidate]) for candidate in candidates}
    willing = [SOLVERS[candidate] for candidate, reason in refusals.items() if not reason]
    if not willing:
        reasons = ", ".join(f"{candidate} ({reason})" for candidate, reason in refusals.items())
        raise UnsupportedBySolverError(
            f"{problem.name} is {_described(problem)}, which is not for {reasons}; see `crossfield list` for who takes what, or relax it"
        )
    installed = [solver for solver in willing if find_spec(solver.package) is not None]
    if not installed:
        first = willing[0]
        raise MissingSolverError(
            f"{first.name} needs the Python package {first.package}, which is not installed; pip install {first.package}"
        )
    return min(installed, key=lambda entry: carried(problem, FORMATS[entry.format]).formulation.weakened)


def refusal(problem: Problem, solver: Solver) -> str:
    """Why the solver does not take the problem in the format it reads; empty when it does."""
    taking = takes_in(problem, solver.name, solver.format)
    return "" if taking.answer == "yes" or (taking.answer == "local" and solver.local) else taking.reason


def _described(problem: Problem) -> str:
    return f"{'a convex' if problem.convex else 'a non-convex'} {problem.problem_class}"


def solve(
    problem: Problem,
    solver: str | None = None,
    folder: str | Path | None = None,
    *,
    limits: Limits | None = None,
    start: CrossField | None = None,
) -> Solution:
    """The solution that a local solver finds, read back from the file it leaves and checked, all within the time limit.

    Written file, log and solution stay in `folder` when one is given, with the manifest that reads the solution back. start: a field whose complete point is handed over as
    incumbent or starting point. Ctrl-C ends the solver and gives its best point so far.
    Raises UnsupportedBySolverError, MissingSolverError, SolverError, OutputError.
    """
    chosen = solver_for(problem, solver)
    if folder is None:
        with tempfile.TemporaryDirectory(prefix="crossfield-") as temporary:
            return _solve_in(Path(temporary), problem, chosen, limits or Limits(), start)
    return _solve_in(make_folder(folder), problem, chosen, limits or Limits(), start, lasting=True)


def _solve_in(
    folder: Path,
    problem: Problem,
    solver: Solver,
    limits: Limits,
    start: CrossField | None,
    *,
    lasting: bool = False,
) -> Solution:
    deadline = Deadline.after(limits.seconds)
    stem = f"{problem.instance.name}.{problem.name}"
    model, solution, log = (
        folder / f"{stem}{suffix}"
        for suffix in (FORMATS[solver.format].suffix, f".{solver.name}.sol", f".{solver.name}.log")
    )
    written = write(problem, model, start=start)
    held = written.problem
    if lasting and is_recordable(problem):
        leave_manifest(problem, written, folder)
    for stale in (solution, log):
        stale.unlink(missing_ok=True)
    begin = time.perf_counter()
    # Reading the answer takes about as long as writing the problem did.
    own = deadline.later(deadline.left() - limits.seconds)
    point = None if start is None else held.point(start)
    answer = solver.run(Job(model, solution, log, held, point, limits, own))
    seconds = time.perf_counter() - begin
    try:
        found = read_solution(solution, held)
    except SolutionError:
        solution.unlink(
            missing_ok=True
        )  # cut off by a full disk, most likely: nobody shall take it for an answer
        raise
    return replace(found, bound=answer.bound, interrupted=answer.interrupted, seconds=seconds)
