"""QPLIB's own format, for what is at most quadratic: lines of numbers, each thing in its place, comments after `#`.

    tiny # ...                     name of the instance; the lines of the header follow the first lines as comments
    CGL # ...                      type of objective (L linear, D convex diagonal, C convex, Q any), variables (C continuous, M with
                                   binaries, G with integers), rows (B none, L linear, Q any)
    minimize
    n; m                           numbers of variables and, unless there are none, rows
    count, then `i j value`        the objective's Q, unless it is linear; below the diagonal or on it
    default, count, `i value`      a vector: its usual value, how many differ, and those; here the objective's b
    constant
    count, then `k i j value`      Q of the rows, when one is quadratic; count, then `k j value`: their linear terms
    infinity                       a bound of this size is none
    vectors                        left and right sides (with rows), lower and upper bounds, integer or not (with integers),
                                   start, duals of rows (with rows), duals of bounds
    count, then `i name`           names of variables, and of rows

Everything counts from 1. Objective and rows are x'Qx/2 + bx with a *lower triangular* Q, not the triangle of a symmetric one: a square's entry and
a product's entry are both twice the coefficient. So says qplib.zib.de/doc.html (Q_row,col = 0 for row < col); Jij-Inc/ommx#1207 and #1209 found it
so in all 453 instances against their GAMS models. No line is comment alone and none is empty, for not every reader skips those.

Order and types: qplib.zib.de/doc.html, and appendix B of Furini and others, QPLIB: a library of quadratic programming instances,
Mathematical Programming Computation 11 (2019).
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import zip_longest
from typing import Any, Final

import numpy as np

from ...models.formulations.problem import Bound, Problem
from ...models.instance.grid import Floats, Ints
from ..writing.names import Names
from ..writing.records import Decimals, check_coefficients, number, render, words
from .lp import linear_costs

INFINITY: Final = 1e20


def generate(problem: Problem, header: list[str], *, start: Floats | None = None) -> Iterator[bytes]:
    """The bytes of the .qplib file, block by block. header: lines of comment. start: a point (columns,)."""
    yield from _head(problem, header)
    yield from _objective(problem)
    if problem.rows:
        yield from _rows(problem)
    yield _line(number(INFINITY), "infinity")
    if problem.rows:
        for side, low in (("left", True), ("right", False)):
            yield from _vector(_sides(problem, low=low), f"{side} side of a row")
    yield from _vector(problem.lower, "lower bound")
    yield from _vector(problem.upper, "upper bound")
    if problem.integer.any():
        yield from _vector(problem.integer.astype(np.float64), "type of a variable, 1 integer")
    yield from _vector(np.zeros(problem.columns) if start is None else start, "start")
    if problem.rows:
        yield from _vector(np.zeros(problem.row_count), "start of a row's dual")
    yield from _vector(np.zeros(problem.columns), "start of a bound's dual")
    yield from _names(problem)


def kind(problem: Problem) -> str:
    """QPLIB's three letters: of objective, variables and rows. Angles are never integer and always bounded, so B, I and N do not occur."""
    binary = problem.integer & (problem.lower == 0) & (problem.upper == 1)
    variables = "C" if not problem.integer.any() else "M" if (binary == problem.integer).all() else "G"
    return (
        _curvature(problem) + variables + ("Q" if problem.row_degree == 2 else "L" if problem.rows else "B")
    )


def _curvature(problem: Problem) -> str:
    """L, D, C or Q (any): convex where every summand, as declared, has a Hessian without negative eigenvalue."""
    if problem.objective_degree < 2:
        return "L"
    if not all(_convex(family) for family in problem.objective):
        return "Q"
    index, _ = problem.merged_objective(2)
    return "D" if (index[:, 0] == index[:, 1]).all() else "C"


def _convex(family: Bound) -> bool:
    size = len(family.variables)
    products = family.of_degree(2)
    values = np.stack([np.broadcast_to(term.coefficient, (family.count,)) for term in products], axis=1) if products else np.zeros((1, 0))  # fmt: skip
    values = values[:1] if (values == values[0]).all() else values
    hessian = np.zeros((len(values), size, size))
    for term, value in zip(products, values.T, strict=True):
        one, two = map(family.variables.index, term.symbols)
        hessian[:, one, two] += value
        hessian[:, two, one] += value
    eigenvalues = np.linalg.eigvalsh(hessian)
    return bool((eigenvalues >= -1e-12 * np.abs(hessian).max(axis=(1, 2), initial=0.0)[:, None]).all())


