"""A solution: the content of a solver's file, mapped by name to a problem and checked against the instance.

Integers are rounded, and objective and violations are computed again from the declaration. A claim of the
file (status, objective, bound) is passed on only if the file states its problem, and the point bears it out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from typing import Any, Final

import numpy as np

from ...models.errors import SolutionError
from ...models.field.field import CrossField
from ...models.formulations.problem import Problem, Violation
from ...models.instance.domain import Floats
from ..statuses import Status, is_gap_closed
from .readers.grammar import AGREEMENT

TRUSTED: Final = 1e-5
"""Largest violation of a point whose claims are kept, in units of a column (radians, jumps).

A caller may allow a feasible point more; then no claim is kept. By default, solvers leave these errors:
HiGHS, GLPK, CBC and Ipopt at most 1e-7; SCIP 1e-6 in rows and 3e-6 in the objective; CPLEX, Gurobi and
Xpress 2e-6 in integers (1e-5 is allowed); BARON 1e-5 in rows.
"""

ROUNDED: Final = 1e-3
"""Largest violation that a file of few digits explains: listings have four decimals."""

_DIGITS: Final = 1e-13
"""Rounding of an objective that is summed in doubles, relative to the sum of its coefficients."""


@dataclass(frozen=True, eq=False)
class Solution:
    """A solver's answer: its point, its claims, and the values recomputed from the instance.

    Six attributes state what the claims are worth:

    - `claimed`: the status that the file or the program states
    - `contradictions`: what the recomputed values contradict; empty if they agree with all claims
    - `is_trusted`: whether status and bound hold, because the file states the problem and nothing contradicts
    - `status`: what remains of `claimed`, as far as a bound proves it
    - `doubt`: why the point cannot be used, so that no field is written; empty if it can
    - `caveat`: which claim is not kept although the point can be used, or is not proven; empty if none

    `remedy` is the likely explanation of a doubt. The other results refer to this one: a `Candidate` of a run
    holds it with its field, a `Check` of `verify` judges it, and a `Record` of a ledger lists it.

    Parameters
    ----------
    problem
        The problem in the columns of the file, with products lifted if the format needed it.
    point
        Values of all columns, shape (n,), or None.
    claimed
        Status that the file claims.
    message
        The solver's own words.
    reader
        Name of the reader that recognised the file.
    identified
        Whether the file states the problem, or the caller knows that it answers it. No claim of another file
        is kept.
    reported, claimed_bound
        Objective and dual bound in the file, if any. `bound` is what remains of the latter.
    order
        The file whose column order was assumed, `nl`, `lp`, `mps` or `mod`; empty if values have names.
    rounded
        Largest change of an integer column by rounding.
    unknown
        Number of names in the file that the problem does not have.
    seconds
        Duration of the solve, if known.
    interrupted
        Whether the user ended the solve.
    start_returned
        Whether the point is the start that the solver was given; None if unknown.
    tolerance
        Largest violation of a feasible point, in units of a column.
    nodes
        Number of nodes of the search tree, if reported.
    digits
        How the program writes all digits, if its layout rounds values.
    silent
        How the program writes its status, if its layout has none.

    """

    problem: Problem
    point: Floats | None
    claimed: Status
    message: str
    reader: str
    identified: bool
    reported: float | None = None
    claimed_bound: float | None = None
    order: str = ""
    rounded: float = 0.0
    unknown: int = 0
    seconds: float | None = None
    interrupted: bool = False
    start_returned: bool | None = None
    tolerance: float = TRUSTED
    nodes: int | None = None
    digits: str = ""
    silent: str = ""

    def __repr__(self) -> str:
        numbers = {"objective": self.objective, "bound": self.bound, "gap": self.gap}
        shown = "".join(f", {name} {value:.6g}" for name, value in numbers.items() if value is not None)
        return f"<Solution of {self.problem.name} on {self.problem.instance.name}: {self.status}{shown}>"

    @cached_property
    def contradictions(self) -> tuple[str, ...]:
        """Contradictions between the recomputed point and the file's claims; empty when they agree.

        A violation beyond the tolerance contradicts a status that promises a point, and a point without one
        contradicts `infeasible`. Another objective contradicts an objective, and an objective below it a dual
        bound. The tolerance is relative to the largest coefficient of the rows, or 1; it is not used for
        objectives, which agree within AGREEMENT. Nothing is unbounded: terms of objectives are at least 0, or
        in columns with two bounds.
        """
        if self.claimed is Status.UNBOUNDED:
            return ("every objective of crossfield is bounded below",)
        if self.objective is None or self.violation is None:
            return ()
        if self.claimed.needs_point:
            return (*self._infeasibilities, *self._wrong_values(self.objective))
        if self._infeasibilities:
            return ()
        if self.claimed is Status.INFEASIBLE:
            return ("its point is feasible",)
        return tuple(self._wrong_values(self.objective))

    @cached_property
    def _infeasibilities(self) -> tuple[str, ...]:
        """The kinds of violation that are beyond the tolerance."""
        return tuple(
            f"its point breaks {kind} by {value:.3g}, where {allowed:.3g} is allowed"
            for kind, value, allowed in self._violations(self.tolerance)
            if not value <= allowed
        )

    def _violations(self, tolerance: float) -> Iterator[tuple[str, float, float]]:
        """Kind, size and largest allowed size of the point's violations."""
        if self.violation is None:
            return
        scale = max([1.0, *(float(family.scale.max(initial=0.0)) for family in self.problem.rows)])
        yield f"rows (family {self.violation.worst_family})", self.violation.rows, tolerance * scale
        yield "bounds", self.violation.bounds, tolerance
        yield "integrality", max(self.violation.integrality, self.rounded), tolerance

    def _wrong_values(self, objective: float) -> Iterator[str]:
        """Contradictions of the claimed objective and dual bound."""
        sizes = sum(float(np.sum(family.scale)) for family in self.problem.objective)
        allowed = AGREEMENT * max(1.0, abs(objective)) + _DIGITS * sizes
        if self.reported is not None and not abs(self.reported - objective) <= allowed:
            yield f"it states the objective {self.reported:.9g}, but its point has {objective:.9g}"
        if self.identified and self.claimed_bound is not None and self.claimed_bound > objective + allowed:
            bound = f"{self.claimed_bound:.9g}"
            yield f"the dual bound {bound} lies above the objective {objective:.9g} of the point"

    @property
    def is_trusted(self) -> bool:
        """Whether status and bound of the file hold for the problem.

        The file must state the problem, and nothing may contradict it. A point must satisfy the problem
        within TRUSTED, whatever tolerance the caller allows.
        """
        if not self.identified or self.contradictions:
            return False
        return not self.claimed.needs_point or all(
            value <= allowed for _, value, allowed in self._violations(TRUSTED)
        )

    @property
    def status(self) -> Status:
        """The claim if it is kept; otherwise FEASIBLE for a feasible point, NO_POINT or ERROR, or UNKNOWN.

        A feasible point counts although the file claims none, as after a failure.
        """
        if self._has_unclaimed_point:
            return Status.FEASIBLE
        if self.is_trusted or self.claimed in {Status.NO_POINT, Status.ERROR}:
            return self._proven_claim
        if self.claimed is Status.LIMIT_WITHOUT_POINT:
            return Status.NO_POINT
        return Status.FEASIBLE if self.claimed.needs_point and not self.contradictions else Status.UNKNOWN

    @property
    def _has_unclaimed_point(self) -> bool:
        """Whether a feasible point is in a file whose status neither promises nor excludes one."""
        silent = {Status.LIMIT_WITHOUT_POINT, Status.NO_POINT, Status.ERROR, Status.UNKNOWN}
        consistent = not self._infeasibilities and not self.contradictions
        return self.point is not None and self.claimed in silent and consistent

    @property
    def _proven_claim(self) -> Status:
        """The claim as far as a dual bound or the kind of problem proves it.

        A bound that closes the gap proves an optimum; one that leaves a gap makes it the best point at a
        limit. Without integers, a convex problem is solved to its optimality conditions, so that there is no
        gap to choose.
        """
        if self.objective is None or not (self.claimed.is_optimal or self.claimed is Status.FEASIBLE):
            return self.claimed
        if self.bound is not None and is_gap_closed(self.bound, self.objective):
            return Status.OPTIMAL_GLOBAL
        if self.claimed not in {Status.OPTIMAL_GLOBAL, Status.OPTIMAL_IN_GAP}:
            return self.claimed
        if self.bound is not None:
            return Status.LIMIT_WITH_POINT
        has_no_gap = self.problem.is_convex and not self.problem.integer.any()
        return Status.OPTIMAL_GLOBAL if has_no_gap else self.claimed

    @property
    def bound(self) -> float | None:
        """The dual bound of the file if it is kept, else None."""
        return self.claimed_bound if self.is_trusted else None

    @property
    def doubt(self) -> str:
        """Reason why the point cannot be used; empty if it can."""
        if self.contradictions:
            return f"claims {self.claimed}, but {'; '.join(self.contradictions)}"
        if self.point is not None and not self.claimed.needs_point and not self._has_unclaimed_point:
            return f"claims {self.claimed} ({self.message or 'no message'}): its values are not a solution"
        return ""

    @property
    def remedy(self) -> str:
        """Likely explanation of a doubt about the point, and the remedy; empty if there is none."""
        if self.order and not self.identified:
            return (
                f"its values have no names and were taken in the order of the .{self.order} file that "
                "crossfield writes; give the answer to that file"
            )
        only_infeasible = self.contradictions and self.contradictions == self._infeasibilities
        if only_infeasible and self.violation is not None and self.violation.worst <= ROUNDED:
            few = f"its values are rounded ({self.digits});" if self.digits else "if the file has few digits,"
            return f"{few} --tolerance {ROUNDED:g} accepts its point, without its claims"
        return ""

    @property
    def caveat(self) -> str:
        """Why claims of the file are not kept although its point can be used; empty if all are kept."""
        if self.contradictions:
            return ""
        if self.is_trusted and self.point is not None:
            return self._open_question
        if self.is_trusted:
            return ""
        if not self.identified:
            return f"not kept ({self.claimed}): the file is of an unidentified problem"
        return f"not kept ({self.claimed}): the point is feasible only within {self.tolerance:g}"

    @property
    def _open_question(self) -> str:
        """The part of a claim that the file does not prove although it is kept, and how to state it."""
        if self.claimed.is_optimal and self.status is Status.LIMIT_WITH_POINT:
            return f"its dual bound {self.bound:.6g} leaves a gap, so it is not optimal within 1e-4"
        if self.status is Status.OPTIMAL_IN_GAP:
            return "optimal within a gap that is not in it: --gap X states the gap, --bound X the dual bound"
        if self.status is Status.FEASIBLE and self.bound is None and not self.message:
            return f"it states no status; {self.silent or '--bound X states the dual bound of the program'}"
        return ""

    @cached_property
    def objective(self) -> float | None:
        """The objective at the point, recomputed."""
        return None if self.point is None else self.problem.objective_value(self.point)

    @cached_property
    def objective_of_field(self) -> float | None:
        """The objective of the field itself, with exact products and every slack at its least.

        A point that breaks rows within the solver's tolerance may have an objective below every field's. None
        without a point, and for a problem whose points are no fields: a relaxation, or the printed facet.
        """
        if self.point is None or not self.problem.formulation.has_only_fields:
            return None
        return self.problem.objective_value(self.problem.point(self.field))

    @property
    def gap(self) -> float | None:
        """Relative distance of the dual bound below the objective; None without either."""
        if self.objective is None or self.bound is None:
            return None
        apart = max(self.objective - self.bound, 0.0)
        return apart and (apart / abs(self.objective) if self.objective else np.inf)

    @cached_property
    def violation(self) -> Violation | None:
        """The worst violations at the point, recomputed."""
        return None if self.point is None else self.problem.violation(self.point)

    @cached_property
    def field(self) -> CrossField:
        """The cross field of the point. Raises SolutionError without a point."""
        if self.point is None:
            raise SolutionError(
                f"there is no point in the solution ({self.status}): {self.message or 'no message'}"
            )
        return self.problem.field(self.point)

    def facts(self) -> dict[str, Any]:
        """Claims of the file and recomputed values, as reports list them; None for an infinity."""
        violation = self.violation
        facts = {
            "formulation": self.problem.name,
            "lifted": self.problem.formulation.lifted,
            "status": str(self.status),
            "claimed": str(self.claimed),
            "contradictions": list(self.contradictions),
            "claims": self.caveat,
            "message": self.message,
            "objective_reported": self.reported,
            "objective_recomputed": self.objective,
            "objective_of_field": self.objective_of_field,
            "dual_bound": self.bound,
            "gap": self.gap,
            "start_returned": self.start_returned,
            "worst_violation": None if violation is None else violation.worst,
            "worst_family": None if violation is None else violation.worst_family,
            "furthest_rounding": self.rounded,
            "unknown_names": self.unknown,
            "interrupted": self.interrupted,
            "seconds": None if self.seconds is None else round(self.seconds, 3),
        }
        infinite = {key for key, value in facts.items() if isinstance(value, float) and not isfinite(value)}
        return facts | dict.fromkeys(infinite)
