"""AMPL .nl, text and binary, in the subset that the AMPL Solver Library, SCIP and CasADi read alike.

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
    RawValues,
    check_coefficients,
    render,
    words,
)
from ..writing.stamps import stamp_option

ADD, MULTIPLY, POWER, NEGATE, COSINE, SUM = 0, 2, 5, 16, 46, 54


Numbers = NDArray[Any] | int | float


class TextForm:
    """The text form: each token on its own line, its numbers apart by blanks."""

    letter, arithmetic = b"g", 0
    padded = True

    def number(self, value: Numbers) -> bytes | Hole:
        """A number within a token, decimal if it is whole by its type."""
        if isinstance(value, int):
            return str(value).encode()
        values = np.asarray(value)
        return Decimals(values) if values.dtype.kind == "i" else words(values)

    def token(self, name: bytes, *numbers: Numbers) -> list[Piece]:
        """A letter with numbers, numbers alone, or a digit with numbers, which then stand apart from it."""
        parts: list[Piece] = [name] if name else []
        for place, value in enumerate(numbers):
            parts += [b" "] if place or name.isdigit() else []
            parts.append(self.number(value))
        return [*parts, b"\n"]

    def constant(self, value: Floats | float) -> list[Piece]:
        """A number in an expression."""
        return self.token(b"n", np.asarray(value, dtype=np.float64))

    def records(self, parts: Pieces, count: int = 1) -> Iterator[bytes]:
        """The bytes of that many records."""
        return render(parts, count, padded=self.padded)

    def sum(self, count: int) -> list[Piece]:
        """The operator for the sum of two summands or more."""
        if count == 2:
            return self.token(b"o", ADD)
        return [*self.token(b"o", SUM), *self.token(b"", count)]


class BinaryForm(TextForm):
    """The binary form: one letter, then little-endian int32 and float64."""

    letter, arithmetic = b"b", 1
    padded = False

    def number(self, value: Numbers) -> bytes | Hole:
        """A number within a token, of four bytes if it is whole by its type."""
        if isinstance(value, int):
            return value.to_bytes(4, "little", signed=True)
        values = np.asarray(value)
        values = values.astype("<i4" if values.dtype.kind == "i" else "<f8")
        return RawValues(values) if values.ndim else values.tobytes()

    def token(self, name: bytes, *numbers: Numbers) -> list[Piece]:
        """A letter or a digit, if any, and numbers."""
        parts: list[Piece] = [name] if name else []
        return parts + [self.number(value) for value in numbers]


def generate(
    form: CanonicalForm, _header: Sequence[str] = (), *, binary: bool = False, start: Floats | None = None
) -> Iterator[bytes]:
    """The bytes of the .nl file, which holds no comments. start: a point (columns,) for the segment x."""
    problem, nl, code = form.problem, form.nl_order, BinaryForm() if binary else TextForm()
    gradient = _gradient(nl)
    yield _head(nl, code, len(gradient[0]))
    first = 0
    for family in nl.rows:
        head = code.token(b"C", np.arange(first, first + family.count, dtype=np.int32))
        yield from code.records([*head, *_NlExpressions(family, nl, code).monomials()], family.count)
        first += family.count
    yield from _objective(nl, code)
    if start is not None:
        yield from code.records(code.token(b"x", problem.n_columns))
        parts = code.token(b"", np.arange(problem.n_columns, dtype=np.int32), start[nl.order])
        yield from code.records(parts, problem.n_columns)
    yield from _limits(nl, code)
    yield from _bounds(nl, code)
    yield from _jacobian(nl, code, *gradient)


def _head(nl: NlOrder, code: TextForm, costs: int) -> bytes:
    """The first ten lines. costs: entries of G."""
    problem, count = nl.problem, np.bincount(nl.group, minlength=9)
    nlvb, nlvc, only = int(count[:2].sum()), int(count[:4].sum()), int(count[4:6].sum())
    equations = sum(family.count for family in nl.rows if family.family.sense == "==")
    entries = sum(family.count * len(_entries(family)) for family in nl.rows)
    rows = (name_length(problem.instance, row.family.tag, row.family.over) for row in nl.rows)
    columns = (name_length(problem.instance, block.name, block.over) for block in problem.blocks.values())
    lines = [
        b"%b4 1 1 0 %d" % (code.letter, stamp_option(problem.stamp)),
        b" %d %d 1 0 %d" % (problem.n_columns, problem.n_rows, equations),
        b" %d %d" % (sum(family.count for family in nl.nonlinear_rows), bool(nl.nonlinear_objective)),
        b" 0 0",
        b" %d %d %d" % (nlvc, nlvc + only if only else nlvb, nlvb),
        b" 0 0 %d 1" % code.arithmetic,
        b" %d %d %d %d %d" % tuple(int(count[group]) for group in (7, 8, 1, 3, 5)),
        b" %d %d" % (entries, costs),
        b" %d %d" % (max([len(OBJECTIVE), *rows]), max(columns)),
        b" 0 0 0 0 0",
    ]
    return b"\n".join(lines) + b"\n"


def _objective(nl: NlOrder, code: TextForm) -> Iterator[bytes]:
    families = nl.nonlinear_objective
    yield from code.records(code.token(b"O", 0, 0))
    summands = sum(family.count for family in families)
    if not summands:
        yield from code.records(code.constant(0.0))
    elif summands > 1:
        yield from code.records(code.sum(summands))
    for family in families:
        yield from code.records(_NlExpressions(family, nl, code).expression(family.family.body), family.count)


class _NlExpressions(PrefixLanguage):
    """Expressions of a family in a form of the file."""

    def __init__(self, family: PlacedFamily, nl: NlOrder, code: TextForm) -> None:
        super().__init__(family)
        self._nl = nl
        self._code = code

    def number(self, values: Floats | float) -> Pieces:
        """A number."""
        return self._code.constant(values)

    def column(self, symbol: Symbol) -> Pieces:
        """A column, by its place in the file."""
        return self._code.token(b"v", self._nl.places(self.family, symbol))

    def node(self, operator: Operator, parts: list[Pieces]) -> Pieces:
        """An operator with its operands; a product is one of pairs, and a sum of two has its own operator."""
        inside, code = [piece for part in parts for piece in part], self._code
        if operator == "sum":
            return [*code.sum(len(parts)), *inside]
        if operator == "product":
            return [
                *(piece for part in parts[:-1] for piece in (*code.token(b"o", MULTIPLY), *part)),
                *parts[-1],
            ]
        if operator == "square":
            return [*code.token(b"o", POWER), *inside, *code.constant(2.0)]
        return [*code.token(b"o", NEGATE if operator == "negative" else COSINE), *inside]

    def monomials(self) -> Pieces:
        """The nonlinear terms of a row; 0 without any."""
        terms = [
            self.node("product", [self.number(coefficient(term)), *map(self.column, term.symbols)])
            for term in nonlinear_terms(self.family)
        ]
        return self.join("sum", terms) if terms else self.number(0.0)


def _limits(nl: NlOrder, code: TextForm) -> Iterator[bytes]:
    if not nl.rows:
        return
    yield from code.records(code.token(b"r"))
    for family in nl.rows:
        kind = {">=": b"2", "<=": b"1", "==": b"4"}[family.family.sense]
        yield from code.records(code.token(kind, family.limit), family.count)


_BOUND: Final = np.array([{"lower": 2, "upper": 1, "free": 3}.get(kind, 0) for kind in BOUND_KINDS])
"""The digit before the bounds of a column, by their kind."""


def _bounds(nl: NlOrder, code: TextForm) -> Iterator[bytes]:
    """Bounds in file order, one stretch of one block and of equal digits after the other."""
    yield from code.records(code.token(b"b"))
    for block, run in nl.stretches:
        inside = nl.order[run] - block.offset
        digits = _BOUND[bound_kinds(block)[inside]]
        for part in equal_runs(digits):
            lower, upper = block.lower[inside[part]], block.upper[inside[part]]
            digit = int(digits[part.start])
            ends = {0: (lower, upper), 1: (upper,), 2: (lower,), 3: ()}[digit]
            yield from code.records(code.token(b"%d" % digit, *ends), len(lower))


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


def _jacobian(nl: NlOrder, code: TextForm, place: Ints, costs: Floats) -> Iterator[bytes]:
    problem = nl.problem
    rows = [(family, _entries(family)) for family in nl.rows]
    if rows:
        count = np.zeros(problem.n_columns, dtype=np.int32)
        for family, entries in rows:
            for symbol, _ in entries:
                block, inside = family.block(symbol), family.inside(symbol)
                count[block.slice] += 1 if inside is None else np.bincount(inside, minlength=block.count)
        yield from code.records(code.token(b"k", problem.n_columns - 1))
        yield from code.records(
            code.token(b"", np.cumsum(count[nl.order])[:-1].astype(np.int32)), problem.n_columns - 1
        )
    first = 0
    for family, entries in rows:
        parts = code.token(b"J", np.arange(first, first + family.count, dtype=np.int32), len(entries))
        for symbol, value in entries:
            parts += code.token(b"", nl.places(family, symbol), np.asarray(value, dtype=np.float64))
        yield from code.records(parts, family.count)
        first += family.count
    if len(place):
        yield from code.records(code.token(b"G", 0, len(place)))
        yield from code.records(code.token(b"", place, costs), len(place))
