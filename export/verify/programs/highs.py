"""HiGHS as a reader of LP and MPS. It reads no quadratic rows, and solves no MIQP."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import highspy
import numpy as np

from ....models.errors import SolverError
from ...solutions.readers.text import RawSolution, Status
from ...solving import highs as driver
from ...writing.terms import of_triangle, terms
from .protocol import Refused
from .reading import Meaning, told


def version() -> str:
    """Its version."""
    return driver.version()


def _load(path: Path) -> Any:
    try:
        return driver.loaded(path)
    except SolverError as error:
        raise Refused(str(error)) from error


def read(path: Path) -> Meaning:
    """The file as HiGHS reads it."""
    highs = _load(path)
    lp, hessian = highs.getLp(), highs.getModel().hessian_
    if lp.sense_ != highspy.ObjSense.kMinimize or lp.offset_ != 0:
        raise Refused("it is not minimised, or has a constant beside ONE")
    given: dict[str, Any] = {"lower": lp.col_lower_, "upper": lp.col_upper_, "costs": lp.col_cost_}
    given |= {"row_lower": lp.row_lower_, "row_upper": lp.row_upper_}
    if len(lp.integrality_):
        given["integer"] = [kind == highspy.HighsVarType.kInteger for kind in lp.integrality_]
    column, row, value = _columnwise(lp.a_matrix_, lp.num_col_)
    given["matrix"] = terms(np.stack([row, column], axis=1), value, indices=2)
    if hessian.dim_:
        column, row, value = _columnwise(hessian, hessian.dim_)  # the lower triangle of x'Qx/2
        given["quadratic"] = of_triangle(row, column, value)
    return Meaning.of(list(lp.col_names_), list(lp.row_names_), **given)


def _columnwise(matrix: Any, columns: int) -> tuple[Any, Any, Any]:
    start, index, value = (np.array(part) for part in (matrix.start_, matrix.index_, matrix.value_))
    return np.repeat(np.arange(columns), np.diff(start)[:columns]), index, value


_STATUS = {
    highspy.HighsModelStatus.kOptimal: Status.OPTIMAL_GLOBAL,
    highspy.HighsModelStatus.kInfeasible: Status.INFEASIBLE,
    highspy.HighsModelStatus.kTimeLimit: Status.LIMIT_WITH_POINT,
}


def solve(
    path: Path, seconds: float, _solver: str, gap: float = 0.0, start: Path | None = None
) -> RawSolution:
    """Its answer within the time."""
    highs = _load(path)
    if start is not None:
        highs.readSolution(str(start), 0)
    driver.set_options(highs, time_limit=seconds, mip_rel_gap=gap, mip_abs_gap=1e-9, threads=1)
    if not highs.getModel().hessian_.dim_:  # its QP method ends in an error with such tolerances
        driver.set_options(highs, mip_feasibility_tolerance=1e-9, primal_feasibility_tolerance=1e-9)
    try:
        driver.solved(highs, path)
    except SolverError as error:
        raise Refused(str(error)) from error
    words, info = highs.modelStatusToString(highs.getModelStatus()), highs.getInfo()
    status = _STATUS.get(highs.getModelStatus(), Status.ERROR)
    names, values, bound = highs.getLp().col_names_, highs.getSolution().col_value, driver.dual_bound(highs)
    nodes = info.mip_node_count if len(highs.getLp().integrality_) else None
    if status == Status.LIMIT_WITH_POINT and not info.primal_solution_status:
        return told(Status.LIMIT_WITHOUT_POINT, words, bound=bound, nodes=nodes)
    objective = info.objective_function_value if len(values) else None
    return told(status, words, names, values, objective=objective, bound=bound, nodes=nodes)
