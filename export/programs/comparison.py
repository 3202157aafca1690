"""Comparison of the model that a program reads with the problem: in its algebra, or at points."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from scipy import sparse

from ...models.formulations.families import row_sides
from ...models.formulations.problem import Problem
from ...models.instance.domain import Bools, Floats
from ..writing.canonical import CanonicalForm
from .model_content import (
    Algebra,
    Behaviour,
    Points,
    entries_of_triangle,
    named_limits,
    numbered,
    positions_of,
)

VALUES: Final = 1e-9
"""Relative difference up to which values at a point agree: sums may have another order."""


def problem_algebra(problem: Problem, *, one: bool = True) -> Algebra:
    """The intended content of a file. one: whether it has the column that is fixed to 1, as LP and MPS."""
    arrays, columns, rows = problem.to_arrays(names=False), problem.column_names, problem.row_names
    upper, matrix = sparse.triu(arrays.q).tocoo(), arrays.a.tocoo()
    model = Algebra.of(
        columns,
        rows,
        [
            *numbered(arrays.c.tolist()),
            *entries_of_triangle(upper.row, upper.col, upper.data),
            *zip(matrix.row.tolist(), matrix.col.tolist(), matrix.data.tolist(), strict=True),
            *((*at, value) for at, value in zip(arrays.row_products, arrays.row_factors, strict=True)),
        ],
        lower=arrays.lower,
        upper=arrays.upper,
        integer=arrays.integer,
        row_lower=arrays.row_lower,
        row_upper=arrays.row_upper,
    )
    if one:
        name = CanonicalForm(problem).one.decode()
        model.columns[name] = (1.0, 1.0, False)
        model.terms.update({("", name): arrays.constant} if arrays.constant else {})
        model.terms.update({} if rows else {("c_ONE", name): 1.0})
        model.rows.update({} if rows else {"c_ONE": (1.0, 1.0)})
    return model


def values_at(problem: Problem, points: Floats) -> tuple[Floats, Floats]:
    """Objective (k,) and rows (k, rows), their constants on the right side, at points (k, columns)."""
    objective = np.array([problem.objective_value(point) for point in points])
    rows = [
        np.concatenate([np.zeros(0), *(family.values(point) + family.limit for family in problem.rows)])
        for point in points
    ]
    return objective, np.array(rows).reshape(len(points), problem.n_rows)


def algebra_difference(
    reported: Algebra, problem: Problem, tolerance: float = 0.0, *, one: bool = True
) -> str:
    """First difference between the algebra of a file and the problem; empty without one.

    tolerance: relative difference of numbers, 0 for equal to the bit. one: as of `problem_algebra`; a model
    without that column may lack columns in no term.
    """
    expected = problem_algebra(problem, one=one)
    if not one:
        used = {name for _, *names in expected.terms for name in names}
        for name in {*expected.columns} - {*reported.columns} - used:
            del expected.columns[name]
    kinds = ("columns", "rows", "terms")
    wrong = (_difference(kind, getattr(reported, kind), getattr(expected, kind), tolerance) for kind in kinds)
    return next(filter(None, wrong), "")


def _difference(kind: str, theirs: dict[Any, Any], mine: dict[Any, Any], tolerance: float) -> str:
    """First difference between the numbers of a model by names."""
    extra, missing = (sorted(one.keys() - other.keys()) for one, other in ((theirs, mine), (mine, theirs)))
    words = [
        f"{word} {', '.join(map(str, names[:3]))}"
        for word, names in (("adds", extra), ("lacks", missing))
        if names
    ]
    if words:
        return f"{len(theirs)} {kind} instead of {len(mine)}: {'; '.join(words)}"
    unequal = [key for key, value in mine.items() if not _are_close(theirs[key], value, tolerance).all()]
    if not unequal:
        return ""
    key = unequal[0]
    return f"{kind} at {key} have {theirs[key]} instead of {mine[key]} ({len(unequal)} such)"


def _are_close(reported: Any, expected: Any, tolerance: float) -> Bools:
    if not tolerance:
        return np.asarray(np.equal(reported, expected))
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
    columns, rows = problem.column_names, problem.row_names
    mine = named_limits(columns, problem.lower, problem.upper, problem.integer)
    theirs = named_limits(reported.columns, reported.lower, reported.upper, reported.integer)
    if reported.may_lack:
        for name in _columns_in_no_term(problem, columns) - theirs.keys():
            del mine[name]
    of_rows = named_limits(reported.rows, reported.row_lower, reported.row_upper)
    objective, activities = values_at(problem, points.of(columns))
    return (
        _difference("columns", theirs, mine, reported.rounding)
        or _difference("rows", of_rows, named_limits(rows, *row_sides(problem.rows)), reported.rounding)
        or _value_difference("the objective", reported.objective, objective, VALUES)
        or _value_difference(
            "a row", reported.activities[:, positions_of(reported.rows, rows)], activities, VALUES
        )
    )


def _columns_in_no_term(problem: Problem, columns: list[str]) -> set[str]:
    """Names of columns that stand in no term."""
    used = np.zeros(problem.n_columns, dtype=bool)
    for family in (*problem.objective, *problem.rows):
        for symbol in family.variables:
            used[family.column_of(symbol)] = True
    return {columns[place] for place in np.nonzero(~used)[0].tolist()}
