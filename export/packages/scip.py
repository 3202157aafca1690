"""Models of SCIP."""

from __future__ import annotations

from collections.abc import Iterator
from math import cos
from typing import Any, Final

from ...models.formulations.families import ANY_DEGREE, PlacedFamily
from ...models.formulations.problem import Problem
from ..statuses import Status, claim_of, finite_or_none
from .package import Claims, Package, Values, degrees, title_of

_OBJECTIVE: Final = "objective"
"""The variable whose value is the objective, which has to be linear in SCIP."""


def _build(problem: Problem) -> Any:
    import pyscipopt

    model = pyscipopt.Model(title_of(problem))
    model.hideOutput()
    columns = [
        model.addVar(name, "I" if integer else "C", lower, upper)
        for name, integer, lower, upper in zip(
            problem.column_names,
            problem.integer.tolist(),
            problem.lower.tolist(),
            problem.upper.tolist(),
            strict=True,
        )
    ]
    functions = {
        "cos": lambda angle: pyscipopt.cos(angle) if isinstance(angle, pyscipopt.Expr) else cos(angle)
    }

    def values(family: PlacedFamily) -> Iterator[Any]:
        return family.over_objects(family.family.body, columns, functions)

    names = iter(problem.row_names)
    for family in problem.rows:
        for body in values(family):
            row = {">=": body >= 0, "<=": body <= 0, "==": body == 0}[family.family.sense]
            model.addCons(row, next(names))
    terms = [term for family in problem.objective for term in values(family)]
    goal = model.addVar(_OBJECTIVE, lb=None)
    model.addCons(pyscipopt.quicksum(terms) <= goal, "c_objective")
    model.setObjective(goal)
    return model


def _claims(model: Any) -> Claims:
    words, has_point = model.getStatus(), model.getNSols() > 0
    solved = words != "unknown"
    return Claims(
        model.getProbName(),
        claim_of(words, "scip")[0] if solved else Status.UNKNOWN,
        words,
        has_point=has_point,
        objective=finite_or_none(model.getObjVal()) if has_point else None,
        bound=finite_or_none(model.getDualbound()) if solved else None,
    )


def _values(model: Any, _problem: Problem) -> Values:
    best = model.getBestSol()
    return {column.name: best[column] for column in model.getVars() if column.name != _OBJECTIVE}


SCIP: Final = Package(
    "SCIP",
    "pyscipopt.Model",
    "every problem",
    degrees(ANY_DEGREE, ANY_DEGREE),
    "",
    _build,
    _claims,
    _values,
    "model.optimize()",
)
