"""The driver of Ipopt and Bonmin: a child process (casadi_driver.py) reads the .nl and leaves a .sol.

A crash of a solver, or one that heeds no limit, takes the child alone.
"""

from __future__ import annotations

import sys
from typing import Final

from ...models.errors import SolverError
from ..formats.nl import Layout
from ..solutions.readers.ampl import write_ampl_sol
from .child import ChildExit, run_child
from .job import Job, RunEnd

_FEASIBLE: Final = 1e-6
"""Violation up to which a start is a point of the problem: the solvers' own tolerance."""
_LIMIT: Final = 400
"""AMPL's solve code for a limit."""


def run(job: Job) -> RunEnd:
    """How the solve of the job ended; its solution file and its log are there. Raises SolverError."""
    # -P: a folder `crossfield` or a file casadi.py where the user happens to be is not meant.
    program = [sys.executable, "-P", "-m", "crossfield.export.solving.casadi_driver"]
    files, numbers = [str(job.model), str(job.solution)], [job.deadline.at, float(job.limits.gap)]
    command = [*program, job.solver, *files, *map(repr, numbers), job.problem.stamp]
    ended = run_child(command, job.log, job.deadline)
    if not job.solution.exists() and (ended.interrupted or ended.killed):
        _hand_over_start(job)
    if not job.solution.exists():
        raise SolverError(_no_answer(job, ended), file=job.model)
    return RunEnd(ended.interrupted)


def _no_answer(job: Job, ended: ChildExit) -> str:
    """What is said of a solver that left nothing: how it ended, and its last words."""
    if ended.killed and not ended.interrupted:
        return f"{job.solver} left no answer within its time; give it more, or a start"
    last = job.log.read_text("utf-8", "replace").strip().splitlines()[-1:] or ["nothing in its log"]
    how = "interrupted" if ended.interrupted else f"exit code {ended.code}"
    return f"{job.solver} left no answer ({how}): {last[0][:200]}; see {job.log.name} beside it"


def _hand_over_start(job: Job) -> None:
    """Leave the start, if it is feasible, as the answer of a solver that was stopped before it had one."""
    if job.start is not None and job.problem.violation(job.start).worst <= _FEASIBLE:
        words = "stopped at its limit or by Ctrl-C, nothing better than the start"
        message = f"{job.solver}: {words}\n{job.problem.stamp}"
        point = job.start[Layout(job.problem).order]
        write_ampl_sol(job.solution, message, point, job.problem.row_count, _LIMIT)
