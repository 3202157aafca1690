"""Models of Gurobi."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from scipy import sparse

from ...models.formulations.problem import Problem
from ..statuses import Status, claim_of, finite_or_none
from .package import Claims, Package, Values, degrees, title_of

_LOADED: Final = 1
"""Gurobi's status of a model that was not solved."""


def _build(problem: Problem) -> Any:
    import gurobipy

    arrays, kinds = problem.to_arrays(names=False), np.array(["C", "I"])
    model: Any = gurobipy.Model(title_of(problem), env=gurobipy.Env(params={"OutputFlag": 0}))
    columns = model.addMVar(
        len(arrays.c),
        lb=arrays.lower,
        ub=arrays.upper,
        vtype=kinds[arrays.integer.astype(np.intp)],
        name=problem.column_names,
    )
    model.setMObjective(
        arrays.q / 2 if arrays.q.nnz else None, arrays.c, arrays.constant, None, None, columns
    )
    equal, least = arrays.row_lower == arrays.row_upper, np.isfinite(arrays.row_lower)
    senses = np.select([equal, least], ["=", ">"], "<")
    sides = np.where(least, arrays.row_lower, arrays.row_upper)
    plain = np.setdiff1d(np.arange(len(sides)), arrays.row_products[:, 0])
    names = np.array(problem.row_names)
    model.addMConstr(arrays.a[plain], columns, senses[plain], sides[plain], name=names[plain].tolist())
    for row in np.unique(arrays.row_products[:, 0]).tolist():
        chosen = arrays.row_products[:, 0] == row
        factors, at = arrays.row_factors[chosen], arrays.row_products[chosen, 1:].T
        products = sparse.csr_array((factors, tuple(at)), shape=arrays.q.shape)
        linear = arrays.a[[row]].toarray()[0]
        model.addMQConstr(
            products, linear, senses[row], sides[row], columns, columns, columns, name=str(names[row])
        )
    model.update()
    return model


def _claims(model: Any) -> Claims:
    solved, has_point = model.Status != _LOADED, model.SolCount > 0
    status, words = claim_of(model.Status, "gurobi-json") if solved else (Status.UNKNOWN, "loaded")
    has_bound = solved and (model.IsMIP or model.IsQCP)
    return Claims(
        model.ModelName,
        status,
        words,
        has_point=has_point,
        objective=finite_or_none(model.ObjVal) if has_point else None,
        bound=finite_or_none(model.ObjBound) if has_bound else None,
    )


def _values(model: Any, _problem: Problem) -> Values:
    return {column.VarName: column.X for column in model.getVars()}


GUROBI: Final = Package(
    "Gurobi",
    "gurobipy.Model",
    "polynomials of degree 2",
    degrees(2, 2),
    "choose minlp-quartic, which is the same problem",
    _build,
    _claims,
    _values,
    "model.optimize()",
    lifts=True,
)
