"""AMPL .nl, text and binary, in the subset that the AMPL Solver Library, SCIP and CasADi read alike.

The order of columns and rows is that of `writing.nl_layout`. Header, line by line (docs/format-rules.md):

    g3 1 1 0                           b3 1 1 0 for binary; the options come back in the .sol
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

Counted while writing: columns (b), rows (C, r and J), costs (G) and coefficients of rows (J) other than 0,
places of columns in the objective's tree (O) and factors of the rows' products (C).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import sympy as sp

from ...models.formulations.families import Monomial, PlacedFamily
from ...models.formulations.names import name_length
from ...models.instance.grid import Floats, Ints
from ..writing.canonical import Canonical, coefficient
from ..writing.counting import Expected, check
from ..writing.expressions import is_data, split
from ..writing.names import OBJECTIVE
from ..writing.nl_layout import Layout, nonlinear_terms, runs
from ..writing.records import (
    Counted,
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

__all__ = ["Layout", "generate"]

ADD, MULTIPLY, POWER, NEGATE, COSINE, SUM = 0, 2, 5, 16, 46, 54
_FACTORS: Final = "factors of products in rows"
_FUNCTIONS: Final = {sp.cos: COSINE}


class Tokens:
    """Common base of both forms: `counts` of the content of one file."""

    def __init__(self) -> None:
        self.counts = Counter[str]()


class Text(Tokens):
    """Tokens of the text form, each on its own line."""

    letter = b"g"
    arith = 0
    padded = True

    def number(self, value: Floats | float) -> bytes | Part:
        """A number inside of a record."""
        return words(value)

    def segment(self, name: bytes, *numbers: int | Ints) -> Pieces:
        """The head of a segment: its letter and integers."""
        parts: list[Any] = [name]
        for place, value in enumerate(numbers):
            parts += [b" "] if place else []
            parts.append(_decimal(value))
        return [*parts, b"\n"]

    def entry(self, index: Ints, number: Piece) -> Pieces:
        """An index and a number."""
        return [Decimals(index), b" ", number, b"\n"]

    def integer(self, value: Ints) -> Pieces:
        """An integer of the segment k."""
        return [Decimals(value), b"\n"]

    def bound(self, code: int, *values: Floats | float) -> Pieces:
        """A line of the segments r and b."""
        return [str(code).encode(), *(part for value in values for part in (b" ", words(value))), b"\n"]

    def operator(self, code: int) -> Pieces:
        """An operator of fixed arity."""
        return [b"o%d\n" % code]

    def sum(self, count: int) -> Pieces:
        """The sum of three or more."""
        return [b"o%d\n%d\n" % (SUM, count)]

    def variable(self, index: Ints) -> Pieces:
        """A variable."""
        return [b"v", Decimals(index), b"\n"]

    def constant(self, value: Floats | float) -> Pieces:
        """A number."""
        return [b"n", words(value), b"\n"]


class Binary(Tokens):
    """Tokens of the binary form: one letter, then little-endian int32 and float64."""

    letter = b"b"
    arith = 1
    padded = False

    def number(self, value: Floats | float) -> bytes | Part:
        """A number inside of a record."""
        return _float64(value)

    def segment(self, name: bytes, *numbers: int | Ints) -> Pieces:
        """The head of a segment: its letter and integers."""
        return [name, *map(_int32, numbers)]

    def entry(self, index: Ints, number: Piece) -> Pieces:
        """An index and a number."""
        return [_int32(index), number]

    def integer(self, value: Ints) -> Pieces:
        """An integer of the segment k."""
        return [_int32(value)]

    def bound(self, code: int, *values: Floats | float) -> Pieces:
        """A record of the segments r and b."""
        return [str(code).encode(), *map(_float64, values)]

    def operator(self, code: int) -> Pieces:
        """An operator of fixed arity."""
        return [b"o", _int32(code)]

    def sum(self, count: int) -> Pieces:
        """The sum of three or more."""
        return [b"o", _int32(SUM), _int32(count)]

    def variable(self, index: Ints) -> Pieces:
        """A variable."""
        return [b"v", _int32(index)]

    def constant(self, value: Floats | float) -> Pieces:
        """A number."""
        return [b"n", _float64(value)]


Encoder = Text | Binary


def generate(form: Canonical, *, binary: bool = False, start: Floats | None = None) -> Iterator[bytes]:
    """The bytes of the .nl file. start: a point (columns,) for the segment x."""
    problem, layout, code = form.problem, form.layout, Binary() if binary else Text()
    yield _header(layout, code)
    first = 0
    for family in layout.rows:
        body = _sum(
            code, [_monomial(layout, code, term) for term in nonlinear_terms(family)]
        ) or code.constant(0.0)
        head = code.segment(b"C", np.arange(first, first + family.count, dtype=np.int32))
        yield from render([Counted(code.counts, "rows"), *head, *body], family.count, padded=code.padded)
        first += family.count
    yield from _objective(layout, code)
    if start is not None:
        yield from _once(code, code.segment(b"x", problem.n_columns))
        parts = code.entry(np.arange(problem.n_columns, dtype=np.int32), code.number(start[layout.order]))
        yield from render(parts, problem.n_columns, padded=code.padded)
    yield from _limits(layout, code)
    yield from _bounds(layout, code)
    yield from _jacobian(layout, code)
    expected = Expected(problem, degree=1)
    check(
        code.counts,
        dict.fromkeys(("rows", "rows with limits", "rows with coefficients"), expected.rows)
        | {
            "columns": expected.columns,
            "linear costs": expected.costs(noise=True),
            "columns in the objective's tree": expected.declared,
            "coefficients of rows": expected.nonzeros(1),
            _FACTORS: expected.factors,
        },
    )


def _header(layout: Layout, code: Encoder) -> bytes:
    problem, count = layout.problem, np.bincount(layout.group, minlength=9)
    nlvb, nlvc, only = int(count[:2].sum()), int(count[:4].sum()), int(count[4:6].sum())
    equations = sum(family.count for family in layout.rows if family.family.sense == "==")
    entries = sum(family.count * len(_entries(family)) for family in layout.rows)
    rows = (name_length(problem.instance, row.family.tag, row.family.over) for row in layout.rows)
    columns = (name_length(problem.instance, block.name, block.over) for block in problem.blocks.values())
    lines = [
        code.letter + b"3 1 1 0",
        b" %d %d 1 0 %d" % (problem.n_columns, problem.n_rows, equations),
        b" %d %d" % (sum(family.count for family in layout.nonlinear_rows), bool(layout.nonlinear_objective)),
        b" 0 0",
        b" %d %d %d" % (nlvc, nlvc + only if only else nlvb, nlvb),
        b" 0 0 %d 1" % code.arith,
        b" %d %d %d %d %d" % tuple(int(count[group]) for group in (7, 8, 1, 3, 5)),
        b" %d %d" % (entries, len(_gradient(layout)[0])),
        b" %d %d" % (max([len(OBJECTIVE), *rows]), max(columns)),
        b" 0 0 0 0 0",
    ]
    return b"\n".join(lines) + b"\n"


def _objective(layout: Layout, code: Encoder) -> Iterator[bytes]:
    families = layout.nonlinear_objective
    yield from _once(code, code.segment(b"O", 0, 0))
    summands = sum(family.count for family in families)
    if not summands:
        yield from _once(code, code.constant(0.0))
    elif summands > 1:
        yield from _once(code, code.operator(ADD) if summands == 2 else code.sum(summands))
    for family in families:
        yield from render(_tree(layout, code, family, family.family.body), family.count, padded=code.padded)


def _tree(layout: Layout, code: Encoder, family: PlacedFamily, expression: sp.Expr) -> Pieces:
    """The expression in prefix notation; parts free of columns become one number."""
    if is_data(family, expression):
        return code.constant(family.data(expression))
    if expression.is_Symbol:
        return _counted(code, "columns in the objective's tree", layout.places(family, expression))
    if expression.is_Add or expression.is_Mul:
        return _chain(layout, code, family, expression)
    if expression.is_Pow:
        return [
            *code.operator(POWER),
            *_tree(layout, code, family, expression.base),
            *code.constant(float(expression.exp)),
        ]
    return [*code.operator(_FUNCTIONS[expression.func]), *_tree(layout, code, family, expression.args[0])]


def _chain(layout: Layout, code: Encoder, family: PlacedFamily, expression: sp.Expr) -> Pieces:
    """A sum or a product, its parts free of columns joined into one number in front."""
    data, others = split(family, expression)
    rest = [_tree(layout, code, family, part) for part in others]
    if expression.is_Add:
        return _sum(code, ([] if data is None else [code.constant(family.data(data))]) + rest)
    parts = list(rest[-1])
    for factor in reversed(rest[:-1]):
        parts = [*code.operator(MULTIPLY), *factor, *parts]
    if data is None:
        return parts
    if data == -1:
        return [*code.operator(NEGATE), *parts]
    return [*code.operator(MULTIPLY), *code.constant(family.data(data)), *parts]


def _sum(code: Encoder, summands: list[Pieces]) -> Pieces:
    flat = [part for summand in summands for part in summand]
    if len(summands) < 2:
        return flat
    return [*(code.operator(ADD) if len(summands) == 2 else code.sum(len(summands))), *flat]


def _monomial(layout: Layout, code: Encoder, term: Monomial) -> Pieces:
    parts: list[Any] = [*code.operator(MULTIPLY), *code.constant(coefficient(term))]
    *others, last = (layout.places(term.family, symbol) for symbol in term.symbols)
    for factor in others:
        parts += [*code.operator(MULTIPLY), *_counted(code, _FACTORS, factor)]
    return [*parts, *_counted(code, _FACTORS, last)]


def _counted(code: Encoder, what: str, column: Ints) -> Pieces:
    """A variable, counted."""
    return [Counted(code.counts, what), *code.variable(column)]


def _limits(layout: Layout, code: Encoder) -> Iterator[bytes]:
    if not layout.rows:
        return
    yield from _once(code, code.segment(b"r"))
    for family in layout.rows:
        kind = {">=": 2, "<=": 1, "==": 4}[family.family.sense]
        bound = code.bound(kind, scalar_when_constant(family.limit))
        yield from render(
            [Counted(code.counts, "rows with limits"), *bound], family.count, padded=code.padded
        )


def _bounds(layout: Layout, code: Encoder) -> Iterator[bytes]:
    """Bounds in file order, one stretch of one block and of equal kind after the other."""
    yield from _once(code, code.segment(b"b"))
    for block, run in layout.stretches:
        inside = layout.order[run] - block.offset
        lower, upper = block.lower[inside], block.upper[inside]
        kind = np.select(
            [np.isfinite(lower) & np.isfinite(upper), np.isfinite(upper), np.isfinite(lower)], [0, 1, 2], 3
        )
        for part in runs(kind):
            low, high = scalar_when_constant(lower[part]), scalar_when_constant(upper[part])
            values = {0: (low, high), 1: (high,), 2: (low,), 3: ()}[int(kind[part.start])]
            bound = [Counted(code.counts, "columns"), *code.bound(int(kind[part.start]), *values)]
            yield from render(bound, part.stop - part.start, padded=code.padded)


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


def _jacobian(layout: Layout, code: Encoder) -> Iterator[bytes]:
    problem = layout.problem
    rows = [(family, _entries(family)) for family in layout.rows]
    if rows:
        count = np.zeros(problem.n_columns, dtype=np.int32)
        for family, entries in rows:
            for symbol, _ in entries:
                block, inside = family.block(symbol), family.inside(symbol)
                count[block.slice] += 1 if inside is None else np.bincount(inside, minlength=block.count)
        yield from _once(code, code.segment(b"k", problem.n_columns - 1))
        yield from render(
            code.integer(np.cumsum(count[layout.order])[:-1].astype(np.int32)),
            problem.n_columns - 1,
            padded=code.padded,
        )
    first = 0
    for family, entries in rows:
        head = code.segment(b"J", np.arange(first, first + family.count, dtype=np.int32), len(entries))
        parts = [Counted(code.counts, "rows with coefficients"), *head]
        for symbol, value in entries:
            number = Counted(code.counts, "coefficients of rows", code.number(value))
            parts += code.entry(layout.places(family, symbol), number)
        yield from render(parts, family.count, padded=code.padded)
        first += family.count
    place, costs = _gradient(layout)
    if len(place):
        yield from _once(code, code.segment(b"G", 0, len(place)))
        number = Counted(code.counts, "linear costs", code.number(costs))
        yield from render(code.entry(place, number), len(place), padded=code.padded)


def _once(code: Encoder, parts: Pieces) -> Iterator[bytes]:
    yield from render(parts, 1, padded=code.padded)


def _decimal(value: int | Ints) -> bytes | Decimals:
    return str(value).encode() if isinstance(value, int) else Decimals(value)


def _int32(value: int | Ints) -> bytes | Raw:
    if isinstance(value, int):
        return value.to_bytes(4, "little", signed=True)
    return Raw(value.astype("<i4"))


def _float64(value: Floats | float) -> bytes | Raw:
    if np.ndim(value) == 0:
        return np.asarray(value, dtype="<f8").tobytes()
    return Raw(np.asarray(value, dtype="<f8"))
