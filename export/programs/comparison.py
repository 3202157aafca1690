"""Comparison of the model that a program reads with the problem: in its algebra, or at points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from scipy import sparse

from ...models.formulations.names import column_names, decode_names, row_names
from ...models.formulations.problem import Problem
from ...models.instance.domain import Bools, Floats
from ..writing.canonical import CanonicalForm
from ..writing.terms import Terms, merged_terms, terms_of_triangle
from .model_content import Algebra, Behaviour, Points, positions_of

VALUES: Final = 1e-9
"""Relative difference up to which values at a point agree: sums may have another order."""


def _names_of(problem: Problem) -> tuple[list[str], list[str]]:
    """Names of all columns and rows of a problem."""
    columns, rows = column_names(problem.instance, problem.blocks), row_names(problem.rows)
    return decode_names(columns).tolist(), decode_names(rows).tolist()


def problem_algebra(problem: Problem) -> Algebra:
    """The intended content of an LP or MPS file, from the problem's arrays; the last column is fixed to 1."""
    arrays, (columns, rows) = problem.to_arrays(names=False), _names_of(problem)
    upper, matrix = sparse.triu(arrays.q).tocoo(), arrays.a.tocoo()
    fixed = Terms(np.array([[0, problem.n_columns]]), np.ones(1))
    return Algebra.of(
        [*columns, CanonicalForm(problem).one.decode()],
        rows or ["c_ONE"],
        lower=np.append(arrays.lower, 1.0),
        upper=np.append(arrays.upper, 1.0),
        integer=np.append(arrays.integer, False),
        costs=np.append(arrays.c, arrays.constant),
        row_lower=arrays.row_lower if rows else np.ones(1),
        row_upper=arrays.row_upper if rows else np.ones(1),
        quadratic=terms_of_triangle(upper.row, upper.col, upper.data),
        matrix=merged_terms(np.stack(matrix.coords, axis=1), matrix.data, indices=2) if rows else fixed,
        row_quadratic=merged_terms(arrays.row_products, arrays.row_factors, indices=3, products=2),
    )


def values_at(problem: Problem, points: Floats) -> tuple[Floats, Floats]:
    """Objective (k,) and rows (k, rows), their constants on the right side, at points (k, columns)."""
    objective = np.array([problem.objective_value(point) for point in points])
    rows = [
        np.concatenate([np.zeros(0), *(family.values(point) + family.limit for family in problem.rows)])
        for point in points
    ]
    return objective, np.array(rows).reshape(len(points), problem.n_rows)


def algebra_difference(reported: Algebra, problem: Problem, tolerance: float, points: Floats) -> str:
    """First difference between the algebra of a file and the problem; empty without one.

    tolerance: relative difference of numbers, 0 for equal to the bit. points: (k, columns), where values are
    compared as well.
    """
    expected = problem_algebra(problem)
    for kind in ("columns", "rows"):
        wrong = _name_difference(getattr(reported, kind), getattr(expected, kind), kind)
        if wrong:
            return wrong
    reported = reported.reordered(expected.columns, expected.rows)
    checks = (_number_difference(reported, expected, name, tolerance) for name in _NUMBERS)
    wrong = next(filter(None, checks), "")
    if wrong:
        return wrong
    extended = np.hstack([points, np.ones((len(points), len(expected.columns) - problem.n_columns))])
    objective, rows = values_at(problem, points)
    accuracy = max(VALUES, 100 * tolerance)
    return _value_difference("the objective", reported.objective(extended), objective, accuracy) or (
        _value_difference("a row", reported.activities(extended), rows, accuracy) if problem.rows else ""
    )


_NUMBERS: Final = (
    "integer", "lower", "upper", "costs", "quadratic", "row_lower", "row_upper", "matrix", "row_quadratic",
)  # fmt: skip


