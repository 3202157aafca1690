"""AMPL .nl, as text, in the subset that the AMPL Solver Library, SCIP and CasADi read alike.

The order of columns and rows is that of `writing.nl_order`. Header, line by line (docs/format-rules.md):

    g4 1 1 0 123456789                 b4 for binary; the .sol repeats the options, the last of them the stamp
    variables rows objectives ranges equations
    nonlinear rows, objectives
    0 0                                no network
    nlvc nlvo nlvb                     nlvo is a prefix bound, not a count (N2)
    0 0 arith 1                        flag 1: the solver reports its code (arith 1: little-endian binary)
    nbv niv nlvbi nlvci nlvoi          integers among the nonlinear groups are not counted in nbv, niv (N1)
    nonzeros of Jacobian, gradient     a nonlinear variable has its entry, with coefficient 0
    longest names of rows, columns
    0 0 0 0 0                          no defined variables (N7)

Segments: C (rows), O, x (start), r, b, k (cumulative column counts, N4), J, G; none empty (N3), no comments
(N6). Opcodes: o0 + , o2 * , o5 power, o16 minus, o46 cos, o54 sum of three or more (N14). The objective is
written as declared, factored, with its constant inside; of a nonlinear row the linear part stands in J and
the constant in r. Binary: one letter, little-endian int32 and float64.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...models.formulations.expressions import Symbol
from ...models.formulations.families import PlacedFamily
from ...models.formulations.names import name_length
from ...models.instance.domain import Floats, Ints
from ..writing.canonical import BOUND_KINDS, CanonicalForm, bound_kinds, coefficient
from ..writing.expressions import Operator, PrefixLanguage
from ..writing.names import OBJECTIVE
from ..writing.nl_order import NlOrder, equal_runs, nonlinear_terms
from ..writing.records import (
    Decimals,
    Hole,
    Piece,
    Pieces,
    check_coefficients,
    render,
    words,
)
from ..writing.stamps import stamp_option

ADD, MULTIPLY, POWER, NEGATE, COSINE, SUM = 0, 2, 5, 16, 46, 54


Numbers = NDArray[Any] | int | float


def _number(value: Numbers) -> bytes | Hole:
    """A number within a token, decimal if it is whole by its type."""
    if isinstance(value, int):
        return str(value).encode()
    values = np.asarray(value)
    return Decimals(values) if values.dtype.kind == "i" else words(values)


def _token(name: bytes, *numbers: Numbers) -> list[Piece]:
    """A line: a letter with numbers, numbers alone, or a digit with numbers, with a blank between."""
    parts: list[Piece] = [name] if name else []
    for place, value in enumerate(numbers):
        parts += [b" "] if place or name.isdigit() else []
        parts.append(_number(value))
    return [*parts, b"\n"]


def _constant(value: Floats | float) -> list[Piece]:
    """A number in an expression."""
    return _token(b"n", np.asarray(value, dtype=np.float64))


def _sum(count: int) -> list[Piece]:
    """The operator for the sum of two summands or more."""
    return _token(b"o", ADD) if count == 2 else [*_token(b"o", SUM), *_token(b"", count)]


def generate(
    form: CanonicalForm, _header: Sequence[str] = (), *, start: Floats | None = None
) -> Iterator[bytes]:
    """The bytes of the .nl file, which holds no comments. start: a point (columns,) for the segment x."""
    problem, nl = form.problem, form.nl_order
    gradient = _gradient(nl)
    yield _head(nl, len(gradient[0]))
    first = 0
    for family in nl.rows:
        head = _token(b"C", np.arange(first, first + family.count, dtype=np.int32))
        yield from render([*head, *_NlExpressions(family, nl).monomials()], family.count)
        first += family.count
    yield from _objective(nl)
    if start is not None:
        yield from render(_token(b"x", problem.n_columns))
        parts = _token(b"", np.arange(problem.n_columns, dtype=np.int32), start[nl.order])
        yield from render(parts, problem.n_columns)
    yield from _limits(nl)
    yield from _bounds(nl)
    yield from _jacobian(nl, *gradient)


def _head(nl: NlOrder, costs: int) -> bytes:
    """The first ten lines. costs: entries of G."""
    problem, count = nl.problem, np.bincount(nl.group, minlength=9)
    nlvb, nlvc, only = int(count[:2].sum()), int(count[:4].sum()), int(count[4:6].sum())
    equations = sum(family.count for family in nl.rows if family.family.sense == "==")
    entries = sum(family.count * len(_entries(family)) for family in nl.rows)
    rows = (name_length(problem.instance, row.family.tag, row.family.over) for row in nl.rows)
    columns = (name_length(problem.instance, block.name, block.over) for block in problem.blocks.values())
    lines = [
        b"g4 1 1 0 %d" % stamp_option(problem.stamp),
        b" %d %d 1 0 %d" % (problem.n_columns, problem.n_rows, equations),
        b" %d %d" % (sum(family.count for family in nl.nonlinear_rows), bool(nl.nonlinear_objective)),
        b" 0 0",
        b" %d %d %d" % (nlvc, nlvc + only if only else nlvb, nlvb),
        b" 0 0 0 1",
        b" %d %d %d %d %d" % tuple(int(count[group]) for group in (7, 8, 1, 3, 5)),
        b" %d %d" % (entries, costs),
        b" %d %d" % (max([len(OBJECTIVE), *rows]), max(columns)),
        b" 0 0 0 0 0",
    ]
    return b"\n".join(lines) + b"\n"


def _objective(nl: NlOrder) -> Iterator[bytes]:
    families = nl.nonlinear_objective
    yield from render(_token(b"O", 0, 0))
    summands = sum(family.count for family in families)
    if not summands:
        yield from render(_constant(0.0))
    elif summands > 1:
        yield from render(_sum(summands))
    for family in families:
        yield from render(_NlExpressions(family, nl).expression(family.family.body), family.count)


class _NlExpressions(PrefixLanguage):
    """Expressions of a family in a form of the file."""

    def __init__(self, family: PlacedFamily, nl: NlOrder) -> None:
        super().__init__(family)
        self._nl = nl

    def number(self, values: Floats | float) -> Pieces:
        """A number."""
        return _constant(values)

    def column(self, symbol: Symbol) -> Pieces:
        """A column, by its place in the file."""
        return _token(b"v", self._nl.places(self.family, symbol))

    def node(self, operator: Operator, parts: list[Pieces]) -> Pieces:
        """An operator with its operands; a product is one of pairs, and a sum of two has its own operator."""
        inside = [piece for part in parts for piece in part]
        if operator == "sum":
            return [*_sum(len(parts)), *inside]
        if operator == "product":
            return [
                *(piece for part in parts[:-1] for piece in (*_token(b"o", MULTIPLY), *part)),
                *parts[-1],
            ]
        if operator == "square":
            return [*_token(b"o", POWER), *inside, *_constant(2.0)]
        return [*_token(b"o", NEGATE if operator == "negative" else COSINE), *inside]

    def monomials(self) -> Pieces:
        """The nonlinear terms of a row; 0 without any."""
        terms = [
            self.node("product", [self.number(coefficient(term)), *map(self.column, term.symbols)])
            for term in nonlinear_terms(self.family)
        ]
        return self.join("sum", terms) if terms else self.number(0.0)


def _limits(nl: NlOrder) -> Iterator[bytes]:
    if not nl.rows:
        return
    yield from render(_token(b"r"))
    for family in nl.rows:
        kind = {">=": b"2", "<=": b"1", "==": b"4"}[family.family.sense]
        yield from render(_token(kind, family.limit), family.count)


_BOUND: Final = np.array([{"lower": 2, "upper": 1, "free": 3}.get(kind, 0) for kind in BOUND_KINDS])
"""The digit before the bounds of a column, by their kind."""


def _bounds(nl: NlOrder) -> Iterator[bytes]:
    """Bounds in file order, one stretch of one block and of equal digits after the other."""
    yield from render(_token(b"b"))
    for block, run in nl.stretches:
        inside = nl.order[run] - block.offset
        digits = _BOUND[bound_kinds(block)[inside]]
        for part in equal_runs(digits):
            lower, upper = block.lower[inside[part]], block.upper[inside[part]]
            digit = int(digits[part.start])
            ends = {0: (lower, upper), 1: (upper,), 2: (lower,), 3: ()}[digit]
            yield from render(_token(b"%d" % digit, *ends), len(lower))


def _entries(family: PlacedFamily) -> list[tuple[Symbol, Floats | float]]:
    """Symbols and coefficients of a row in J: linear terms, and 0 for columns only in nonlinear ones."""
    linear = {term.symbols[0]: coefficient(term) for term in family.of_degree(1)}
    return list((linear | {s: 0.0 for s in family.variables if s not in linear}).items())


def _gradient(nl: NlOrder) -> tuple[Ints, Floats]:
    """Places and coefficients of G: costs of linear terms, and 0 for columns of nonlinear ones."""
    problem = nl.problem
    costs = np.zeros(problem.n_columns)
    for family in problem.objective:
        if family.degree <= 1:
            for term in family.of_degree(1):
                np.add.at(costs, term.factors[0], term.coefficient)
    check_coefficients(costs, "the objective")
    place = np.nonzero(((costs != 0) | nl.in_objective)[nl.order])[0].astype(np.int32)
    return place, costs[nl.order[place]]


def _jacobian(nl: NlOrder, place: Ints, costs: Floats) -> Iterator[bytes]:
    problem = nl.problem
    rows = [(family, _entries(family)) for family in nl.rows]
    if rows:
        count = np.zeros(problem.n_columns, dtype=np.int32)
        for family, entries in rows:
            for symbol, _ in entries:
                block, inside = family.block(symbol), family.inside(symbol)
                count[block.slice] += 1 if inside is None else np.bincount(inside, minlength=block.count)
        yield from render(_token(b"k", problem.n_columns - 1))
        yield from render(
            _token(b"", np.cumsum(count[nl.order])[:-1].astype(np.int32)), problem.n_columns - 1
        )
    first = 0
    for family, entries in rows:
        parts = _token(b"J", np.arange(first, first + family.count, dtype=np.int32), len(entries))
        for symbol, value in entries:
            parts += _token(b"", nl.places(family, symbol), np.asarray(value, dtype=np.float64))
        yield from render(parts, family.count)
        first += family.count
    if len(place):
        yield from render(_token(b"G", 0, len(place)))
        yield from render(_token(b"", place, costs), len(place))
