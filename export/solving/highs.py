"""The driver of HiGHS: in this process it reads a written file, solves, and leaves a solution file."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import highspy
import numpy as np

from ...models.errors import OutputError, SolverError
from ...models.formulations.problem import Problem
from ...models.instance.grid import Floats
from ..writing.names import ONE, column_names
from .job import Job, RunEnd

_TICK: Final = 0.1
"""Seconds between two looks at a running solver."""


def version() -> str:
    """The version of HiGHS."""
    return str(_model().version())


def _model() -> Any:
    return highspy.Highs()  # type: ignore[no-untyped-call]


def loaded(path: Path, log: Path | None = None, **options: str | float) -> Any:
    """The model of an LP or MPS file in HiGHS, with these options; silent, or with its output in a log.

    Raises SolverError when HiGHS does not read the file.
    """
    highs = _model()
    quiet = {"output_flag": "false"} if log is None else {"log_to_console": "false", "log_file": str(log)}
    set_options(highs, **quiet, **options)
    if highs.readModel(str(path)) == highspy.HighsStatus.kError:
        see = "" if log is None else f"; see {log.name} beside it"
        raise SolverError(f"HiGHS cannot read it{see}", file=path)
    return highs


def set_options(highs: Any, **options: str | float) -> None:
    """Set options by name; another number of threads than that of an earlier solve counts too."""
    for option, value in options.items():
        highs.setOptionValue(option, value)
    if options.get("threads"):
        highspy.Highs.resetGlobalScheduler(True)  # noqa: FBT003 - else that of the earlier solve is kept


def solved(highs: Any, path: Path) -> Any:
    """The model once its search is over. Raises SolverError, with its file, when that is an error."""
    if highs.run() == highspy.HighsStatus.kError:
        raise SolverError("HiGHS answers with an error (model status Not Set)", file=path)
    return highs


def leave(highs: Any, solution: Path) -> None:
    """Write the solution file. Raises OutputError."""
    if highs.writeSolution(str(solution), 0) == highspy.HighsStatus.kError:
        raise OutputError("HiGHS cannot write it; free some space or choose another folder", file=solution)


def dual_bound(highs: Any) -> float | None:
    """The dual bound that a search over integers came to; None where there is none."""
    bound = highs.getInfo().mip_dual_bound if len(highs.getLp().integrality_) else None
    return bound if bound is not None and np.isfinite(bound) else None


def run(job: Job) -> RunEnd:
    """How the solve of the job ended; its solution file and its log are there.

    Raises SolverError, OutputError.
    """
    highs = loaded(job.model, job.log, mip_rel_gap=job.limits.gap, threads=job.limits.threads)
    if job.start is not None:
        highs.setSolution(_start(highs, job.problem, job.start))
    set_options(highs, time_limit=job.deadline.left())
    interrupted = _interruptibly(highs)
    leave(highs, job.solution)
    return RunEnd(interrupted, dual_bound(highs))


def _interruptibly(highs: Any) -> bool:
    """Solve. Whether the user interrupted: that ends the search and keeps the incumbent."""
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


def _start(highs: Any, problem: Problem, start: Floats) -> Any:
    names = [bytes(row).rstrip(b"\0").decode() for row in column_names(problem)]
    values = dict(zip(names, start.tolist(), strict=True)) | {ONE.decode(): 1.0}
    given = highspy.HighsSolution()
    given.col_value = [values[name] for name in highs.getLp().col_names_]
    return given
