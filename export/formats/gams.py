"""GAMS, as in instance libraries: one variable per column, one equation per row, our names.

    Variables objvar;                        a free scalar (G10); obj.. objvar =e= one summand per line (G6)
    Variables alpha_00_00, ...;              Binary only with bounds [0, 1], else Integer; no line of a list
                                             starts with `*`, which would make it a comment (G6)
    c14_00_00_u.. s_00_00_u =g= ...;         sqr(x) and products, never x**3 (G1); (-1) in brackets (G2, G3)
    alpha_00_00.lo = 0; alpha_00_00.up = 1.57;   of every column (G7), -inf and +inf (G12), .fx where equal
    alpha_00_00.l = 0.3;                     the start
    solve m using minlp minimizing objvar;   the type follows from the model's content (G9)
    $ifThen set RESULTS ... $endIf           with `--RESULTS=x.csv` the answer as lines name,value

Every expression stays in its declared form: squares of sums are not expanded, nothing is lifted, cos(pi p) is
a cosine. Numbers are shortest round trip, and `$offDigit` is not used, because it drops digits (G8). No
`$include`, no `$call`, and `put` only behind the switch RESULTS, because NEOS refuses them (G19).

The CSV starts with model_status, solver_status (GAMS's numbers: 1 optimal, 2 locally optimal, 8 integer
solution, 4, 5, 10 infeasible, ...; 1 normal completion, 2 iterations, 3 time, ...) and objective; then all
columns in order. Values have 16 digits, the most that put writes (nr=2, nd=15, nw=24: R7), with a blank in
place of a minus. Without a solution they are the start, so check the status first. The same holds for a
column in no term, which is not in GAMS's model (G11).

G-numbers: docs/format-rules.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from ...models.formulations.expressions import Expression, Factor, Symbol
from ...models.formulations.families import PlacedFamily
from ...models.formulations.problem import Problem
from ...models.instance.domain import Floats
from ...templates import stream
from ..writing.canonical import CanonicalForm
from ..writing.expressions import InfixLanguage, is_free_of_columns, wrap_lines
from ..writing.names import Names
from ..writing.records import (
    Piece,
    TaggedWords,
    Texts,
    Words,
    bound_texts,
    check_coefficients,
    number_text,
    number_texts,
    render,
    word_table,
    words,
)
from ..writing.records import signed_texts as with_sign

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
"""GAMS's model types by our classes."""

SENSES: Final = {">=": b" =g= ", "<=": b" =l= ", "==": b" =e= "}

WIDTH: Final = 160
"""Approximate length of lines."""


def generate(form: CanonicalForm, header: list[str], *, start: Floats | None = None) -> Iterator[bytes]:
    """The bytes of the GAMS file, block by block. header: lines of comment. start: a point (columns,)."""
    problem, names = form.problem, form.names
    blocks = {
        "variables": _variables(form),
        "equations": _equations(problem, names),
        "objective": _objective(problem, names),
        "rows": _rows(problem, names),
        "bounds": _bounds(form),
        "start": () if start is None else _start(problem, names, start),
        "results": _results(problem, names),
    }
    objective = None if start is None else number_text(problem.objective_value(start))
    yield from stream(
        "models/gams.gms.j2",
        blocks,
        header=header,
        stamp=problem.stamp,
        model_type=MODEL_TYPES[problem.problem_class],
        start=objective,
    )


def bracketed_texts(values: Floats) -> Texts:
    """Numbers, in brackets if negative: `3`, `(-0.5)`."""
    texts = number_texts(values)
    return np.where(values < 0, np.strings.add(np.strings.add(b"(", texts), b")"), texts)


