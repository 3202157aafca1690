"""Solving here: write the file, let a driver solve it, read the answer back as anybody's.

So a solve tests the file too. Which solvers are driven, and by which module of this folder, stands in the
table of solvers.
"""

from __future__ import annotations

import tempfile
import time
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np

from ...models.errors import InputError, MissingSolverError, SolutionError, UnsupportedBySolverError
from ...models.field.field import CrossField
from ...models.formulations.problem import Problem
from ...models.instance.grid import Floats
from ...models.processes.deadline import Deadline
from ...models.storage import make_folder
from ..bundle.manifest import is_recordable, leave_manifest
from ..formats.registry import FORMATS, carried, write
from ..solutions.solution import Solution, read_solution
from ..solvers_table import DRIVEN, PROGRAMS, Solver, takes_in
from .child import FEASIBLE
from .job import Job, Limits, RunEnd


def solver_for(problem: Problem, name: str | None = None) -> Solver:
    """The solver of that name, or the preferred one for the problem's class.

    One whose format holds a weaker relaxation of the problem comes after the others. Raises
    UnsupportedBySolverError when it does not take the class, MissingSolverError when its package is absent.
    """
    if name is not None and name not in DRIVEN:
        raise InputError(f"there is no solver {name!r}; choose one of {', '.join(DRIVEN)}")
    asked = [DRIVEN[name]] if name else [s for s in DRIVEN.values() if problem.problem_class not in s.not_for]
    refusals = {solver.name: refusal(problem, solver) for solver in asked}
    willing = [solver for solver in asked if not refusals[solver.name]]
    if not willing:
        reasons = ", ".join(f"{solver} ({reason})" for solver, reason in refusals.items())
        raise UnsupportedBySolverError(
            f"{problem.name} is {_described(problem)}, which is not for {reasons}; "
            "see `crossfield list` for who takes what, or relax it"
        )
    installed = [solver for solver in willing if not solver.missing]
    if not installed:
        first, package = willing[0], PROGRAMS[willing[0].program].needs
        raise MissingSolverError(
            f"{first.name} needs the Python package {package}, which is not installed; {first.missing}"
        )
    return min(installed, key=lambda each: carried(problem, FORMATS[each.formats[0]]).formulation.weakened)


def refusal(problem: Problem, solver: Solver) -> str:
    """Why a solver that is driven here does not take the problem in the format it reads; empty when it does.

    An answer without proof is wanted only of a solver that proves nothing anyway.
    """
    taking = takes_in(problem, solver.name, solver.formats[0])
    wanted = taking.answer == "yes" or (taking.answer == "local" and solver.proves == "local")
    return "" if wanted else taking.reason


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
    """The solution that a solver finds here, read back from its file and checked, all within the time limit.

    Written file, log and solution stay in `folder` when one is given, with the manifest that reads the
    solution back. start: a field whose complete point is handed over as incumbent or starting point. Ctrl-C
    ends the solver and gives its best point so far. Raises UnsupportedBySolverError, MissingSolverError,
    SolverError, OutputError.
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
        for suffix in (FORMATS[solver.formats[0]].suffix, f".{solver.name}.sol", f".{solver.name}.log")
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
    ended = _run(solver, Job(solver.name, model, solution, log, held, point, limits, own))
    seconds = time.perf_counter() - begin
    try:
        found = read_solution(solution, held)
    except SolutionError:
        # It is cut off by a full disk, most likely: nobody shall take it for an answer.
        solution.unlink(missing_ok=True)
        raise
    return replace(
        found,
        bound=ended.bound,
        interrupted=ended.interrupted,
        seconds=seconds,
        start_returned=_is_start(found.point, point),
    )


def _is_start(point: Floats | None, start: Floats | None) -> bool | None:
    """Whether the answer is the start but for rounding; None without the one or the other."""
    if point is None or start is None:
        return None
    return bool(np.abs(point - start).max(initial=0.0) <= FEASIBLE)


def _run(solver: Solver, job: Job) -> RunEnd:
    driver = import_module(f".{solver.driver}", __package__)
    ended: RunEnd = driver.run(job)
    return ended
