"""HiGHS: reads LP and MPS and solves LPs, MILPs and convex QPs. It reads no quadratic rows."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import highspy
import numpy as np

from ...models.errors import OutputError
from ...models.processes.child_program import is_stopped
from ..quiet_highs import new_model
from ..statuses import finite_or_none
from .model_content import Algebra, entries_of_triangle, numbered
from .protocol import Job, Outcome, RefusedError, write_in_full

_RAW: Final = 0
"""The style of solution files that HiGHS reads and writes with all digits."""
_TICK: Final = 0.1
"""Seconds between two checks of a running solver."""


def version() -> str:
    """Version of HiGHS."""
    return str(new_model().version())


def load_model(path: Path, *, silent: bool = True, **options: str | float) -> Any:
    """Model of an LP or MPS file, with these options. Raises RefusedError if HiGHS cannot read it.

    The options are set afterwards: HiGHS applies a time limit to reading too and then reports an error.
    """
    highs = new_model() if silent else highspy.Highs()  # type: ignore[no-untyped-call]
    set_options(highs, output_flag="false" if silent else "true")
    if highs.readModel(str(path)) == highspy.HighsStatus.kError:
        raise RefusedError("HiGHS cannot read it", file=path)
    set_options(highs, **options)
    return highs


def set_options(highs: Any, **options: str | float) -> None:
    """Set options by name; a number of threads that differs from an earlier solve takes effect."""
    for option, value in options.items():
        highs.setOptionValue(option, value)
    if options.get("threads"):
        highspy.Highs.resetGlobalScheduler(True)  # noqa: FBT003 - otherwise the old number is kept


def write_solution(highs: Any, solution: Path) -> None:
    """Write the solution file. Raises OutputError."""
    with write_in_full(solution) as part:
        if highs.writeSolution(str(part), _RAW) == highspy.HighsStatus.kError:
            raise OutputError(
                "HiGHS cannot write it; free some space or choose another folder", file=solution
            )


def read(path: Path) -> Algebra:
    """The file as HiGHS reads it."""
    highs = load_model(path)
    return content_of(highs, list(highs.getLp().col_names_), list(highs.getLp().row_names_))


def content_of(highs: Any, columns: list[str], rows: list[str]) -> Algebra:
    """The content of a model, with names of its columns and rows."""
    lp, hessian = highs.getLp(), highs.getModel().hessian_
    if lp.sense_ != highspy.ObjSense.kMinimize or lp.offset_ != 0:
        raise RefusedError("it is not minimised, or has a constant besides ONE")
    column, row, value = _columnwise(lp.a_matrix_, lp.num_col_)
    entries: list[Any] = [*numbered(lp.col_cost_)]
    entries += zip(row.tolist(), column.tolist(), value.tolist(), strict=True)
    if hessian.dim_:  # the lower triangle of x'Qx/2
        entries += entries_of_triangle(*_columnwise(hessian, hessian.dim_))
    return Algebra.of(
        columns,
        rows,
        entries,
        lower=lp.col_lower_,
        upper=lp.col_upper_,
        integer=[kind == highspy.HighsVarType.kInteger for kind in lp.integrality_] or [False] * lp.num_col_,
        row_lower=lp.row_lower_,
        row_upper=lp.row_upper_,
    )


def _columnwise(matrix: Any, columns: int) -> tuple[Any, Any, Any]:
    start, index, value = (np.array(part) for part in (matrix.start_, matrix.index_, matrix.value_))
    return np.repeat(np.arange(columns), np.diff(start)[:columns]), index, value


def solve(job: Job) -> Outcome:
    """Solve the file; the solution is HiGHS' raw style, which has no bound."""
    highs = load_model(
        job.model, silent=False, mip_rel_gap=job.gap, time_limit=job.seconds, threads=job.threads
    )
    if job.precise and not highs.getModel().hessian_.dim_:  # the QP method fails with such tolerances
        set_options(
            highs, mip_abs_gap=1e-9, mip_feasibility_tolerance=1e-9, primal_feasibility_tolerance=1e-9
        )
    if job.start is not None:
        highs.readSolution(str(job.start), _RAW)
    _run(highs)
    if highs.getModelStatus() == highspy.HighsModelStatus.kNotset:
        raise RefusedError("HiGHS answers with an error (model status Not Set)", file=job.model)
    write_solution(highs, job.solution)
    if not len(highs.getLp().integrality_):
        return Outcome()
    info = highs.getInfo()
    return Outcome(bound=finite_or_none(info.mip_dual_bound), nodes=info.mip_node_count)


def _run(highs: Any) -> None:
    """Solve; a request to stop ends the search and keeps the incumbent."""
    highs.HandleUserInterrupt = True
    highs.startSolve()
    while not (is_stopped() or highs.wait(_TICK)[0]):
        pass
    if is_stopped():
        highs.cancelSolve()
    while not highs.wait(_TICK)[0]:
        pass