class GamsExpressions(InfixLanguage):
    """GAMS's language for one family: symbols are column names, data are numbers, one per record."""

    def __init__(self, family: PlacedFamily, names: Names) -> None:
        self._family = family
        self._names = names

    def symbol(self, symbol: Symbol) -> Piece:
        """A column's name at each element."""
        return self._names.at(self._family, symbol)

    def is_data(self, expression: Factor) -> bool:
        """Whether it holds no column."""
        return is_free_of_columns(self._family, expression)

    def constant(self, expression: Expression, *, signed: bool) -> Piece:
        """One number per element."""
        return _data_words(self._family.data(expression), signed=signed)

    def coefficient(self, expression: Expression, *, signed: bool) -> Piece:
        """One number per element; raises UnsupportedByFormatError for an extreme one."""
        values = self._family.data(expression)
        check_coefficients(values, f"family {self._family.family.tag}")
        return _data_words(values, signed=signed)

    def power(self, base: list[Piece], exponent: int) -> list[Piece]:
        """A power in a form that GAMS evaluates for bases of any sign (G1)."""
        return [b"sqr(", *base, b")"] if exponent == 2 else [b"power(", *base, f",{exponent})".encode()]


def _data_words(values: Floats | float, *, signed: bool) -> Piece:
    return words(values, with_sign if signed else bracketed_texts)


def name_list(keyword: bytes, lists: list[tuple[TaggedWords, int]]) -> Iterator[bytes]:
    """A statement that declares names as one wrapped list. lists: the names, with their numbers."""
    per_line = WIDTH // (max(name.width for name, _ in lists) + 2)
    total = sum(count for _, count in lists)
    yield keyword + b"\n  "
    start = 0
    for name, count in lists:
        place = np.arange(start + 1, start + count + 1)
        separator = np.where(place == total, 2, place % per_line == 0)
        yield from render([name, Words(word_table([b", ", b",\n  ", b";\n"]), separator)], count)
        start += count


KEYWORDS: Final = {"continuous": b"Variables", "binary": b"Binary Variables", "integer": b"Integer Variables"}


def _variables(form: CanonicalForm) -> Iterator[bytes]:
    for block in form.problem.blocks.values():
        if block.count:
            lists = [(form.names.of(block), block.count)]
            yield from name_list(KEYWORDS[form.kind(block)], lists)


def _equations(problem: Problem, names: Names) -> Iterator[bytes]:
    if problem.rows:
        lists = [(names.row(family), family.count) for family in problem.rows]
        yield from name_list(b"Equations", lists)


def _objective(problem: Problem, names: Names) -> Iterator[bytes]:
    """The terms of the objective, one line per element (more if it is long); 0 without any."""
    if not problem.objective:
        yield b"  0\n"
    for family in problem.objective:
        terms = GamsExpressions(family, names).summands(family.family.body)
        yield from render([*wrap_lines(terms, WIDTH), b"\n"], family.count)


def _rows(problem: Problem, names: Names) -> Iterator[bytes]:
    for family in problem.rows:
        language, relation = GamsExpressions(family, names), family.family.relation
        left, right = language.expression(relation.left), language.expression(relation.right)
        parts: list[Piece] = [names.row(family), b".. ", *left, SENSES[family.family.sense], *right, b";\n"]
        yield from render(parts, family.count)


def _bounds(form: CanonicalForm) -> Iterator[bytes]:
    for group in (group for block in form.problem.blocks.values() for group in form.bounds(block)):
        name, lower, upper = (
            group.names,
            words(group.lower, bound_texts),
            words(group.upper, bound_texts),
        )
        parts: list[Piece] = [name, b".lo = ", lower, b"; ", name, b".up = ", upper, b";\n"]
        if group.kind == "fixed":
            parts = [name, b".fx = ", lower, b";\n"]
        yield from render(parts, len(group.lower))


def _start(problem: Problem, names: Names, start: Floats) -> Iterator[bytes]:
    for block in problem.blocks.values():
        level = words(start[block.slice])
        yield from render([names.of(block), b".l = ", level, b";\n"], block.count)


def _results(problem: Problem, names: Names) -> Iterator[bytes]:
    for block in problem.blocks.values():
        name = names.of(block)
        yield from render([b"put '", name, b",' ", name, b".l:0 /;\n"], block.count)
