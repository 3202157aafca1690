"""BARON's own format, for polynomials up to degree 4: it has no trigonometric functions (B1).

    // comment
    BINARY_VARIABLES p1_00_00_u;             then INTEGER_VARIABLES, VARIABLES (free by default) (B2)
    VARIABLES ONE_1a2b3c4d5e6, ...;          fixed to 1, in no term: BARON's results repeat the stamp
    LOWER_BOUNDS{                            every finite bound, except those of binaries
    alpha_00_00: 0;
    }
    UPPER_BOUNDS{ ... }
    EQUATIONS c14_00_00_u, ...;
    c14_00_00_u: s_00_00_u - alpha_00_00 ... >= 0;    constants on the right (B4)
    OBJ: minimize
     + 2*((alpha_00_00 - ...)^2 + ...)       as declared, one summand per line; (-1) in brackets (B6)
    STARTING_POINT{ ... }

Our names fit: a letter first, at most 15 characters (B3). BARON's results name its columns, in the order of
its own sections, and no rows (B5). There are no OPTIONS, because these belong to the user. B-numbers:
docs/format-rules.md; sections and grammar: BARON's user manual, section 4.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from ...models.formulations.families import Block, Monomial, PlacedFamily
from ...models.formulations.problem import Problem
from ...models.instance.domain import Floats
from ..writing.canonical import CanonicalForm, ColumnKind, coefficient
from ..writing.expressions import InfixLanguage, wrap_lines
from ..writing.names import Names
from ..writing.records import Piece, TaggedWords, render, signed_texts, words
from .gams import GamsExpressions, name_list

WIDTH = 160
"""Approximate length of lines."""


def generate(form: CanonicalForm, header: list[str], *, start: Floats | None = None) -> Iterator[bytes]:
    """The bytes of the .bar file, block by block. header: lines of comment. start: a point (columns,)."""
    problem, names = form.problem, form.names
    for line in header:
        yield f"// {line}\n".encode()
    yield from _variables(form)
    for title, low in ((b"LOWER", True), (b"UPPER", False)):
        yield title + b"_BOUNDS{\n"
        for block in problem.blocks.values():
            if form.kind(block) != "binary":
                yield from _bounds(block, names, low=low)
        yield form.one + b": 1;\n}\n"
    if problem.rows:
        lists = [(names.row(family), family.count) for family in problem.rows]
        yield from name_list(b"EQUATIONS", lists)
    for family in problem.rows:
        yield from _rows(family, names)
    yield from _objective(problem, names)
    if start is not None:
        yield from _start(form, start)


_KEYWORDS: Final[dict[ColumnKind, bytes]] = {
    "binary": b"BINARY_VARIABLES",
    "integer": b"INTEGER_VARIABLES",
    "continuous": b"VARIABLES\n  %b,",  # of the column fixed to 1, which is in no block
}


def _variables(form: CanonicalForm) -> Iterator[bytes]:
    for kind, keyword in _KEYWORDS.items():
        blocks = form.blocks(kind)
        if blocks:
            lists = [(form.names.of(block), block.count) for block in blocks]
            yield from name_list(keyword.replace(b"%b", form.one), lists)


def _bounds(block: Block, names: Names, *, low: bool) -> Iterator[bytes]:
    values = block.lower if low else block.upper
    at = np.nonzero(np.isfinite(values))[0]
    yield from _assignments(names.of(block).at(at), values[at])


def _assignments(name: TaggedWords, values: Floats) -> Iterator[bytes]:
    if len(values):
        yield from render([name, b": ", words(values), b";\n"], len(values))


def _rows(family: PlacedFamily, names: Names) -> Iterator[bytes]:
    terms = [_monomial(term, names) for term in (*family.of_degree(1), *family.of_degree(2))]
    sense = f" {family.family.sense} ".encode()
    parts = [names.row(family), b":", *(piece for term in terms for piece in term), sense]
    yield from render([*parts, words(family.limit), b";\n"], family.count)


def _monomial(term: Monomial, names: Names) -> list[Piece]:
    """A signed term of a row, without a coefficient of 1."""
    assert term.degree in {1, 2}  # no declaration has other rows
    lead: list[Piece] = [b" ", words(coefficient(term), signed_texts), b"*"]
    if np.ndim(term.coefficient) == 0 and abs(term.coefficient) == 1:
        lead = [b" + " if term.coefficient == 1 else b" - "]
    first, *further = (names.at(term.family, symbol) for symbol in term.symbols)
    return [*lead, first, *(piece for name in further for piece in (b"*", name))]


class _BaronExpressions(GamsExpressions):
    """The language of one family: scalar GAMS with other powers."""

    power = InfixLanguage.power


def _objective(problem: Problem, names: Names) -> Iterator[bytes]:
    yield b"OBJ: minimize\n" if problem.objective else b"OBJ: minimize\n  0\n"
    for family in problem.objective:
        terms = _BaronExpressions(family, names).summands(family.family.body)
        yield from render([*wrap_lines(terms, WIDTH), b"\n"], family.count)
    yield b";\n"


def _start(form: CanonicalForm, start: Floats) -> Iterator[bytes]:
    yield b"STARTING_POINT{\n"
    for block in form.problem.blocks.values():
        if block.count:
            yield from _assignments(form.names.of(block), start[block.slice])
    yield form.one + b": 1;\n}\n"
