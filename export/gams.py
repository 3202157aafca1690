"""GAMS, scalar layout, as instance libraries have it: one variable a column, one equation a row, under our own names.

    Variables objvar;                        the objective is a free scalar (G10), obj.. objvar =e= one summand a line (G6)
    Variables alpha_00_00, ...;              Binary only with bounds [0, 1], else Integer; lists are wrapped, no line starts
                                             with `*`, which would make it a comment (G6)
    c14_00_00_u.. s_00_00_u =g= ...;         sqr(x) and products, never x**3 (G1); negative numbers in brackets (G2, G3)
    alpha_00_00.lo = 0; alpha_00_00.up = 1.57;   both bounds of every column (G7), -inf and +inf (G12), .fx where equal
    alpha_00_00.l = 0.3;                     the start
    solve m using minlp minimizing objvar;   the type by what is in the model (G9)
    $ifThen set RESULTS ... $endIf           after `gams x.gms --RESULTS=x.csv`: the answer as lines name,value

Every expression stays in its declared form: squares of sums are not expanded, nothing is lifted, cos(pi p) is a cosine. Numbers are
shortest round trip, and `$offDigit` is not used, for it drops digits (G8). No `$include`, no `$call`, and `put` only behind
the switch RESULTS, because NEOS refuses them (G19).

The CSV starts with model_status, solver_status (GAMS's numbers: 1 optimal, 2 locally optimal, 8 integer solution, 4, 5, 10
infeasible, ...; 1 normal completion, 2 iterations, 3 time, ...) and objective; then all columns in order. Values have 16 digits,
which is what put gives (nr=2, nd=15, nw=24: formats.md, section 2), with a blank where a minus would stand. Without a solution they are
the start, so look at the status first; the same holds for a column in no term, which is not in GAMS's model (G11).

G-numbers: the project's notes on formats, section 1.5.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ..models.grid import Floats
from ..models.problem import Block, Bound, Problem
from ..templates import stream
from .algebra import Language, Piece, wrapped
from .lp import is_binary, scalar_when_constant
from .names import column_names, family_names, row_names
from .records import Bytes, Words, check_coefficients, number, render, table, words
from .records import signed as with_sign

MODEL_TYPES: Final = {
    "LP": "lp",
    "MILP": "mip",
    "QP": "qcp",
    "MIQP": "miqcp",
    "QCP": "qcp",
    "MIQCP": "miqcp",
    "NLP": "nlp",
    "MINLP": "minlp",
}
"""Our classes -> GAMS's model types."""

SENSES: Final = {">=": b" =g= ", "<=": b" =l= ", "==": b" =e= "}

WIDTH: Final = 160
"""Lines are broken about here."""


def generate(problem: Problem, header: list[str], *, start: Floats | None = None) -> Iterator[bytes]:
    """The bytes of the GAMS file in scalar layout, block by block.

    header: lines of comment, without the comment sign. start: values of all columns (columns,), written as levels.
    """
    names = Words(column_names(problem), None)
    blocks = {
        "variables": _variables(problem, names),
        "equations": _declared(b"Equations", row_names(problem)) if problem.rows else (),
        "objective": _objective(problem, names),
        "rows": _rows(problem, names),
        "bounds": _bounds(problem, names),
        "start": () if start is None else render([names, b".l = ", words(start), b";\n"], problem.columns),
        "results": render([b"put '", names, b",' ", names, b".l:0 /;\n"], problem.columns),
    }
    objective = None if start is None else number(problem.objective_value(start))
    yield from stream(
        "gams_scalar.gms.j2",
        blocks,
        header=header,
        model_type=MODEL_TYPES[problem.problem_class],
        start=objective,
    )


def power(base: list[Piece], exponent: int) -> list[Piece]:
    """A power as GAMS evaluates it for bases of any sign (G1)."""
    return [b"sqr(", *base, b")"] if exponent == 2 else [b"power(", *base, f",{exponent})".encode()]