def _name_difference(reported: Sequence[str], expected: Sequence[str], kind: str) -> str:
    if sorted(reported) == sorted(expected):
        return ""
    extra, missing = sorted(set(reported) - set(expected)), sorted(set(expected) - set(reported))
    parts = [
        f"{word} {', '.join(names[:3])}" for word, names in (("adds", extra), ("lacks", missing)) if names
    ]
    return f"{len(reported)} {kind} instead of {len(expected)}: {'; '.join(parts) or 'some twice'}"


def _number_difference(reported: Algebra, expected: Algebra, name: str, tolerance: float) -> str:
    mine, theirs = getattr(expected, name), getattr(reported, name)
    index = f"{name}_at"
    if hasattr(expected, index) and not np.array_equal(getattr(expected, index), getattr(reported, index)):
        return f"{name}: {len(theirs)} coefficients instead of {len(mine)}, or at other places"
    wrong = np.nonzero(~_are_close(theirs, mine, tolerance))[0]
    if not len(wrong):
        return ""
    labels = expected.rows if name.startswith("row_") else expected.columns
    at = getattr(expected, index)[wrong[0]].tolist() if hasattr(expected, index) else labels[wrong[0]]
    return f"{name} at {at} is {theirs[wrong[0]]!s} instead of {mine[wrong[0]]!s} ({len(wrong)} such)"


def _are_close(reported: Any, expected: Any, tolerance: float) -> Bools:
    if not tolerance or expected.dtype == bool:
        return np.asarray(reported == expected)
    return np.asarray(np.isclose(reported, expected, rtol=tolerance, atol=tolerance * 1e-3))


def _value_difference(label: str, values: Floats, expected: Floats, accuracy: float) -> str:
    known = ~np.isnan(values)
    wrong = known & ~np.isclose(values, expected, rtol=accuracy, atol=accuracy)
    if not wrong.any():
        return ""
    place = tuple(np.argwhere(wrong)[0])
    return f"{label} at point {place[0]} is {values[place]:.12g} instead of {expected[place]:.12g}"


def behaviour_difference(reported: Behaviour, problem: Problem, points: Points) -> str:
    """First difference between the behaviour of a file and the problem; empty without one."""
    columns, rows = _names_of(problem)
    lacking = set(columns) - set(reported.columns) if reported.may_lack else set()
    wanted = [name for name in columns if name not in lacking & _columns_in_no_term(problem, columns)]
    strangers = _name_difference(reported.columns, wanted, "columns") or _name_difference(
        reported.rows, rows, "rows"
    )
    if strangers:
        return strangers
    at, c, r = (
        positions_of(columns, wanted),
        positions_of(reported.columns, wanted),
        positions_of(reported.rows, rows),
    )
    if (reported.integer[c] != problem.integer[at]).any():
        return "other columns are integer"
    form = CanonicalForm(problem)
    bounds = [
        ("lower", reported.lower[c], problem.lower[at]),
        ("upper", reported.upper[c], problem.upper[at]),
        ("row_lower", reported.row_lower[r], form.row_lower),
        ("row_upper", reported.row_upper[r], form.row_upper),
    ]
    for name, theirs, mine in bounds:
        wrong = np.nonzero(~_are_close(theirs, mine, reported.rounding))[0]
        if len(wrong):
            return f"{name} is {theirs[wrong[0]]!s} instead of {mine[wrong[0]]!s} ({len(wrong)} such)"
    objective, activities = values_at(problem, points.of(columns))
    return _value_difference("the objective", reported.objective, objective, VALUES) or _value_difference(
        "a row", reported.activities[:, r], activities, VALUES
    )


def _columns_in_no_term(problem: Problem, columns: list[str]) -> set[str]:
    """Names of columns that stand in no term."""
    used = np.zeros(problem.n_columns, dtype=bool)
    for family in (*problem.objective, *problem.rows):
        for symbol in family.variables:
            used[family.column_of(symbol)] = True
    return {columns[place] for place in np.nonzero(~used)[0].tolist()}
