"""Contradictions between a recomputed point and the claims of its file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from ...models.formulations.problem import Problem, Violation
from .readers.text import Status

TOLERANCE: Final = 1e-5
"""Largest error of a point that does not contradict its claims, in units of a column (radians, jumps).

By default, solvers leave these errors: HiGHS, GLPK, CBC and Ipopt at most 1e-7; SCIP 1e-6 in rows and 3e-6
in the objective; CPLEX, Gurobi and Xpress 2e-6 in integers (1e-5 is allowed); BARON 1e-5 in rows.
"""

_DIGITS: Final = 1e-13
"""Rounding of an objective that is summed in doubles, relative to the sum of its coefficients."""


class Claims(NamedTuple):
    """Claims of a file about its point, None for missing ones, and the largest rounding of integers."""

    status: Status
    objective: float | None
    bound: float | None
    rounded: float


def contradictions(
    problem: Problem, claims: Claims, objective: float, violation: Violation, tolerance: float = TOLERANCE
) -> tuple[str, ...]:
    """Contradictions of the claims about a point, in words; empty when they agree.

    A violation beyond the tolerance contradicts a status that promises a point, and a point without one
    contradicts `infeasible`. Another objective contradicts an objective, and an objective below it a dual
    bound. tolerance: times the largest coefficient of the rows, or 1; for the objective, relative to its
    size, or to 1.
    """
    broken = list(_broken(problem, claims, violation, tolerance))
    if not claims.status.promises_point:
        wrong = claims.status is Status.INFEASIBLE and not broken
        return ("its point is feasible",) if wrong else ()
    return (*broken, *_wrong_values(problem, claims, objective, tolerance))


def _broken(problem: Problem, claims: Claims, found: Violation, tolerance: float) -> Iterator[str]:
    """The kinds of violation that are beyond the tolerance."""
    scale = max([1.0, *(float(family.scale.max(initial=0.0)) for family in problem.rows)])
    for what, value, allowed in (
        (f"rows (family {found.worst_family})", found.rows, tolerance * scale),
        ("bounds", found.bounds, tolerance),
        ("integrality", max(found.integrality, claims.rounded), tolerance),
    ):
        if not value <= allowed:
            yield f"its point breaks {what} by {value:.3g}, where {allowed:.3g} is allowed"


def _wrong_values(problem: Problem, claims: Claims, objective: float, tolerance: float) -> Iterator[str]:
    """Contradictions of the claimed objective and dual bound."""
    sizes = sum(float(np.sum(family.scale)) for family in problem.objective)
    allowed = tolerance * max(1.0, abs(objective)) + _DIGITS * sizes
    if claims.objective is not None and not abs(claims.objective - objective) <= allowed:
        yield f"it states the objective {claims.objective:.9g}, but its point has {objective:.9g}"
    if claims.bound is not None and claims.bound > objective + allowed:
        yield f"the dual bound {claims.bound:.9g} lies above the objective {objective:.9g} of the point"
