"""The driver of Ipopt and Bonmin: a child process (casadi_driver.py) reads the .nl and leaves a .sol.

A crash of a solver, or one that heeds no limit, takes the child alone.
"""

from __future__ import annotations

from typing import Final

from ..formats.nl import Layout
from ..solutions.readers.ampl import write_ampl_sol
from .child import solved_by
from .job import Job, RunEnd

_LIMIT: Final = 400
"""AMPL's solve code for a limit."""


def run(job: Job) -> RunEnd:
    """How the solve of the job ended; its solution file is there, and its log if the solver was started.

    Raises SolverError.
    """
    arguments = job.solver, job.model, job.solution, float(job.limits.gap), job.problem.stamp
    ended = solved_by("casadi_driver", map(str, arguments), job, lambda: _leave_start(job))
    return RunEnd(ended.interrupted)


def _leave_start(job: Job) -> None:
    """Make the start the answer of a solver that was stopped before it had one."""
    assert job.start is not None
    words = "stopped at its limit or by Ctrl-C, nothing better than the start"
    message = f"{job.solver}: {words}\n{job.problem.stamp}"
    point = job.start[Layout(job.problem).order]
    write_ampl_sol(job.solution, message, point, job.problem.row_count, _LIMIT)
