"""OSiL, the XML format of COIN-OR's Optimization Services, for SCIP and OSSolverService.

    <variables numberOfVariables="7">
    <var name="alpha_00_00" type="C" lb="0" ub="1.57"/>            C, B, I; no attribute is left out (O1)
    <var name="ONE_1a2b3c4d5e6" type="C" lb="1" ub="1"/>           carries the stamp, and as cost the constant
    <objectives> <obj maxOrMin="min"> <coef idx="0">-1</coef>
    <constraints> <con name="c14_00_00_u" lb="0" ub="INF"/>        constants on the right
    <linearConstraintCoefficients> <start>, <colIdx>, <value>      row by row, one <el> each
    <quadraticCoefficients>
    <qTerm idx="-1" idxOne="0" idxTwo="0" coef="2"/>               not halved; -1 is the objective (O1, O2)
    <nonlinearExpressions> <nl idx="-1"> <sum> <product> ...       terms beyond quadratic, in one <nl> (O2)

Terms up to quadratic are coefficients; squares of sums and cos(pi p) beyond that keep their form.
Indices count from 0, in the order of our columns and rows. Counts precede the lists. The content of the file
is stated in <description>, not in comments.

Read in reader_osil.c of SCIP (github.com/scipopt/scip): a cost given twice is not added up but replaced, so
each stands once; `mult` of variables and rows is not taken, so each has its line; <sum> and <product> take
any number of arguments, <square> and <cos> one. O-numbers: docs/format-rules.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from typing import Final

import numpy as np

from ...models.formulations.expressions import Symbol
from ...models.formulations.families import Block, PlacedFamily
from ...models.formulations.problem import Problem
from ...models.instance.domain import Floats, Ints
from ..writing.canonical import CanonicalForm, coefficient
from ..writing.expressions import Operator, PrefixLanguage
from ..writing.names import OBJECTIVE, Names
from ..writing.records import (
    Decimals,
    Piece,
    Pieces,
    Texts,
    check_coefficients,
    number_text,
    number_texts,
    render,
    words,
)

_HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<osil xmlns="os.optimizationservices.org" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" \
xsi:schemaLocation="os.optimizationservices.org http://www.optimizationservices.org/schemas/2.0/OSiL.xsd">
<instanceHeader>
<name>{name}</name>
<description>{description}</description>
</instanceHeader>
<instanceData>
"""


def generate(form: CanonicalForm, header: list[str]) -> Iterator[bytes]:
    """The bytes of the OSiL file, block by block. header: lines that describe the content."""
    problem, names = form.problem, form.names
    description = escape("\n".join(header))
    yield _HEAD.format(name=escape(problem.instance.name), description=description).encode()
    yield f'<variables numberOfVariables="{problem.n_columns + 1}">\n'.encode()
    for block in problem.blocks.values():
        yield from _variables(block, names, _LETTER[form.kind(block)])
    yield b'<var name="%b" type="C" lb="1" ub="1"/>\n</variables>\n' % form.one
    yield from _objective(problem)
    yield f'<constraints numberOfConstraints="{problem.n_rows}">\n'.encode()
    for family in problem.rows:
        yield from _constraints(family, names)
    yield b"</constraints>\n"
    yield from _linear_rows(problem)
    yield from _quadratic(problem)
    yield from _nonlinear(problem)
    yield b"</instanceData>\n</osil>\n"


def infinity_texts(values: Floats) -> Texts:
    """Bounds: numbers, `-INF` or `INF`."""
    return np.where(np.isinf(values), np.where(values > 0, b"INF", b"-INF"), number_texts(values))


_LETTER: Final = {"continuous": "C", "binary": "B", "integer": "I"}


def _variables(block: Block, names: Names, kind: str) -> Iterator[bytes]:
    lower, upper = (words(end, infinity_texts) for end in (block.lower, block.upper))
    kind_lower = f'" type="{kind}" lb="'.encode()
    parts: Pieces = [b'<var name="', names.of(block), kind_lower, lower, b'" ub="', upper, b'"/>\n']
    yield from render(parts, block.count)


def _coefficients(problem: Problem, degree: int) -> tuple[Ints, Floats]:
    """Columns (k, degree), each set once, and coefficients (k,) of the objective's terms up to quadratic."""
    index, value = problem.merged_objective(degree, up_to=2)
    check_coefficients(value, "the objective")
    return index, value


