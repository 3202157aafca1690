"""Local solvers: each reads the file that was written, so that a solve tests the file too.

HiGHS reads the .mps in this process; Ipopt and Bonmin read the .nl in a child process, which a crash or a limit takes alone.
Each leaves a solution file, which goes through the same readers as anybody's.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from ..models.errors import InputError, MissingSolverError, SolverError, UnsupportedBySolverError
from ..models.field import CrossField
from ..models.grid import Floats
from ..models.problem import Problem
from ..models.storage import make_folder
from .formats import FORMATS, carried, write
from .names import ONE, column_names
from .solution import Solution, read_solution

GRACE: Final = 5.0
"""Seconds that a child may take beyond its limit, for reading the file; then it is interrupted, and later killed."""


@dataclass(frozen=True)
class Limits:
    """Seconds of a solve, relative gap at which a discrete search may stop, threads (0: the solver's choice)."""

    seconds: float = 60.0
    gap: float = 1e-6
    threads: int = 0

    def __post_init__(self) -> None:
        """Check the ranges."""
        if not (self.seconds > 0 and self.gap >= 0 and self.threads >= 0):
            raise InputError(f"time limit {self.seconds}, gap {self.gap}, threads {self.threads}: they must be positive numbers")


class Answer(NamedTuple):
    """What a run left: the solution file, and the solver's dual bound where it tells one."""

    solution: Path
    bound: float | None


Run = Callable[[Path, Floats | None, Problem, Limits], Answer]


@dataclass(frozen=True)
class Solver:
    """A local solver: what it reads, which classes it solves (True: only convex ones), and what it is called in Python."""

    name: str
    summary: str
    format: str
    classes: dict[str, bool]
    package: str
    run: Run

    def refusal(self, problem_class: str, *, convex: bool) -> str:
        """Why it does not take problems of this class; empty when it does."""
        if problem_class not in self.classes:
            return f"{self.name} does not solve {problem_class}"
        if self.classes[problem_class] and not convex:
            return f"{self.name} solves {problem_class} only when it is convex"
        return ""


def _run_highs(model: Path, start: Floats | None, problem: Problem, limits: Limits) -> Answer:
    import highspy

    highs = highspy.Highs()
    log = model.with_suffix(".highs.log")
    log.unlink(missing_ok=True)
    highs.setOptionValue("log_to_console", False)
    highs.setOptionValue("log_file", str(log))
    if highs.readModel(str(model)) == highspy.HighsStatus.kError:
        raise SolverError("HiGHS cannot read it; see the .log beside it", file=model)
    for option, value in (("time_limit", limits.seconds), ("mip_rel_gap", limits.gap), ("threads", limits.threads)):
        highs.setOptionValue(option, value)
    if start is not None:
        highs.setSolution(_highs_start(highs, problem, start))
    highs.HandleKeyboardInterrupt = True
    _highs_solve(highs)
    solution = model.with_suffix(".highs.sol")
    highs.writeSolution(str(solution), 0)
    bound = highs.getInfo().mip_dual_bound if problem.integer.any() else None
    return Answer(solution, bound if bound is not None and np.isfinite(bound) else None)


def _highs_solve(highs: Any) -> None:
    """Solve; an interrupt ends the search and keeps the incumbent."""
    try:
        highs.solve()
    except KeyboardInterrupt:
        highs.cancelSolve()


def _highs_start(highs: Any, problem: Problem, start: Floats) -> Any:
    import highspy

    names = [bytes(row).rstrip(b"\0").decode() for row in column_names(problem)]
    values = dict(zip(names, start.tolist(), strict=True)) | {ONE.decode(): 1.0}
    given = highspy.HighsSolution()
    given.col_value = [values[name] for name in highs.getLp().col_names_]
    return given


def _casadi(solver: str) -> Run:
    def run(model: Path, _start: Floats | None, _problem: Problem, limits: Limits) -> Answer:
        solution, log = model.with_suffix(f".{solver}.sol"), model.with_suffix(f".{solver}.log")
        solution.unlink(missing_ok=True)
        arguments = [solver, str(model), str(solution), repr(float(limits.seconds)), repr(float(limits.gap))]
        code = _child([sys.executable, "-m", "crossfield.export.casadi_driver", *arguments], log, limits.seconds)
        if not solution.exists():
            last = log.read_text("utf-8", "replace").strip().splitlines()[-1:] or ["nothing in its log"]
            raise SolverError(f"{solver} left no answer (exit code {code}): {last[0][:200]}", file=model)
        return Answer(solution, None)

    return run


def _child(command: list[str], log: Path, seconds: float) -> int:
    """The exit code of a child, its output in `log`; interrupted when the limit has passed or the user interrupts."""
    with log.open("wb") as output:
        child = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, start_new_session=True)
        try:
            return child.wait(seconds + GRACE)
        except (KeyboardInterrupt, subprocess.TimeoutExpired):
            child.send_signal(signal.SIGINT)
            try:
                return child.wait(4 * GRACE)
            except subprocess.TimeoutExpired:
                child.kill()
                return child.wait()
        finally:
            if child.poll() is None:
                child.kill()


