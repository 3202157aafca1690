"""A solution: the content of a solver's file, mapped by name to a problem and checked against the instance.

Integers are rounded, and objective and violations are computed again from the declaration. A claim of the
file (status, objective, bound) is passed on only if the file states its problem, and the point bears it out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf, isfinite
from pathlib import Path
from typing import Any, Final

import numpy as np

from ...models.arguments import check_flag
from ...models.errors import InputError, SolutionError, UnsupportedByFormatError, naming
from ...models.field.field import CrossField
from ...models.formulations.problem import Problem, Violation
from ...models.instance.domain import Floats
from ...models.previews import table_of
from ..formats.registry import FORMATS, problem_in_format
from ..statuses import Status, is_gap_closed
from ..writing.canonical import CanonicalForm
from ..writing.stamps import is_identified
from .misfit import check_names, check_range
from .readers.registry import read_raw
from .readers.text import RawSolution, values_by_name, values_in_order

ROUND: Final = 1e-5
"""Largest distance from an integer at which an integer column is rounded; other values are kept."""

TRUSTED: Final = 1e-5
"""Largest violation of a point whose claims are kept, in units of a column (radians, jumps).

By default, solvers leave these errors: HiGHS, GLPK, CBC and Ipopt at most 1e-7; SCIP 1e-6 in rows and 3e-6
in the objective; CPLEX, Gurobi and Xpress 2e-6 in integers (1e-5 is allowed); BARON 1e-5 in rows.
"""

TOLERANCE: Final = TRUSTED
"""Largest violation of a feasible point, unless the caller allows more; then no claim is kept."""

AGREEMENT: Final = 1e-5
"""Largest difference of two objectives that agree, relative to their size, or 1."""

ROUNDED: Final = 1e-3
"""Largest violation that a file of few digits explains: listings have four decimals."""

_DIGITS: Final = 1e-13
"""Rounding of an objective that is summed in doubles, relative to the sum of its coefficients."""

LARGEST: Final = 1e8
"""Largest absolute value: no angle or jump exceeds it, and larger ones do not fit squares and 32 bits."""


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
    tolerance: float = TOLERANCE
    nodes: int | None = None
    digits: str = ""
    silent: str = ""

    def __repr__(self) -> str:
        numbers = {"objective": self.objective, "bound": self.bound, "gap": self.gap}
        shown = "".join(f", {name} {value:.6g}" for name, value in numbers.items() if value is not None)
        return f"<Solution of {self.problem.name} on {self.problem.instance.name}: {self.status}{shown}>"

    def _repr_html_(self) -> str:
        """A table of claims and recomputed values, with the field, for notebooks."""
        facts = {
            "problem": self.problem.summary,
            "status": self.status,
            "objective": self.objective,
            "bound": self.bound,
            "gap": self.gap,
            "worst violation": self.violation and self.violation.worst,
            "doubt": self.doubt or None,
            "claims": self.caveat or None,
            "message": self.message or None,
            "seconds": self.seconds,
        }
        known = {
            name: f"{value:.6g}" if isinstance(value, float) else value
            for name, value in facts.items()
            if value is not None
        }
        picture = None if self.point is None else self.field._repr_png_()
        return table_of(f"Solution by {self.reader}", known, picture)

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


def read_solution(
    path: str | Path,
    problem: Problem,
    *,
    held: Mapping[str, Problem] | None = None,
    tolerance: float = TOLERANCE,
    identified: bool = False,
    solution: int | None = None,
    stated_gap: float | None = None,
    stated_bound: float | None = None,
) -> Solution:
    """Read a solver's answer to a problem; the kind of file is detected from its content.

    Named values are mapped by name, and positional ones by the column order of the .nl, LP or MPS file. The
    claims of the file are kept only if it states the stamp of the problem, as solvers do that repeat a name
    or an option of the files of crossfield.

    Parameters
    ----------
    path
        The file, plain or packed.
    problem
        The problem that was solved.
    held
        The problem by format, with products lifted as in the solved file: `Manifest.problems_by_format`. By
        default positional values follow the files as they are written today.
    tolerance
        Largest violation of a feasible point, in units of a column. It has no influence on the comparison of
        objectives. Claims of a point that violates more than 1e-5 are not kept.
    identified
        Whether the caller knows that the file answers this problem, even if it does not state it.
    solution
        Number of a solution, from 1, in a file that holds several. By default the best: that of least stated
        objective, or the first if not every one states its objective.
    stated_gap
        Relative gap that the program was given, at least 0, for a file that calls its point optimal without
        a dual bound. The bound is the objective minus this part of it.
    stated_bound
        Dual bound that the program has proven, for a file that does not state it. The greater one counts.

    Returns
    -------
    Solution
        The point, the claims of the file, and the recomputed values. The point is None if the file has none.

    Raises
    ------
    InputError
        If the file cannot be read, or gap or bound are not numbers in their range.
    SolutionError
        If it is damaged, or states or fits another problem; or if a gap is given for a file that does not
        call its point optimal.

    """
    check_flag("identified", identified)
    if not 0 <= (stated_gap or 0.0) < inf or not isfinite(stated_bound or 0.0):
        words = f"the gap {stated_gap} or the bound {stated_bound} is out of range"
        raise InputError(f"{words}; give finite numbers, and no gap below 0")
    raw = read_raw(path, solution)
    with naming(path):
        facts = {
            "identified": is_identified(raw.stamps, problem.stamp) or identified,
            "tolerance": tolerance,
        }
        if not raw.has_point:
            return _solution(raw, problem, None, **facts)
        answer = _map_values(raw, _canonical_form(raw, problem, held or {}), **facts)
        return with_bounds(answer, stated_gap, stated_bound)


def with_bounds(answer: Solution, gap: float | None, bound: float | None = None) -> Solution:
    """An answer with the greatest of its own dual bound, a given one, and the one that a gap proves.

    A gap adds nothing to an optimum that is proven without it. Raises SolutionError as `read_solution`.
    """
    objective, bounds = answer.objective, [answer.claimed_bound, bound]
    if gap is not None and objective is not None and answer.status is not Status.OPTIMAL_GLOBAL:
        if answer.claimed not in {Status.OPTIMAL_GLOBAL, Status.OPTIMAL_IN_GAP}:
            raise SolutionError(
                f"claims {answer.claimed}, so that a gap proves nothing; --bound X states a dual bound"
            )
        bounds.append(objective - gap * abs(objective))
    return replace(answer, claimed_bound=max((b for b in bounds if b is not None), default=None))


def _canonical_form(raw: RawSolution, problem: Problem, held: Mapping[str, Problem]) -> CanonicalForm:
    """The problem that the solver was given: by the manifest, or else by the names of lifted products."""
    if raw.names is None:
        return CanonicalForm(held[raw.order] if raw.order in held else _problem_in_file(problem, raw.order))
    forms = {problem_held.sha256: problem_held for problem_held in held.values()}
    if len(forms) == 1:
        return CanonicalForm(*forms.values())
    liftable = "p1" in problem.blocks and "z" not in problem.blocks
    named = liftable and np.strings.startswith(raw.names, b"z_").any()
    return CanonicalForm(problem.lifted if named else problem)


def _problem_in_file(problem: Problem, name: str) -> Problem:
    try:
        return problem_in_format(problem, FORMATS[name])
    except UnsupportedByFormatError as error:
        raise SolutionError(f"is of an .{name} file, and {error}; it is of another problem") from error


def _solution(raw: RawSolution, problem: Problem, point: Floats | None, **facts: Any) -> Solution:
    # HiGHS solves convex problems only, and may call a stationary point of another one optimal.
    continuous = not (problem.is_convex or problem.integer.any())
    local = continuous and raw.reader == "highs" and raw.status.is_optimal
    return Solution(
        problem,
        point,
        Status.OPTIMAL_LOCAL if local else raw.status,
        raw.message,
        raw.reader,
        reported=raw.objective,
        claimed_bound=raw.bound,
        order="" if raw.names is not None else raw.order,
        digits=raw.rounded,
        silent=raw.silent,
        **facts,
    )


def _map_values(raw: RawSolution, form: CanonicalForm, **facts: Any) -> Solution:
    problem = form.problem
    point, unknown = (_point_by_position(raw, form), 0) if raw.names is None else _point_by_name(raw, form)
    check_range(point, form, LARGEST)
    point, moved = _round_integers(point, problem)
    return _solution(raw, problem, point, rounded=moved, unknown=unknown, **facts)


def _point_by_position(raw: RawSolution, form: CanonicalForm) -> Floats:
    """The point of a file without names; columns in no term, missing in the solver's model, are arbitrary."""
    problem, order = form.problem, form.order(raw.order)
    point = np.append(np.clip(0.0, problem.lower, problem.upper), 1.0)  # and the column fixed to 1
    point[order] = values_in_order(len(order), form.row_count(raw.order), raw)
    return point[: problem.n_columns]


def _point_by_name(raw: RawSolution, form: CanonicalForm) -> tuple[Floats, int]:
    mapped = values_by_name(form.column_names, raw)
    check_names(raw, form, mapped)
    return mapped.values, mapped.unknown


def _round_integers(point: Floats, problem: Problem) -> tuple[Floats, float]:
    nearest = np.round(point)
    gap = np.abs(point - nearest)
    chosen = problem.integer & (gap <= ROUND)
    return np.where(chosen, nearest + 0.0, point), float(gap[chosen].max(initial=0.0))