def bracketed(value: float) -> str:
    """A number, in brackets when it is negative: `3`, `(-0.5)`."""
    return f"({number(value)})" if value < 0 else number(value)


class _Scalar(Language):
    """The language of one family: symbols are column names, data are numbers, one per record."""

    def __init__(self, family: Bound, names: Words) -> None:
        self._family = family
        self._names = names
        self._variables = set(family.variables)

    def symbol(self, symbol: sp.Symbol) -> Piece:
        return self._names.at(self._family.columns(symbol))

    def is_data(self, expression: sp.Expr) -> bool:
        return not expression.free_symbols & self._variables

    def constant(self, expression: sp.Expr, *, signed: bool) -> Piece:
        return _number_words(self._family.data(expression), signed=signed)

    def coefficient(self, expression: sp.Expr, *, signed: bool) -> Piece:
        values = self._family.data(expression)
        check_coefficients(values, f"family {self._family.family.tag}")
        return _number_words(values, signed=signed)

    def power(self, base: list[Piece], exponent: int) -> list[Piece]:
        return power(base, exponent)


def _number_words(values: Floats | float, *, signed: bool) -> Piece:
    given = values if isinstance(values, float) else scalar_when_constant(values)
    return words(given, with_sign if signed else bracketed)


def _declared(keyword: bytes, names: Bytes) -> Iterator[bytes]:
    """A statement that declares the names, as a wrapped list."""
    count, width = names.shape
    per_line = WIDTH // (width + 2)
    separator = np.zeros(count, dtype=np.uint8)
    separator[per_line - 1 :: per_line] = 1
    separator[-1] = 2
    yield keyword + b"\n  "
    yield from render([Words(names, None), Words(table([b", ", b",\n  ", b";\n"]), separator)], count)


def _variables(problem: Problem, names: Words) -> Iterator[bytes]:
    for block in problem.blocks.values():
        if block.count:
            yield from _declared(_keyword(block), names.table[block.columns])


def _keyword(block: Block) -> bytes:
    if not block.integer:
        return b"Variables"
    return b"Binary Variables" if is_binary(block) else b"Integer Variables"


def _objective(problem: Problem, names: Words) -> Iterator[bytes]:
    """The terms of the objective, one line an element (more when it is long)."""
    for family in problem.objective:
        terms = _Scalar(family, names).summands(family.family.expression)
        yield from render([*wrapped(terms, WIDTH, b"  "), b"\n"], family.count)


def _rows(problem: Problem, names: Words) -> Iterator[bytes]:
    for family in problem.rows:
        language, relation = _Scalar(family, names), family.family.expression
        left, right = language.expression(relation.lhs), language.expression(relation.rhs)
        parts = [
            Words(family_names(family), None),
            b".. ",
            *left,
            SENSES[family.family.sense],
            *right,
            b";\n",
        ]
        yield from render(parts, family.count)


def _bounds(problem: Problem, names: Words) -> Iterator[bytes]:
    for block in problem.blocks.values():
        fixed = block.lower == block.upper
        for chosen, suffixes in ((fixed, ("fx",)), (~fixed, ("lo", "up"))):
            at = np.nonzero(chosen)[0]
            yield from render(_bound_parts(block, names, at, suffixes), len(at))


def _bound_parts(block: Block, names: Words, at: NDArray[Any], suffixes: tuple[str, ...]) -> list[Piece]:
    parts: list[Piece] = []
    for suffix in suffixes:
        values = (block.upper if suffix == "up" else block.lower)[at]
        text = words(scalar_when_constant(values), bound) if len(at) else b""
        parts += [
            names.at(block.offset + at),
            f".{suffix} = ".encode(),
            text,
            b"; " if suffix == "lo" else b";\n",
        ]
    return parts


def bound(value: float) -> str:
    """A bound: a number, `-inf` or `+inf` (G12)."""
    return number(value) if np.isfinite(value) else ("+inf" if value > 0 else "-inf")
