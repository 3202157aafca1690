"""Statistics of a problem: columns, rows and terms by kind as in MINLPLib, and curvature."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from ....models.formulations.families import PlacedFamily
from ....models.formulations.problem import Problem
from ....models.instance.domain import Floats
from ....models.instance.instance import Instance
from ...writing.canonical import CanonicalForm
from ...writing.curvature import objective_curvature, row_curvature


def density(instance: Instance) -> float:
    """Return the share of the pixels, or faces, that are strokes, to four decimals."""
    return round(len(instance.theta) / instance.domain.size, 4)


def problem_counts(problem: Problem) -> dict[str, int]:
    """Return the numbers of columns, rows, nonzeros and terms by kind."""
    return _columns(problem) | _rows(problem) | _terms(problem)


def _columns(problem: Problem) -> dict[str, int]:
    form = CanonicalForm(problem)
    binary, integer = form.binary, problem.integer
    nonlinear = form.nl_order.in_objective | form.nl_order.in_rows
    return {
        "variables": problem.n_columns,
        "continuous": int((~integer).sum()),
        "binary": int(binary.sum()),
        "integer": int((integer & ~binary).sum()),
        "nonlinear_variables": int(nonlinear.sum()),
        "nonlinear_binary": int((nonlinear & binary).sum()),
        "nonlinear_integer": int((nonlinear & integer & ~binary).sum()),
    }


def _rows(problem: Problem) -> dict[str, int]:
    kinds = ("linear", "quadratic", "polynomial", "general")
    by_kind = Counter({f"{kind}_constraints": 0 for kind in kinds})
    for family in problem.rows:
        degree = family.degree  # 99 for other families than polynomials
        kind = kinds[0 if degree <= 1 else 1 if degree == 2 else 2 if degree < 99 else 3]
        by_kind[f"{kind}_constraints"] += family.count
    return {
        "constraints": problem.n_rows,
        "equalities": sum(f.count for f in problem.rows if f.family.sense == "=="),
        **by_kind,
        "nonzeros": sum(len(f.variables) * f.count for f in problem.rows),
        "nonlinear_nonzeros": sum(_nonlinear_variables(f) * f.count for f in problem.rows),
    }


def _nonlinear_variables(family: PlacedFamily) -> int:
    """Columns in nonlinear terms of each row of a family."""
    if family.terms is None:
        return len(family.variables)
    return len({symbol for term in family.terms if term.degree > 1 for symbol in term.symbols})


def _terms(problem: Problem) -> dict[str, int]:
    degree = problem.objective_degree
    higher = range(3, degree + 1) if degree < 99 else range(3, 5)
    general = sum(family.count for family in problem.objective if family.terms is None)
    return {
        "objective_linear_terms": len(problem.merged_objective(1)[1]),
        "objective_quadratic_terms": len(problem.merged_objective(2)[1]),
        "objective_higher_terms": sum(len(problem.merged_objective(power)[1]) for power in higher),
        "objective_general_terms": general,
    }


def problem_curvature(problem: Problem) -> dict[str, Any]:
    """Return the curvature of objective and rows, and the reason for the former."""
    objective, reason = objective_curvature(problem)
    return {"objective": objective, "constraints": row_curvature(problem), "reason": reason}


def tangent_bound(problem: Problem, point: Floats) -> float | None:
    """A lower bound of a convex quadratic objective over finite bounds, from a tangent, or None.

    f(x) >= f(x0) + g (x - x0), whose least value over the box is found coordinate by coordinate.
    """
    if problem.rows or problem.integer.any() or objective_curvature(problem)[0] != "convex":
        return None
    slope = np.zeros(problem.n_columns)
    index, cost = problem.merged_objective(1)
    slope[index[:, 0]] += cost
    index, value = problem.merged_objective(2)
    np.add.at(slope, index[:, 0], value * point[index[:, 1]])
    np.add.at(slope, index[:, 1], value * point[index[:, 0]])
    falls = np.minimum(slope * (problem.lower - point), slope * (problem.upper - point))
    return problem.objective_value(point) + float(np.minimum(falls, 0.0).sum())
