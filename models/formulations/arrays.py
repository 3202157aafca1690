"""A problem as arrays: matrices, bounds and names, for solvers that are called without a file."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..instance.grid import Bools, Floats, Ints
from .families import ANY_DEGREE, PlacedFamily, Placement
from .names import Bytes, column_names, row_names

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
        `row_q` returns the matrix of one row.
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

    @property
    def quadratic_rows(self) -> Ints:
        """Numbers of the rows with products, in ascending order."""
        return np.unique(self.row_products[:, 0])

    def row_q(self, row: int) -> sparse.csr_array:
        """Quadratic part of a row: the symmetric matrix P of 0.5 x'Px, shape (n, n)."""
        chosen = self.row_products[:, 0] == row
        return symmetric(self.row_products[chosen, 1:], self.row_factors[chosen], len(self.c))

    def objective_value(self, point: Floats) -> float:
        """Objective at a point (n,)."""
        return float(0.5 * point @ (self.q @ point) + self.c @ point) + self.constant

    def activities(self, point: Floats) -> Floats:
        """Values of the rows at a point (n,), shape (m,), to be compared with their sides."""
        row, first, second = self.row_products.T
        products = self.row_factors * point[first] * point[second]
        found: Floats = self.a @ point + np.bincount(row, products, self.a.shape[0])
        return found


class Formulated(Placement, Protocol):
    """A problem, as far as its arrays need it."""

    @property
    def objective(self) -> tuple[PlacedFamily, ...]:
        """Terms of the objective."""

    @property
    def lower(self) -> Floats:
        """Lower bounds."""

    @property
    def upper(self) -> Floats:
        """Upper bounds."""

    @property
    def integer(self) -> Bools:
        """Integer columns."""

    def merged_objective(self, degree: int, *, up_to: int) -> tuple[Ints, Floats]:
        """Monomials of that degree, of terms of no higher degree than `up_to`."""


def arrays_of(problem: Formulated, *, names: bool) -> ProblemArrays:
    """Return the arrays of a problem."""
    size, places = len(problem.lower), _places(problem.rows)
    at, cost = problem.merged_objective(1, up_to=QUADRATIC)
    c = np.zeros(size)
    c[at[:, 0]] = cost
    entries, values = row_terms(problem.rows, 1, up_to=QUADRATIC)
    products, factors = row_terms(problem.rows, 2, up_to=QUADRATIC)
    lower, upper = row_sides(problem.rows)
    a = sparse.csr_array((values, tuple(entries.T)), shape=(len(lower), size))
    a.eliminate_zeros()
    nonlinear = [each for each in (*problem.objective, *problem.rows) if each.degree > QUADRATIC]
    for family in nonlinear:
        at_rows = places.get(family.family.tag, slice(0))
        lower[at_rows], upper[at_rows] = -np.inf, np.inf
    return ProblemArrays(
        c=c,
        constant=float(problem.merged_objective(0, up_to=QUADRATIC)[1][0]),
        q=symmetric(*problem.merged_objective(2, up_to=QUADRATIC), size),
        a=a,
        row_lower=lower,
        row_upper=upper,
        row_products=products,
        row_factors=factors,
        lower=problem.lower.copy(),
        upper=problem.upper.copy(),
        integer=problem.integer.copy(),
        column_names=_texts(column_names(problem)) if names else None,
        row_names=_texts(row_names(problem)) if names else None,
        nonlinear=tuple(family.family.tag for family in nonlinear),
        family_rows=places,
    )


def symmetric(at: Ints, factor: Floats, size: int) -> sparse.csr_array:
    """The matrix Q of 0.5 x'Qx for products of columns `at`, shape (k, 2), with factors (k,)."""
    both = np.concatenate([at, at[:, ::-1]])
    found = sparse.csr_array((np.tile(factor, 2), tuple(both.T)), shape=(size, size))
    found.eliminate_zeros()
    return found


def row_terms(
    families: Iterable[PlacedFamily], degree: int, *, up_to: int = ANY_DEGREE
) -> tuple[Ints, Floats]:
    """Terms of a degree of all rows: row and columns, shape (k, degree + 1), and coefficients (k,).

    up_to: greatest degree of the families that are counted.
    """
    at: list[Ints] = [np.zeros((0, degree + 1), np.int32)]
    values: list[Floats] = [np.zeros(0)]
    start = 0
    for family in families:
        row = np.arange(start, start + family.count, dtype=np.int32)
        for term in family.of_degree(degree) if family.degree <= up_to else ():
            at.append(np.stack([row, *term.factors], axis=1))
            values.append(np.broadcast_to(np.asarray(term.coefficient, dtype=np.float64), (family.count,)))
        start += family.count
    return np.concatenate(at), np.concatenate(values)


def row_sides(families: Iterable[PlacedFamily]) -> tuple[Floats, Floats]:
    """Left and right sides of all rows, constants moved there; -inf and inf without a side."""
    lower, upper = [np.zeros(0)], [np.zeros(0)]
    for family in families:
        sense, nothing = family.family.sense, np.full(family.count, np.inf)
        lower.append(-nothing if sense == "<=" else family.limit)
        upper.append(nothing if sense == ">=" else family.limit)
    return np.concatenate(lower) + 0.0, np.concatenate(upper) + 0.0


def _places(families: Iterable[PlacedFamily]) -> dict[str, slice]:
    """Rows of each family by its tag."""
    found, start = {}, 0
    for family in families:
        found[family.family.tag] = slice(start, start + family.count)
        start += family.count
    return found


def _texts(names: Bytes) -> Names:
    return np.ascontiguousarray(names).view(f"S{names.shape[1]}").ravel().astype(np.str_)
