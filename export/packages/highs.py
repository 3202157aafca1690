"""Models of HiGHS."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from scipy import sparse

from ...models.errors import SolverError
from ...models.formulations.arrays import ProblemArrays
from ...models.formulations.problem import Problem
from ..statuses import OPTIMAL_GAP, Status, claim_of, finite_or_none
from .package import Claims, Package, Values, title_of


def _can_hold(problem: Problem) -> bool:
    return problem.problem_class in {"LP", "MILP"} or (problem.problem_class == "QP" and problem.is_convex)


def _build(problem: Problem) -> Any:
    return highs_of(problem.to_arrays(), title_of(problem))


def highs_of(arrays: ProblemArrays, name: str) -> Any:
    """Return a `highspy.Highs` that holds the arrays. Raises SolverError if HiGHS refuses them."""
    import highspy

    from ..quiet_highs import new_model

    model = highspy.HighsModel()
    lp, by_column = model.lp_, arrays.a.tocsc()
    lp.num_col_, lp.num_row_ = len(arrays.c), arrays.a.shape[0]
    lp.col_cost_, lp.offset_, lp.model_name_ = arrays.c, arrays.constant, name
    lp.col_lower_, lp.col_upper_ = arrays.lower, arrays.upper
    lp.row_lower_, lp.row_upper_ = arrays.row_lower, arrays.row_upper
    lp.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    _fill_matrix(lp.a_matrix_, by_column)
    if arrays.integer.any():
        kinds = np.array([highspy.HighsVarType.kContinuous, highspy.HighsVarType.kInteger])
        lp.integrality_ = kinds[arrays.integer.astype(np.intp)].tolist()
    if arrays.column_names is not None and arrays.row_names is not None:
        lp.col_names_, lp.row_names_ = arrays.column_names.tolist(), arrays.row_names.tolist()
    if arrays.q.nnz:
        model.hessian_.dim_ = len(arrays.c)
        model.hessian_.format_ = highspy.HessianFormat.kTriangular
        _fill_matrix(model.hessian_, sparse.tril(arrays.q, format="csc"))
    solver = new_model()
    solver.setOptionValue("output_flag", False)  # noqa: FBT003 - as highspy has it
    if solver.passModel(model) == highspy.HighsStatus.kError:
        raise SolverError(f"HiGHS {solver.version()} refuses the arrays of {name}")
    if arrays.q.nnz and not arrays.a.shape[0]:  # HiGHS 1.15 calls poor points of a QP without rows optimal
        solver.addRow(-np.inf, np.inf, 0, np.zeros(0, np.int32), np.zeros(0))
    return solver


def _fill_matrix(matrix: Any, columns: sparse.csc_array) -> None:
    columns.sort_indices()
    matrix.start_ = columns.indptr.astype(np.int32)
    matrix.index_ = columns.indices.astype(np.int32)
    matrix.value_ = columns.data


def _claims(model: Any) -> Claims:
    words, info = model.modelStatusToString(model.getModelStatus()), model.getInfo()
    status = Status.UNKNOWN if words == "Not Set" else claim_of(words, "highs")[0]
    is_mip = bool(len(model.getLp().integrality_))
    if status.is_optimal and not is_mip and not abs(info.primal_dual_objective_error) <= OPTIMAL_GAP[0]:
        status = Status.LIMIT_WITH_POINT
        words = (
            f"{words}, although primal and dual objective differ by {info.primal_dual_objective_error:.2g}"
        )
    without = {Status.INFEASIBLE, Status.UNBOUNDED, Status.UNKNOWN}
    return Claims(
        model.getLp().model_name_,
        status,
        words,
        has_point=model.getSolution().value_valid and status not in without,
        objective=finite_or_none(info.objective_function_value),
        bound=finite_or_none(info.mip_dual_bound) if is_mip else None,
    )


def _values(model: Any, _problem: Problem) -> Values:
    values, names = model.getSolution().col_value, model.getLp().col_names_
    return dict(zip(names, values, strict=True)) if names else values


HIGHS: Final = Package(
    "HiGHS",
    "highspy.Highs",
    "LP, MILP and convex QP",
    _can_hold,
    "choose milp-mccormick or qp-fixed, relax=True, or a solver that `crossfield list` shows for it",
    _build,
    _claims,
    _values,
    "model.run()",
)