def _objective(problem: Problem) -> Iterator[bytes]:
    index, cost = _coefficients(problem, 1)
    constant = float(problem.merged_objective(0)[1][0])
    if problem.objective_degree > 2:  # that of the terms up to quadratic, summed in their order
        held = (term for family in problem.objective if family.degree <= 2 for term in family.of_degree(0))
        sums = [np.broadcast_to(term.coefficient, (term.family.count,)) for term in held]
        constant = float(np.cumsum(np.concatenate([np.zeros(1), *sums]))[-1])
    yield b'<objectives numberOfObjectives="1">\n'
    size = f'numberOfObjCoef="{len(cost) + 1}"'
    yield f'<obj name="{OBJECTIVE.decode()}" maxOrMin="min" {size}>\n'.encode()
    yield from render([b'<coef idx="', Decimals(index[:, 0]), b'">', words(cost), b"</coef>\n"], len(cost))
    yield f'<coef idx="{problem.n_columns}">{number_text(constant)}</coef>\n</obj>\n</objectives>\n'.encode()


def _constraints(family: PlacedFamily, names: Names) -> Iterator[bytes]:
    limit = words(family.limit)
    lower: Piece = b"-INF" if family.family.sense == "<=" else limit
    upper: Piece = b"INF" if family.family.sense == ">=" else limit
    parts: Pieces = [b'<con name="', names.row(family), b'" lb="', lower, b'" ub="', upper, b'"/>\n']
    yield from render(parts, family.count)


def _linear_rows(problem: Problem) -> Iterator[bytes]:
    """The matrix row by row: the start of each row, then columns, then values."""
    if not problem.rows:
        return
    widths = [(family.count, len(family.of_degree(1))) for family in problem.rows]
    total = sum(count * width for count, width in widths)
    yield f'<linearConstraintCoefficients numberOfValues="{total}">\n<start>\n<el>0</el>\n'.encode()
    first = 0
    for count, width in widths:
        yield from render([b"<el>", Decimals(first + width * np.arange(1, count + 1)), b"</el>\n"], count)
        first += count * width
    yield b"</start>\n<colIdx>\n"
    for family in problem.rows:
        parts = [piece for term in family.of_degree(1) for piece in _element(Decimals(term.factors[0]))]
        yield from render(parts, family.count)
    yield b"</colIdx>\n<value>\n"
    for family in problem.rows:
        parts = [piece for term in family.of_degree(1) for piece in _element(words(coefficient(term)))]
        yield from render(parts, family.count)
    yield b"</value>\n</linearConstraintCoefficients>\n"


def _element(value: Piece) -> list[Piece]:
    return [b"<el>", value, b"</el>\n"]


def _quadratic(problem: Problem) -> Iterator[bytes]:
    """The products of objective and rows."""
    index, value = _coefficients(problem, 2)
    total = len(value) + sum(family.count * len(family.of_degree(2)) for family in problem.rows)
    if not total:
        return
    yield f'<quadraticCoefficients numberOfQuadraticTerms="{total}">\n'.encode()
    one, two = map(Decimals, index.T)
    yield from render(_product(b"-1", one, two, words(value)), len(value))
    first = 0
    for family in problem.rows:
        row = Decimals(np.arange(first, first + family.count))
        for term in family.of_degree(2):
            one, two = map(Decimals, term.factors)
            yield from render(_product(row, one, two, words(coefficient(term))), family.count)
        first += family.count
    yield b"</quadraticCoefficients>\n"


def _product(row: Piece, one: Piece, two: Piece, value: Piece) -> Pieces:
    return [b'<qTerm idx="', row, b'" idxOne="', one, b'" idxTwo="', two, b'" coef="', value, b'"/>\n']


def _nonlinear(problem: Problem) -> Iterator[bytes]:
    """The terms of the objective beyond quadratic, as one sum."""
    families = [family for family in problem.objective if family.degree > 2]
    assert all(family.degree <= 2 for family in problem.rows)  # no declaration has others
    if not families:
        return
    yield b'<nonlinearExpressions numberOfNonlinearExpressions="1">\n<nl idx="-1">\n<sum>\n'
    for family in families:
        yield from render([*_OsilExpressions(family).expression(family.family.body), b"\n"], family.count)
    yield b"</sum>\n</nl>\n</nonlinearExpressions>\n"


class _OsilExpressions(PrefixLanguage):
    """Expressions of a family as nodes."""

    def number(self, values: Floats | float) -> Pieces:
        """A number."""
        return [b'<number value="', words(values), b'"/>']

    def column(self, symbol: Symbol) -> Pieces:
        """A column, by its place."""
        return [b'<variable idx="', Decimals(self.family.column_of(symbol)), b'"/>']

    def node(self, operator: Operator, parts: list[Pieces]) -> Pieces:
        """An element with its operands inside."""
        if operator == "negative":
            return self.node("product", [self.number(-1.0), *parts])
        inside = [piece for part in parts for piece in part]
        return [f"<{operator}>".encode(), *inside, f"</{operator}>".encode()]