SOLVERS: Final = {
    solver.name: solver
    for solver in (
        Solver("highs", "HiGHS on the .mps: MILP, LP, convex QP", "mps", {"LP": False, "MILP": False, "QP": True}, "highspy", _run_highs),
        Solver(
            "ipopt", "Ipopt on the .nl: continuous problems, local optimum where they are not convex", "nl",
            {"LP": False, "QP": False, "QCP": False, "NLP": False}, "casadi", _casadi("ipopt"),
        ),
        Solver(
            "bonmin", "Bonmin (branch and bound) on the .nl: convex mixed-integer problems of small size", "nl",
            {"LP": False, "QP": True, "MILP": False, "MIQP": True}, "casadi", _casadi("bonmin"),
        ),
    )
}  # fmt: skip
"""The table of local solvers: which may solve which class. Others are refused by name."""

_PREFERRED: Final = ("highs", "ipopt", "bonmin")


def solver_for(problem: Problem, name: str | None = None) -> Solver:
    """The solver of that name, or the preferred one for the problem's class.

    Raises UnsupportedBySolverError when it does not take the class, MissingSolverError when its package is absent.
    """
    if name is not None and name not in SOLVERS:
        raise InputError(f"there is no solver {name!r}; choose one of {', '.join(SOLVERS)}")
    candidates = [name] if name else ["ipopt", "bonmin"] if problem.problem_class == "QP" else list(_PREFERRED)
    refusals = {candidate: refusal(problem, SOLVERS[candidate]) for candidate in candidates}
    willing = [SOLVERS[candidate] for candidate, reason in refusals.items() if not reason]
    if not willing:
        reasons = "; ".join(refusals.values())
        raise UnsupportedBySolverError(f"{problem.name} is {_described(problem)}: {reasons}; see `crossfield list` for who takes what, or relax it")
    if find_spec(willing[0].package) is None:
        raise MissingSolverError(f"{willing[0].name} needs the package {willing[0].package}; install it with pip")
    return willing[0]


def refusal(problem: Problem, solver: Solver) -> str:
    """Why the solver does not take the problem in the format it reads; empty when it does."""
    entry = FORMATS[solver.format]
    if max(problem.objective_degree, problem.row_degree) > entry.degree and problem.formulation.equivalent:
        return f"{solver.name} reads .{solver.format}, which cannot carry {problem.name}"
    held = carried(problem, entry)
    return solver.refusal(held.problem_class, convex=held.convex)


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
    """The solution that a local solver finds, read back from the file it leaves and checked.

    Written file, log and solution stay in `folder` when one is given. start: a field whose complete point is handed over as
    incumbent or starting point. Ctrl-C ends the solver and gives its best point so far.
    Raises UnsupportedBySolverError, MissingSolverError, SolverError, OutputError.
    """
    chosen = solver_for(problem, solver)
    if folder is None:
        with tempfile.TemporaryDirectory(prefix="crossfield-") as temporary:
            return _solve_in(Path(temporary), problem, chosen, limits or Limits(), start)
    return _solve_in(make_folder(folder), problem, chosen, limits or Limits(), start)


def _solve_in(folder: Path, problem: Problem, solver: Solver, limits: Limits, start: CrossField | None) -> Solution:
    model = folder / f"{problem.instance.name}.{problem.name}{FORMATS[solver.format].suffix}"
    held = write(problem, model, start=start).problem
    begin = time.perf_counter()
    answer = solver.run(model, None if start is None else held.point(start), held, limits)
    seconds = time.perf_counter() - begin
    return replace(read_solution(answer.solution, held), bound=answer.bound, seconds=seconds)
