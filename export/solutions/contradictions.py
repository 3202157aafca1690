"""What a point, computed again, says against the claims of the file that holds it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from ...models.formulations.problem import Problem, Violation
from .readers.text import Status

TOLERANCE: Final = 1e-5
"""How far a point may be off before it contradicts its claims, in units of a column (radians, jumps).

Solvers leave, by default: HiGHS, GLPK, CBC and Ipopt at most 1e-7; SCIP 1e-6 in rows and 3e-6 in the
objective; CPLEX, Gurobi and Xpress 2e-6 in integers (1e-5 is allowed); BARON 1e-5 in rows.
"""

_DIGITS: Final = 1e-13
"""Rounding of an objective that is summed in doubles, as a part of its coefficients' sum."""


class Claims(NamedTuple):
    """What a file claims of its point, None where it is silent; and how far integers were rounded."""

    status: Status
    objective: float | None
    bound: float | None
    rounded: float


def contradictions(
    problem: Problem, claims: Claims, objective: float, violation: Violation, tolerance: float = TOLERANCE
) -> tuple[str, ...]:
    """What is wrong with the claims about a point, in words; empty when they agree.

    A status that promises a point is contradicted by a violation beyond the tolerance, `infeasible` by a
    point without one; an objective by another one, and a dual bound by an objective below it. tolerance:
    times the largest coefficient of the rows, or 1; and of the objective a part of its size, or of 1.
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
    """Whether the objective is another one than the file tells, or below its dual bound."""
    sizes = sum(float(np.sum(family.scale)) for family in problem.objective)
    allowed = tolerance * max(1.0, abs(objective)) + _DIGITS * sizes
    if claims.objective is not None and not abs(claims.objective - objective) <= allowed:
        yield f"it tells the objective {claims.objective:.9g} and its point has {objective:.9g}"
    if claims.bound is not None and claims.bound > objective + allowed:
        yield f"the dual bound {claims.bound:.9g} lies above the objective {objective:.9g} of the point"