def _line(value: str, comment: str) -> bytes:
    return f"{value} # {comment}\n".encode()


def _head(problem: Problem, header: list[str]) -> Iterator[bytes]:
    values = [problem.instance.name, kind(problem), "minimize", str(problem.columns)]
    for value, comment in zip_longest(values, header[:3], fillvalue="number of variables"):
        yield _line(value, comment)
    if problem.rows:
        yield _line(str(problem.row_count), header[3] if len(header) > 3 else "number of rows")


def _vector(values: Floats, comment: str) -> Iterator[bytes]:
    """A vector: its most frequent value, the number of the others, and these."""
    finite = np.clip(values, -INFINITY, INFINITY)
    distinct, count = np.unique(finite, return_counts=True)
    usual = float(distinct[count.argmax()])
    at = np.nonzero(finite != usual)[0]
    yield _line(number(usual), f"{comment}, where not listed")
    yield _line(str(len(at)), "listed")
    yield from render([Decimals(at + 1), b" ", words(finite[at]), b"\n"], len(at))


def _objective(problem: Problem) -> Iterator[bytes]:
    if problem.objective_degree == 2:
        index, value = problem.merged_objective(2)
        check_coefficients(value, "the objective")
        yield _line(str(len(value)), "quadratic terms of the objective")
        yield from _products([], index[:, 0], index[:, 1], 2 * value)
    yield from _vector(linear_costs(problem), "linear coefficient of the objective")
    yield _line(number(problem.merged_objective(0)[1][0]), "constant of the objective")


def _products(before: list[Any], one: Ints, two: Ints, value: Floats | float) -> Iterator[bytes]:
    """Entries of lower triangles, the larger index first."""
    larger, smaller = np.maximum(one, two) + 1, np.minimum(one, two) + 1
    parts = [*before, Decimals(larger), b" ", Decimals(smaller), b" ", words(value), b"\n"]
    yield from render(parts, len(one))


def _rows(problem: Problem) -> Iterator[bytes]:
    """Coefficients of the rows: products, when there are any, then linear terms."""
    for degree in (2, 1) if problem.row_degree == 2 else (1,):
        total = sum(family.count * len(family.of_degree(degree)) for family in problem.rows)
        yield _line(str(total), f"{'quadratic' if degree == 2 else 'linear'} terms of rows")
        first = 1
        for family in problem.rows:
            yield from _row_terms(family, degree, first)
            first += family.count


def _row_terms(family: Bound, degree: int, first: int) -> Iterator[bytes]:
    row = Decimals(np.arange(first, first + family.count))
    linear: list[Any] = []
    for term in family.of_degree(degree):
        check_coefficients(term.coefficient, f"row family {family.family.tag}")
        if degree == 2:
            one, two = term.factors
            yield from _products([row, b" "], one, two, 2 * np.asarray(term.coefficient))
        else:
            linear += [row, b" ", Decimals(term.factors[0] + 1), b" ", words(term.coefficient), b"\n"]
    yield from render(linear, family.count)


def _sides(problem: Problem, *, low: bool) -> Floats:
    """Left or right sides of all rows, infinite where there is none."""
    without, infinity = ("<=", -np.inf) if low else (">=", np.inf)
    sides = [np.full(f.count, infinity) if f.family.sense == without else f.limit for f in problem.rows]
    return np.concatenate(sides) + 0.0


def _names(problem: Problem) -> Iterator[bytes]:
    names = Names(problem)
    yield _line(str(problem.columns), "names of variables")
    for block in problem.blocks.values():
        place = Decimals(np.arange(block.offset + 1, block.offset + block.count + 1))
        yield from render([place, b" ", names.of(block), b"\n"], block.count)
    yield _line(str(problem.row_count), "names of rows")
    first = 1
    for family in problem.rows:
        place = Decimals(np.arange(first, first + family.count))
        yield from render([place, b" ", names.row(family), b"\n"], family.count)
        first += family.count
