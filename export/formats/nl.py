"""AMPL .nl, text and binary, in the subset that the AMPL Solver Library, SCIP and CasADi read alike.

The order of columns and rows is that of `writing.nl_layout`. Header, line by line (docs/format-rules.md):

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
import sympy as sp
from numpy.typing import NDArray

from ...models.formulations.families import Monomial, PlacedFamily
from ...models.formulations.names import name_length
from ...models.instance.grid import Floats, Ints
from ..writing.canonical import Canonical, coefficient
from ..writing.expressions import is_data, split
from ..writing.names import OBJECTIVE
from ..writing.nl_layout import Layout, nonlinear_terms, runs
from ..writing.records import (
    Decimals,
    Part,
    Piece,
    Pieces,
    Raw,
    check_coefficients,
    render,
    scalar_when_constant,
    words,
)
from ..writing.stamps import stamp_option

__all__ = ["Layout", "generate"]

ADD, MULTIPLY, POWER, NEGATE, COSINE, SUM = 0, 2, 5, 16, 46, 54
_FUNCTIONS: Final = {sp.cos: COSINE}


Numbers = NDArray[Any] | int | float


class Text:
    """The text form: each token on its own line, its numbers apart by blanks."""

    letter, arithmetic = b"g", 0
    padded = True

    def number(self, value: Numbers) -> bytes | Part:
        """A number within a token, decimal if it is whole by its type."""
        if isinstance(value, int):
            return str(value).encode()
        values = np.asarray(value)
        return Decimals(values) if values.dtype.kind == "i" else words(values)

    def token(self, name: bytes, *numbers: Numbers) -> list[Piece]:
        """A letter with numbers, numbers alone, or a digit with numbers, which then stand apart from it."""
        parts: list[Piece] = [name] if name else []
        for place, each in enumerate(numbers):
            parts += [b" "] if place or name.isdigit() else []
            parts.append(self.number(each))
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


class Binary(Text):
    """The binary form: one letter, then little-endian int32 and float64."""

    letter, arithmetic = b"b", 1
    padded = False

    def number(self, value: Numbers) -> bytes | Part:
        """A number within a token, of four bytes if it is whole by its type."""
        if isinstance(value, int):
            return value.to_bytes(4, "little", signed=True)
        values = np.asarray(value)
        values = values.astype("<i4" if values.dtype.kind == "i" else "<f8")
        return Raw(values) if values.ndim else values.tobytes()

    def token(self, name: bytes, *numbers: Numbers) -> list[Piece]:
        """A letter or a digit, if any, and numbers."""
        parts: list[Piece] = [name] if name else []
        return parts + [self.number(value) for value in numbers]


def generate(
    form: Canonical, _header: Sequence[str] = (), *, binary: bool = False, start: Floats | None = None
) -> Iterator[bytes]:
    """The bytes of the .nl file, which holds no comments. start: a point (columns,) for the segment x."""
    problem, layout, code = form.problem, form.layout, Binary() if binary else Text()
    yield _counts(layout, code)
    first = 0
    for family in layout.rows:
        body = _sum(
            code, [_monomial(layout, code, term) for term in nonlinear_terms(family)]
        ) or code.constant(0.0)
        head = code.token(b"C", np.arange(first, first + family.count, dtype=np.int32))
        yield from code.records([*head, *body], family.count)
        first += family.count
    yield from _objective(layout, code)
    if start is not None:
        yield from code.records(code.token(b"x", problem.n_columns))
        parts = code.token(b"", np.arange(problem.n_columns, dtype=np.int32), start[layout.order])
        yield from code.records(parts, problem.n_columns)
    yield from _limits(layout, code)
    yield from _bounds(layout, code)
    yield from _jacobian(layout, code)


def _counts(layout: Layout, code: Text) -> bytes:
    problem, count = layout.problem, np.bincount(layout.group, minlength=9)
    nlvb, nlvc, only = int(count[:2].sum()), int(count[:4].sum()), int(count[4:6].sum())
    equations = sum(family.count for family in layout.rows if family.family.sense == "==")
    entries = sum(family.count * len(_entries(family)) for family in layout.rows)
    rows = (name_length(problem.instance, row.family.tag, row.family.over) for row in layout.rows)
    columns = (name_length(problem.instance, block.name, block.over) for block in problem.blocks.values())
    lines = [
        b"%b4 1 1 0 %d" % (code.letter, stamp_option(problem.stamp)),
        b" %d %d 1 0 %d" % (problem.n_columns, problem.n_rows, equations),
        b" %d %d" % (sum(family.count for family in layout.nonlinear_rows), bool(layout.nonlinear_objective)),
        b" 0 0",
        b" %d %d %d" % (nlvc, nlvc + only if only else nlvb, nlvb),
        b" 0 0 %d 1" % code.arithmetic,
        b" %d %d %d %d %d" % tuple(int(count[group]) for group in (7, 8, 1, 3, 5)),
        b" %d %d" % (entries, len(_gradient(layout)[0])),
        b" %d %d" % (max([len(OBJECTIVE), *rows]), max(columns)),
        b" 0 0 0 0 0",
    ]
    return b"\n".join(lines) + b"\n"


def _objective(layout: Layout, code: Text) -> Iterator[bytes]:
    families = layout.nonlinear_objective
    yield from code.records(code.token(b"O", 0, 0))
    summands = sum(family.count for family in families)
    if not summands:
        yield from code.records(code.constant(0.0))
    elif summands > 1:
        yield from code.records(code.sum(summands))
    for family in families:
        yield from code.records(_tree(layout, code, family, family.family.body), family.count)


def _tree(layout: Layout, code: Text, family: PlacedFamily, expression: sp.Expr) -> Pieces:
    """The expression in prefix notation; parts free of columns become one number."""
    if is_data(family, expression):
        return code.constant(family.data(expression))
    if expression.is_Symbol:
        return code.token(b"v", layout.places(family, expression))
    if expression.is_Add or expression.is_Mul:
        return _chain(layout, code, family, expression)
    if expression.is_Pow:
        return [
            *code.token(b"o", POWER),
            *_tree(layout, code, family, expression.base),
            *code.constant(float(expression.exp)),
        ]
    return [*code.token(b"o", _FUNCTIONS[expression.func]), *_tree(layout, code, family, expression.args[0])]


def _chain(layout: Layout, code: Text, family: PlacedFamily, expression: sp.Expr) -> Pieces:
    """A sum or a product, its parts free of columns joined into one number in front."""
    data, others = split(family, expression)
    rest = [_tree(layout, code, family, part) for part in others]
    if expression.is_Add:
        return _sum(code, ([] if data is None else [code.constant(family.data(data))]) + rest)
    parts = list(rest[-1])
    for factor in reversed(rest[:-1]):
        parts = [*code.token(b"o", MULTIPLY), *factor, *parts]
    if data is None:
        return parts
    if data == -1:
        return [*code.token(b"o", NEGATE), *parts]
    return [*code.token(b"o", MULTIPLY), *code.constant(family.data(data)), *parts]


def _sum(code: Text, summands: list[Pieces]) -> Pieces:
    flat = [part for summand in summands for part in summand]
    if len(summands) < 2:
        return flat
    return [*code.sum(len(summands)), *flat]


def _monomial(layout: Layout, code: Text, term: Monomial) -> Pieces:
    parts: list[Any] = [*code.token(b"o", MULTIPLY), *code.constant(coefficient(term))]
    *others, last = (layout.places(term.family, symbol) for symbol in term.symbols)
    for factor in others:
        parts += [*code.token(b"o", MULTIPLY), *code.token(b"v", factor)]
    return [*parts, *code.token(b"v", last)]


def _limits(layout: Layout, code: Text) -> Iterator[bytes]:
    if not layout.rows:
        return
    yield from code.records(code.token(b"r"))
    for family in layout.rows:
        kind = {">=": b"2", "<=": b"1", "==": b"4"}[family.family.sense]
        yield from code.records(code.token(kind, scalar_when_constant(family.limit)), family.count)


def _bounds(layout: Layout, code: Text) -> Iterator[bytes]:
    """Bounds in file order, one stretch of one block and of equal kind after the other."""
    yield from code.records(code.token(b"b"))
    for block, run in layout.stretches:
        inside = layout.order[run] - block.offset
        lower, upper = block.lower[inside], block.upper[inside]
        kind = np.select(
            [np.isfinite(lower) & np.isfinite(upper), np.isfinite(upper), np.isfinite(lower)], [0, 1, 2], 3
        )
        for part in runs(kind):
            low, high = scalar_when_constant(lower[part]), scalar_when_constant(upper[part])
            values = {0: (low, high), 1: (high,), 2: (low,), 3: ()}[int(kind[part.start])]
            yield from code.records(code.token(b"%d" % kind[part.start], *values), part.stop - part.start)


def _entries(family: PlacedFamily) -> list[tuple[sp.Symbol, Floats | float]]:
    """Symbols and coefficients of a row in J: linear terms, and 0 for columns only in nonlinear ones."""
    linear = {term.symbols[0]: coefficient(term) for term in family.of_degree(1)}
    return list((linear | {s: 0.0 for s in family.variables if s not in linear}).items())


def _gradient(layout: Layout) -> tuple[Ints, Floats]:
    """Places and coefficients of G: costs of linear terms, and 0 for columns of nonlinear ones."""
    problem = layout.problem
    costs = np.zeros(problem.n_columns)
    for family in problem.objective:
        if family.degree <= 1:
            for term in family.of_degree(1):
                np.add.at(costs, term.factors[0], term.coefficient)
    check_coefficients(costs, "the objective")
    place = np.nonzero(((costs != 0) | layout.in_objective)[layout.order])[0].astype(np.int32)
    return place, costs[layout.order[place]]


def _jacobian(layout: Layout, code: Text) -> Iterator[bytes]:
    problem = layout.problem
    rows = [(family, _entries(family)) for family in layout.rows]
    if rows:
        count = np.zeros(problem.n_columns, dtype=np.int32)
        for family, entries in rows:
            for symbol, _ in entries:
                block, inside = family.block(symbol), family.inside(symbol)
                count[block.slice] += 1 if inside is None else np.bincount(inside, minlength=block.count)
        yield from code.records(code.token(b"k", problem.n_columns - 1))
        yield from code.records(
            code.token(b"", np.cumsum(count[layout.order])[:-1].astype(np.int32)), problem.n_columns - 1
        )
    first = 0
    for family, entries in rows:
        parts = code.token(b"J", np.arange(first, first + family.count, dtype=np.int32), len(entries))
        for symbol, value in entries:
            parts += code.token(b"", layout.places(family, symbol), np.asarray(value, dtype=np.float64))
        yield from code.records(parts, family.count)
        first += family.count
    place, costs = _gradient(layout)
    if len(place):
        yield from code.records(code.token(b"G", 0, len(place)))
        yield from code.records(code.token(b"", place, costs), len(place))
