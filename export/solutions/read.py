"""Reading of a solver's answer: its values mapped by name to a problem, and its claims."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import inf, isfinite
from pathlib import Path
from typing import Any, Final

import numpy as np

from ...models.arguments import check_flag
from ...models.errors import InputError, SolutionError, UnsupportedByFormatError, naming
from ...models.formulations.problem import Problem
from ...models.instance.domain import Floats
from ..formats.registry import FORMATS, problem_in_format
from ..statuses import Status
from ..writing.canonical import CanonicalForm
from ..writing.stamps import is_identified
from .misfit import check_names, check_range
from .readers.registry import read_raw
from .readers.text import RawSolution, values_by_name, values_in_order
from .solution import TRUSTED, Solution

ROUND: Final = 1e-5
"""Largest distance from an integer at which an integer column is rounded; other values are kept."""


LARGEST: Final = 1e8
"""Largest absolute value: no angle or jump exceeds it, and larger ones do not fit squares and 32 bits."""


def read_solution(
    path: str | Path,
    problem: Problem,
    *,
    held: Mapping[str, Problem] | None = None,
    tolerance: float = TRUSTED,
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
    raw = read_raw(path, solution)
    with naming(path):
        return check_answer(
            raw,
            problem,
            held=held,
            identified=identified,
            tolerance=tolerance,
            stated_gap=stated_gap,
            stated_bound=stated_bound,
        )


def check_answer(
    raw: RawSolution,
    problem: Problem,
    *,
    held: Mapping[str, Problem] | None = None,
    identified: bool,
    tolerance: float,
    stated_gap: float | None,
    stated_bound: float | None,
) -> Solution:
    """Check the content of a file or of a model in memory; arguments and errors as of `read_solution`."""
    check_flag("identified", identified)
    if not 0 <= (stated_gap or 0.0) < inf or not isfinite(stated_bound or 0.0):
        words = f"the gap {stated_gap} or the bound {stated_bound} is out of range"
        raise InputError(f"{words}; give finite numbers, and no gap below 0")
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
        digits=raw.digits,
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
