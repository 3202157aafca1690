"""QPLIB's own format, for problems up to quadratic: lines of numbers in a fixed order, comments after `#`.

    tiny # ...                     name of the instance; the header stands in comments of the first lines
    CGL # ...                      type of objective (L linear, D convex diagonal, C convex, Q any), of
                                   variables (C continuous, M with binaries, G with integers), of rows
                                   (B none, L linear, Q any)
    minimize
    n; m                           numbers of variables and, unless there are none, rows
    count, then `i j value`        the objective's Q, unless it is linear; below the diagonal or on it
    default, count, `i value`      a vector: its usual value, how many differ, and those; here b
    constant
    count, then `k i j value`      Q of the rows, when one is quadratic
    count, then `k j value`        linear terms of the rows
    infinity                       a bound of this size is none
    vectors                        left and right sides (with rows), lower and upper bounds, integer or not
                                   (with integers), start, duals of rows (with rows), duals of bounds
    count, then `i name`           names of variables, and of rows

Everything counts from 1. Objective and rows are x'Qx/2 + bx with a *lower triangular* Q, not the triangle of
a symmetric one: a square's entry and a product's entry are both twice the coefficient. See
qplib.zib.de/doc.html (Q_row,col = 0 for row < col); Jij-Inc/ommx#1207 and #1209 found it so in all 453
instances against their GAMS models. No line is only a comment or empty, because some readers do not skip
those.

Order and types: qplib.zib.de/doc.html, and appendix B of Furini and others, QPLIB: a library of quadratic
programming instances, Mathematical Programming Computation 11 (2019).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from ...models.formulations.families import PlacedFamily, row_sides
from ...models.instance.domain import Floats, Ints
from ..writing.canonical import CanonicalForm, coefficient
from ..writing.curvature import probtype
from ..writing.records import Decimals, Piece, number_text, render, words

INFINITY: Final = 1e20


def generate(form: CanonicalForm, header: list[str], *, start: Floats | None = None) -> Iterator[bytes]:
    """The bytes of the .qplib file, block by block. header: lines of comment. start: a point (columns,)."""
    problem = form.problem
    yield from _head(form, header)
    yield from _objective(form)
    if problem.rows:
        yield from _rows(form)
    yield _line(number_text(INFINITY), "infinity")
    if problem.rows:
        for side, sides in zip(("left", "right"), row_sides(problem.rows), strict=True):
            yield from _vector(sides, f"{side} side of a row")
    yield from _vector(problem.lower, "lower bound")
    yield from _vector(problem.upper, "upper bound")
    if problem.integer.any():
        yield from _vector(problem.integer.astype(np.float64), "type of a variable, 1 integer")
    yield from _vector(np.zeros(problem.n_columns) if start is None else start, "start")
    if problem.rows:
        yield from _vector(np.zeros(problem.n_rows), "start of a row's dual")
    yield from _vector(np.zeros(problem.n_columns), "start of a bound's dual")
    yield from _names(form)


def _line(value: str, comment: str) -> bytes:
    return f"{value} # {comment}\n".encode()


def _head(form: CanonicalForm, header: list[str]) -> Iterator[bytes]:
    problem = form.problem
    values = [problem.instance.name, probtype(problem) or "", "minimize", str(problem.n_columns)]
    values += [str(problem.n_rows)] * bool(problem.rows)
    comments = [*header[:3], "number of variables", "number of rows"][: len(values)]
    if len(header) > 3:
        comments[-1] = "; ".join(header[3:])
    yield from map(_line, values, comments)


def _vector(values: Floats, comment: str) -> Iterator[bytes]:
    """A vector: its most frequent value, the number of other values, and these."""
    finite = np.clip(values, -INFINITY, INFINITY)
    distinct, count = np.unique(finite, return_counts=True)
    usual = float(distinct[count.argmax()]) if len(distinct) else 0.0
    at = np.nonzero(finite != usual)[0]
    yield _line(number_text(usual), f"{comment}, where not listed")
    yield _line(str(len(at)), "listed")
    yield from render([Decimals(at + 1), b" ", words(finite[at]), b"\n"], len(at))


def _objective(form: CanonicalForm) -> Iterator[bytes]:
    if form.problem.objective_degree == 2:
        index, value = form.products()
        yield _line(str(len(value)), "quadratic terms of the objective")
        yield from _products([], index[:, 0], index[:, 1], words(2 * value))
    yield from _vector(form.costs, "linear coefficient of the objective")
    yield _line(number_text(form.constant), "constant of the objective")


def _products(before: list[Any], one: Ints, two: Ints, value: Piece) -> Iterator[bytes]:
    """Entries of lower triangles, the larger index first."""
    larger, smaller = np.maximum(one, two) + 1, np.minimum(one, two) + 1
    parts = [*before, Decimals(larger), b" ", Decimals(smaller), b" ", value, b"\n"]
    yield from render(parts, len(one))


def _rows(form: CanonicalForm) -> Iterator[bytes]:
    """Coefficients of the rows: products, if there are any, then linear terms."""
    problem = form.problem
    for degree in (2, 1) if problem.row_degree == 2 else (1,):
        total = sum(family.count * len(family.of_degree(degree)) for family in problem.rows)
        yield _line(str(total), f"{'quadratic' if degree == 2 else 'linear'} terms of rows")
        first = 1
        for family in problem.rows:
            yield from _row_terms(family, degree, first)
            first += family.count


def _row_terms(family: PlacedFamily, degree: int, first: int) -> Iterator[bytes]:
    row = Decimals(np.arange(first, first + family.count))
    linear: list[Any] = []
    for term in family.of_degree(degree):
        value = coefficient(term)
        if degree == 2:
            one, two = term.factors
            yield from _products([row, b" "], one, two, words(2 * np.asarray(value)))
        else:
            linear += [row, b" ", Decimals(term.factors[0] + 1), b" ", words(value), b"\n"]
    yield from render(linear, family.count)


def _names(form: CanonicalForm) -> Iterator[bytes]:
    problem, names = form.problem, form.names
    yield _line(str(problem.n_columns), "names of variables")
    for block in problem.blocks.values():
        place = Decimals(np.arange(block.offset + 1, block.offset + block.count + 1))
        yield from render([place, b" ", names.of(block), b"\n"], block.count)
    yield _line(str(problem.n_rows), "names of rows")
    first = 1
    for family in problem.rows:
        place = Decimals(np.arange(first, first + family.count))
        yield from render([place, b" ", names.row(family), b"\n"], family.count)
        first += family.count
