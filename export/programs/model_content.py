"""The content of a model file as its program reads it, as plain arrays.

export/programs/comparison.py states how it differs from the problem. There are two forms: an `Algebra` holds
the coefficients of costs, products and rows, as readers of LP and MPS report them, and a `Behaviour` the
values of objective and rows at points, as readers of .nl and GAMS report them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Self

import numpy as np

from ...models.instance.domain import Bools, Floats, Ints
from ..writing.terms import Terms, merged_terms

_INFINITY: Final = 1e20
_INFINITE_BOUND: Final = 1e19


@dataclass(frozen=True, eq=False)
class Algebra:
    """A quadratic model: costs, limits and coefficients in the order of `columns` and `rows`.

    quadratic: coefficient of x_i x_j for i <= j, at quadratic_at (k, 2); matrix at (row, column);
    row_quadratic at (row, i, j).
    """

    columns: list[str]
    lower: Floats
    upper: Floats
    integer: Bools
    costs: Floats
    quadratic_at: Ints
    quadratic: Floats
    rows: list[str]
    row_lower: Floats
    row_upper: Floats
    matrix_at: Ints
    matrix: Floats
    row_quadratic_at: Ints
    row_quadratic: Floats

    @classmethod
    def of(cls, columns: list[str], rows: list[str], **facts: Any) -> Self:
        """The model; `quadratic`, `matrix` and `row_quadratic` are given as Terms or left out."""
        for name, width in (("quadratic", 2), ("matrix", 2), ("row_quadratic", 3)):
            found = facts.pop(name, None) or Terms(np.zeros((0, width), np.int64), np.zeros(0))
            facts |= {f"{name}_at": found.at, name: found.value}
        arrays = {"integer": np.zeros(len(columns), dtype=bool)} | facts
        kinds = {name: bool if name == "integer" else None for name in arrays}
        return cls(columns=columns, rows=rows, **{key: np.asarray(arrays[key], kinds[key]) for key in arrays})

    def objective(self, points: Floats) -> Floats:
        """The objective at points (k, columns)."""
        first, second = self.quadratic_at.T
        return points @ self.costs + (points[:, first] * points[:, second]) @ self.quadratic

    def activities(self, points: Floats) -> Floats:
        """The rows at points (k, columns), shape (k, rows)."""
        values = np.zeros((len(points), len(self.rows)))
        row, column = self.matrix_at.T
        np.add.at(values.T, row, (points[:, column] * self.matrix).T)
        row, first, second = self.row_quadratic_at.T
        np.add.at(values.T, row, (points[:, first] * points[:, second] * self.row_quadratic).T)
        return values

    def reordered(self, columns: list[str], rows: list[str]) -> Algebra:
        """The same model with its columns and rows in another order."""
        c, r = positions_of(self.columns, columns), positions_of(self.rows, rows)
        back_c, back_r = np.argsort(c), np.argsort(r)
        per_column = {name: getattr(self, name)[c] for name in ("lower", "upper", "integer", "costs")}
        per_row = {name: getattr(self, name)[r] for name in ("row_lower", "row_upper")}
        matrix = np.stack([back_r[self.matrix_at[:, 0]], back_c[self.matrix_at[:, 1]]], axis=1)
        cubes = np.column_stack([back_r[self.row_quadratic_at[:, 0]], back_c[self.row_quadratic_at[:, 1:]]])
        return Algebra.of(
            columns,
            rows,
            **per_column,
            **per_row,
            quadratic=merged_terms(back_c[self.quadratic_at], self.quadratic, indices=2, products=2),
            matrix=merged_terms(matrix, self.matrix, indices=2),
            row_quadratic=merged_terms(cubes, self.row_quadratic, indices=3, products=2),
        )


def positions_of(have: list[str], wanted: list[str]) -> Ints:
    """Position of each wanted name among the existing ones."""
    number = {name: place for place, name in enumerate(have)}
    return np.array([number[name] for name in wanted], dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Behaviour:
    """Columns and rows of a model, and the values of objective (k,) and rows (k, rows) at k points.

    Values that are not reported are NaN. rounding: relative accuracy of reported bounds; may_lack: whether
    columns in no term are left out.
    """

    columns: list[str]
    lower: Floats
    upper: Floats
    integer: Bools
    rows: list[str]
    row_lower: Floats
    row_upper: Floats
    objective: Floats
    activities: Floats
    rounding: float = 0.0
    may_lack: bool = False


@dataclass(frozen=True, eq=False)
class Points:
    """Points by column name, values (k, columns); the first `random` are arbitrary, the rest feasible.

    objective: our values there (k,), for programs that judge a point instead of evaluating it.
    """

    names: list[str]
    values: Floats
    objective: Floats
    random: int

    def of(self, columns: list[str]) -> Floats:
        """The points with their columns in that order."""
        return self.values[:, positions_of(self.names, columns)]


def with_infinities(values: Sequence[float]) -> Floats:
    """Bounds with infinity from 1e20 on, as in CPLEX and Xpress."""
    bounds = np.array(values, dtype=float)
    return np.where(np.abs(bounds) >= _INFINITY, np.copysign(np.inf, bounds), bounds)


def finite_or_none(value: float | None) -> float | None:
    """Return the number, or None for a number that represents infinity."""
    return None if value is None or abs(value) >= _INFINITE_BOUND else float(value)
