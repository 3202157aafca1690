"""The content of a model file as its program reads it, as plain arrays.

export/programs/comparison.py states how it differs from the problem. There are two forms: an `Algebra` holds
the coefficients of costs, products and rows, as readers of LP and MPS report them, and a `Behaviour` the
values of objective and rows at points, as readers of .nl and GAMS report them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, Self

import numpy as np

from ...models.instance.domain import Bools, Floats, Ints
from .protocol import RefusedError

_INFINITY: Final = 1e20


Entries = Iterable[tuple[Any, ...]]
"""Coefficients: number of a row, or None for the objective, numbers of one column or two, and the value."""


@dataclass(frozen=True)
class Algebra:
    """A quadratic model by the names of its columns and rows.

    columns: lower and upper bound of each, and whether it is integer. rows: left and right side of each.
    terms: coefficients that are not 0, by name of the row, empty for the objective, and names of columns.
    """

    columns: dict[str, tuple[float, float, bool]]
    rows: dict[str, tuple[float, float]]
    terms: dict[tuple[str, ...], float]

    @classmethod
    def of(
        cls,
        columns: Sequence[str],
        rows: Sequence[str],
        entries: Entries,
        *,
        lower: Any,
        upper: Any,
        integer: Any,
        row_lower: Any,
        row_upper: Any,
    ) -> Self:
        """The model with these entries, equal ones added up. Raises RefusedError for a name that is twice."""
        if len({*columns}) < len(columns) or len({*rows}) < len(rows):
            raise RefusedError("it gives two columns or rows one name")
        terms: dict[tuple[str, ...], float] = {}
        for row, *at, value in entries:
            key = ("" if row is None else rows[row], *sorted(columns[column] for column in at))
            terms[key] = terms.get(key, 0.0) + float(value)
        limits = named_limits(columns, lower, upper, integer), named_limits(rows, row_lower, row_upper)
        return cls(*limits, {key: value for key, value in terms.items() if value})


def named_limits(names: Sequence[str], lower: Any, upper: Any, *more: Any) -> dict[str, Any]:
    """Both limits of each column or row, and what more there is, by its name."""
    parts = (np.asarray(part).tolist() for part in (lower, upper, *more))
    return dict(zip(names, zip(*parts, strict=True), strict=True))


def numbered(values: Any) -> Iterator[tuple[None, int, float]]:
    """The entries of linear costs."""
    return ((None, column, value) for column, value in enumerate(values))


def entries_of_triangle(row: Any, column: Any, value: Any) -> Iterator[tuple[None, int, int, float]]:
    """The entries of an objective x'Qx/2, given by one triangle."""
    triples = zip(*(np.asarray(part).tolist() for part in (row, column, value)), strict=True)
    return ((None, i, j, q / 2 if i == j else q) for i, j, q in triples)


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
