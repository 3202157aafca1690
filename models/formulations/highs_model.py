"""A problem handed to HiGHS by arrays, without a file."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse

from ..errors import SolverError, UnsupportedBySolverError
from .arrays import ProblemArrays


def check_highs(problem_class: str, *, convex: bool) -> None:
    """Do nothing if HiGHS takes problems of a class.

    Raises
    ------
    UnsupportedBySolverError
        For quadratic rows, an objective that is quadratic and not convex, or quadratic with integers, and
        for everything beyond degree 2.

    """
    if problem_class in {"LP", "MILP"} or (problem_class == "QP" and convex):
        return
    kind = f"{'a convex' if convex else 'a non-convex'} {problem_class}"
    raise UnsupportedBySolverError(
        f"HiGHS takes LP, MILP and convex QP, but this is {kind}; choose milp-mccormick or qp-fixed, "
        "relax=True, or a solver that `crossfield list` shows for it"
    )


def highs_of(arrays: ProblemArrays, name: str) -> Any:
    """Return a `highspy.Highs` that holds the arrays. Raises SolverError if HiGHS refuses them."""
    import highspy

    model = highspy.HighsModel()
    lp, by_column = model.lp_, arrays.a.tocsc()
    lp.num_col_, lp.num_row_ = len(arrays.c), arrays.a.shape[0]
    lp.col_cost_, lp.offset_, lp.model_name_ = arrays.c, arrays.constant, name
    lp.col_lower_, lp.col_upper_ = arrays.lower, arrays.upper
    lp.row_lower_, lp.row_upper_ = arrays.row_lower, arrays.row_upper
    lp.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    _fill(lp.a_matrix_, by_column)
    if arrays.integer.any():
        kinds = np.array([highspy.HighsVarType.kContinuous, highspy.HighsVarType.kInteger])
        lp.integrality_ = kinds[arrays.integer.astype(np.intp)].tolist()
    if arrays.column_names is not None and arrays.row_names is not None:
        lp.col_names_, lp.row_names_ = arrays.column_names.tolist(), arrays.row_names.tolist()
    if arrays.q.nnz:
        model.hessian_.dim_ = len(arrays.c)
        model.hessian_.format_ = highspy.HessianFormat.kTriangular
        _fill(model.hessian_, sparse.tril(arrays.q, format="csc"))
    solver = highspy.Highs()  # type: ignore[no-untyped-call]
    solver.setOptionValue("output_flag", False)  # noqa: FBT003 - as highspy has it
    if solver.passModel(model) == highspy.HighsStatus.kError:
        raise SolverError(f"HiGHS {solver.version()} refuses the arrays of {name}")
    return solver


def _fill(matrix: Any, columns: sparse.csc_array) -> None:
    columns.sort_indices()
    matrix.start_ = columns.indptr.astype(np.int32)
    matrix.index_ = columns.indices.astype(np.int32)
    matrix.value_ = columns.data
