"""Curvature of objective and rows, from the declaration, and its summary by QPLIB's three letters."""

from __future__ import annotations

import numpy as np

from ...models.formulations.problem import Problem
from .canonical import CanonicalForm


def objective_curvature(problem: Problem) -> tuple[str, str]:
    """Curvature of the objective (linear, convex, indefinite or nonconvex) and its reason."""
    degree = problem.objective_degree
    if degree <= 1:
        return "linear", "the objective is linear: its Hessian is zero"
    if degree > 2:
        kind = "a cosine of integers" if degree == 99 else f"products of p1 and skews, degree {degree}"
        return "nonconvex", f"the objective holds {kind}: its Hessian is not constant"
    if problem.formulation.has_convex_objective:
        return (
            "convex",
            "a sum of squares of linear expressions with positive weights: no eigenvalue is negative",
        )
    return "indefinite", "the objective holds products that are no squares"


def row_curvature(problem: Problem) -> str:
    """Curvature of the rows: none, linear, indefinite or nonconvex; no declaration has convex ones."""
    if not problem.rows:
        return "none"
    if problem.row_degree <= 1:
        return "linear"
    return "nonconvex" if problem.row_degree > 2 else "indefinite"


def probtype(problem: Problem) -> str | None:
    """QPLIB's three letters, of objective, variables and constraints; None beyond quadratic problems.

    L linear, D convex and diagonal, C convex, Q any; C continuous, B binary, M with binaries, I integer, G
    with integers; N none, B bounds, L linear, Q any.
    """
    if max(problem.objective_degree, problem.row_degree) > 2:
        return None
    return _objective_letter(problem) + _variables_letter(problem) + _constraints_letter(problem)


def _objective_letter(problem: Problem) -> str:
    kind, _ = objective_curvature(problem)
    if kind == "convex":
        index, _ = problem.merged_objective(2)
        return "D" if (index[:, 0] == index[:, 1]).all() else "C"
    return {"linear": "L"}.get(kind, "Q")


def _variables_letter(problem: Problem) -> str:
    binary, integer = CanonicalForm(problem).binary, problem.integer
    if not integer.any():
        return "C"
    if (binary == integer).all():
        return "B" if integer.all() else "M"
    return "I" if integer.all() and not binary.any() else "G"


def _constraints_letter(problem: Problem) -> str:
    bounded = bool(np.isfinite(problem.lower).any() or np.isfinite(problem.upper).any())
    kinds = {"none": "B" if bounded else "N", "linear": "L"}
    return kinds.get(row_curvature(problem), "Q")
