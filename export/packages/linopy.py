"""Models of linopy, which hands them to other packages."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from ...models.formulations.problem import Problem
from ..statuses import Status, claim_of
from ..writing.stamps import one_column_name
from .gurobi import GUROBI
from .highs import HIGHS
from .package import Claims, Package, Values, degrees
from .scip import SCIP


def _build(problem: Problem) -> Any:
    import linopy
    import pandas as pd
    import xarray

    arrays, names, model = problem.to_arrays(names=False), np.array(problem.column_names), linopy.Model()
    labels = []
    for name, block in problem.blocks.items():
        if block.count:
            index = pd.Index(names[block.slice], name=f"columns_{name}")
            variable = model.add_variables(
                block.lower, block.upper, [index], name=name, integer=block.integer
            )
            labels += variable.labels.to_numpy().tolist()

    def terms(places: Any, factors: Any) -> Any:
        parts = {"coeffs": (("column", "_term"), np.reshape(factors, (-1, 1)))}
        parts["vars"] = (("column", "_term"), np.array(labels)[places][:, None])
        return linopy.LinearExpression(xarray.Dataset(parts, {"column": np.arange(len(places))}), model)

    one = model.add_variables(1, 1, name=one_column_name(problem.stamp).decode())  # it takes no constant
    goal = terms(np.arange(len(labels)), arrays.c).sum() + arrays.constant * one
    if arrays.q.nnz:
        q = arrays.q.tocoo()
        goal = goal + (terms(q.row, q.data / 2) * terms(q.col, np.ones(q.nnz))).sum()
    model.add_objective(goal)
    a = arrays.a.tocoo()
    if a.nnz:
        entries = pd.RangeIndex(a.nnz, name="column")
        sums = terms(a.col, a.data).groupby(pd.Series(a.row, entries, name="row")).sum()
        rows = sums.indexes["row"].to_numpy()
        lower, upper = arrays.row_lower[rows], arrays.row_upper[rows]
        index = pd.Index(np.array(problem.row_names)[rows], name="row")
        senses = np.select([lower == upper, np.isfinite(lower)], ["=", ">="], "<=")
        model.add_constraints(
            sums.assign_coords(row=index),
            xarray.DataArray(senses, [index]),
            xarray.DataArray(np.where(np.isfinite(lower), lower, upper), [index]),
            name="rows",
        )
    return model


def _claims(model: Any) -> Claims:
    """The claims of the solver's own model where it has one that is in the table."""
    title, words = " ".join(model.variables), str(model.termination_condition)
    if model.status == "initialized":
        return Claims(title, Status.UNKNOWN, words, has_point=False)
    for package in (HIGHS, GUROBI, SCIP):
        if package.is_model(model.solver_model):
            return package.claims(model.solver_model)._replace(title=title)
    return Claims(title, claim_of(words, "other")[0], words, has_point=True)


def _values(model: Any, _problem: Problem) -> Values:
    variables = [model.variables[name] for name in model.variables]
    columns = [variable.solution.to_series() for variable in variables if variable.dims]
    return {name: value for series in columns for name, value in series.items()}


LINOPY: Final = Package(
    "linopy",
    "linopy.Model",
    "linear rows and quadratic objectives",
    degrees(2, 1),
    "choose miqp-exact or milp-mccormick",
    _build,
    _claims,
    _values,
    "model.solve()",
    lifts=True,
)
