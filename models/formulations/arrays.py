"""A problem as arrays: matrices, bounds and names."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..instance.domain import Bools, Floats, Ints
from .families import PlacedFamily, merge_terms, row_sides
from .names import Bytes, decode_names

QUADRATIC: Final = 2
"""Greatest degree of what arrays hold."""
Names = NDArray[np.str_]


@dataclass(frozen=True, eq=False)
class ProblemArrays:
    """A problem up to degree 2 as arrays, with n columns and m rows in the order of the problem.

    minimise 0.5 x'Qx + c'x + constant
    subject to row_lower <= Ax + quadratic parts <= row_upper, lower <= x <= upper, x[integer] whole

    Attributes
    ----------
    c
        Linear costs, shape (n,).
    constant
        Constant of the objective.
    q
        Q, symmetric, shape (n, n): a product k x_i x_j has k at [i, j] and at [j, i], a square k x_i^2 has
        2 k at [i, i].
    a
        A, the linear terms of all rows, shape (m, n).
    row_lower, row_upper
        Sides of the rows, shape (m,); -inf and inf without a side. Constants of rows are on these sides.
    row_products, row_factors
        Products of the rows: row, first and second column, shape (k, 3), and their factors, shape (k,).
    lower, upper
        Bounds of the columns, shape (n,).
    integer
        True for integer columns, shape (n,).
    column_names, row_names
        Names as in the files, shapes (n,) and (m,), or None when they were not asked for.
    nonlinear
        Tags of the terms of the objective and of the rows that are not polynomials of degree 2 or less. The
        arrays do not contain their coefficients, and their rows have the sides -inf and inf.
    family_rows
        Rows of each family by its tag.

    """

    c: Floats
    constant: float
    q: sparse.csr_array
    a: sparse.csr_array
    row_lower: Floats
    row_upper: Floats
    row_products: Ints
    row_factors: Floats
    lower: Floats
    upper: Floats
    integer: Bools
    column_names: Names | None
    row_names: Names | None
    nonlinear: tuple[str, ...]
    family_rows: dict[str, slice]

    def __repr__(self) -> str:
        rows, columns = self.a.shape
        entries = f"entries: a {self.a.nnz}, q {self.q.nnz}, row_products {len(self.row_products)}"
        return f"<ProblemArrays: {columns} columns ({self.integer.sum()} integer), {rows} rows; {entries}>"

    def objective_value(self, point: Floats) -> float:
        """Objective at a point (n,)."""
        return float(0.5 * point @ (self.q @ point) + self.c @ point) + self.constant

    def activities(self, point: Floats) -> Floats:
        """Values of the rows at a point (n,), shape (m,), to be compared with their sides."""
        row, first, second = self.row_products.T
        products = self.row_factors * point[first] * point[second]
        values: Floats = self.a @ point + np.bincount(row, products, self.a.shape[0])
        return values


def problem_arrays(
    objective: tuple[PlacedFamily, ...],
    rows: tuple[PlacedFamily, ...],
    columns: tuple[Floats, Floats, Bools],
    names: tuple[Bytes, Bytes] | None,
) -> ProblemArrays:
    """Return the arrays of a problem.

    columns: lower and upper bounds, and whether they are integer. names: of columns and rows.
    """
    size, places = len(columns[0]), _rows_by_tag(rows)
    (_, constant), (at, cost), products_of_costs = (
        merge_terms(objective, degree, size, up_to=QUADRATIC) for degree in range(QUADRATIC + 1)
    )
    c = np.zeros(size)
    c[at[:, 0]] = cost
    entries, values = _row_terms(rows, 1)
    products, factors = _row_terms(rows, 2)
    lower, upper = row_sides(rows)
    a = sparse.csr_array((values, tuple(entries.T)), shape=(len(lower), size))
    a.eliminate_zeros()
    nonlinear = [family for family in (*objective, *rows) if family.degree > QUADRATIC]
    for family in nonlinear:
        at_rows = places.get(family.family.tag, slice(0))
        lower[at_rows], upper[at_rows] = -np.inf, np.inf
    return ProblemArrays(
        c=c,
        constant=float(constant[0]),
        q=quadratic_matrix(*products_of_costs, size),
        a=a,
        row_lower=lower,
        row_upper=upper,
        row_products=products,
        row_factors=factors,
        lower=columns[0].copy(),
        upper=columns[1].copy(),
        integer=columns[2].copy(),
        column_names=decode_names(names[0]) if names else None,
        row_names=decode_names(names[1]) if names else None,
        nonlinear=tuple(family.family.tag for family in nonlinear),
        family_rows=places,
    )


def quadratic_matrix(at: Ints, factor: Floats, size: int) -> sparse.csr_array:
    """The matrix Q of 0.5 x'Qx for products of columns `at`, shape (k, 2), with factors (k,)."""
    both = np.concatenate([at, at[:, ::-1]])
    matrix = sparse.csr_array((np.tile(factor, 2), tuple(both.T)), shape=(size, size))
    matrix.eliminate_zeros()
    return matrix


def _row_terms(families: Iterable[PlacedFamily], degree: int) -> tuple[Ints, Floats]:
    """Terms of a degree of all rows up to quadratic: row and columns (k, degree + 1), coefficients (k,)."""
    at: list[Ints] = [np.zeros((0, degree + 1), np.int32)]
    values: list[Floats] = [np.zeros(0)]
    start = 0
    for family in families:
        row = np.arange(start, start + family.count, dtype=np.int32)
        for term in family.of_degree(degree) if family.degree <= QUADRATIC else ():
            at.append(np.stack([row, *term.factors], axis=1))
            values.append(np.broadcast_to(np.asarray(term.coefficient, dtype=np.float64), (family.count,)))
        start += family.count
    return np.concatenate(at), np.concatenate(values)


def _rows_by_tag(families: Iterable[PlacedFamily]) -> dict[str, slice]:
    """Rows of each family by its tag."""
    rows, start = {}, 0
    for family in families:
        rows[family.family.tag] = slice(start, start + family.count)
        start += family.count
    return rows
