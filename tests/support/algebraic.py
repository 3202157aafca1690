"""Models as texts in algebraic languages state them, to be compared with a problem.

The readers of the languages share arithmetic with signs, products and quotients, and add their own powers,
functions and statements. They follow the manuals of the languages and know nothing of our writers. They
refuse every text whose meaning is in doubt.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import reduce
from typing import Any, NamedTuple

import numpy as np
from cases import names_of, points_of
from crossfield.models.formulations.names import column_names, row_names
from crossfield.models.formulations.problem import Problem
from crossfield.models.instance.domain import Floats
from lark import Lark, Token, Transformer
from lark.exceptions import UnexpectedInput, VisitError

ACCURACY = 1e-12
"""Largest difference of values, relative to the largest one of the same expression at the points."""

Values = Mapping[str, Any]

ARITHMETIC = r"""
expression: [PLUS] term ((PLUS | MINUS) term)* | MINUS lead ((PLUS | MINUS) term)*
term: factor (TIMES factor)*
?factor: power
names: NAME ("," NAME)*
PLUS: "+"
MINUS: "-"
TIMES: "*" | "/"
NUMBER: /(\d+\.?\d*|\.\d+)(e[+-]?\d+)?/i
%import common.WS
%ignore WS
"""
"""Rules that the grammars have in common, in which no operator follows another.

A grammar adds `power`, and `lead`, the term that may follow a minus at the start of an expression.
"""


class WrongTextError(Exception):
    """The text is not in the language, or its meaning is in doubt."""


class Expression(NamedTuple):
    """An expression: its value at points, its degree as written (inf if not a polynomial), its names."""

    value: Callable[[Values], Any]
    degree: float
    names: frozenset[str]

    @property
    def constant(self) -> float:
        """Its value where it has no names."""
        if self.names:
            raise WrongTextError(f"{min(self.names)} where a number belongs")
        return float(self.value({}))


class Arithmetic(Transformer):
    """Expressions of the rules in ARITHMETIC."""

    def number(self, items: list[Token]) -> Expression:
        return number_of(float(items[0]))

    def symbol(self, items: list[Token]) -> Expression:
        name = str(items[0])
        return Expression(lambda values: values[name], 1, frozenset([name]))

    def expression(self, items: list[Any]) -> Expression:
        terms = list(zip(items[::2], items[1::2], strict=True))
        parts = [(-1.0 if sign == "-" else 1.0, term.value) for sign, term in terms]
        return Expression(
            lambda values: sum(sign * part(values) for sign, part in parts),
            max(term.degree for _, term in terms),
            frozenset().union(*(term.names for _, term in terms)),
        )

    def names(self, items: list[Token]) -> list[str]:
        return [str(name) for name in items]

    def term(self, items: list[Any]) -> Expression:
        return reduce(self._multiplied, zip(items[1::2], items[2::2], strict=True), items[0])

    lead = term

    def _multiplied(self, left: Expression, step: tuple[Token, Expression]) -> Expression:
        operator, right = step
        names = left.names | right.names
        if operator == "*":
            return Expression(lambda v: left.value(v) * right.value(v), left.degree + right.degree, names)
        degree = np.inf if right.degree else left.degree
        return Expression(lambda v: left.value(v) / right.value(v), degree, names)


def number_of(number: float) -> Expression:
    """A number."""
    return Expression(lambda _: number, 0, frozenset())


def power(base: Expression, exponent: int) -> Expression:
    """A whole power, as a product."""
    factors = [base.value] * exponent
    return Expression(
        lambda values: reduce(np.multiply, (factor(values) for factor in factors)),
        base.degree * exponent,
        base.names,
    )


@dataclass
class Column:
    """A column: kind, bounds, and the start if there is one. Bounds that depend on a version are NaN."""

    kind: str
    lower: float
    upper: float
    level: float | None = None


@dataclass
class Row:
    """A row: two sides and a relation, one of `>=`, `<=` and `==`."""

    left: Expression
    sense: str
    right: Expression


@dataclass
class Model:
    """A model that is to be minimized."""

    columns: dict[str, Column] = field(default_factory=dict)
    rows: dict[str, Row] = field(default_factory=dict)
    objective: Expression | None = None

    @property
    def degree(self) -> float:
        """The largest degree of its expressions."""
        sides = [side for row in self.rows.values() for side in (row.left, row.right)]
        return max(side.degree for side in [*sides, self.objective])

    @property
    def is_discrete(self) -> bool:
        """Whether columns are whole numbers."""
        return any(column.kind != "continuous" for column in self.columns.values())

    def check_names(self, expression: Expression, place: str) -> Expression:
        """Return the expression; raises WrongTextError for a name that is no column."""
        for name in sorted(expression.names - set(self.columns)):
            raise WrongTextError(f"{place}: {name} is not declared")
        return expression


def parse_text(parser: Lark, transformer: Arithmetic, text: str) -> Any:
    """What the transformer makes of the text; raises WrongTextError."""
    try:
        return transformer.transform(parser.parse(text))
    except UnexpectedInput as error:
        raise WrongTextError(f"line {error.line}: {error.get_context(text)}") from error
    except VisitError as error:
        if isinstance(error.orig_exc, WrongTextError):
            raise error.orig_exc from error
        raise


def difference(model: Model, problem: Problem, start: Floats | None = None) -> str:
    """The first difference between a model and a problem; empty if there is none."""
    columns = names_of(column_names(problem.instance, problem.blocks))
    rows = names_of(row_names(problem.rows)) if problem.rows else []
    for kind, names, expected in (("column", model.columns, columns), ("row", model.rows, rows)):
        for name in sorted(set(names) ^ set(expected)):
            return f"a {kind} {name} too {'many' if name in names else 'few'}"
    read = [model.columns[name] for name in columns]
    levels = [] if start is None else [("start", [column.level for column in read], start)]
    for kind, mine, expected in [
        ("whole", [column.kind != "continuous" for column in read], problem.integer),
        ("lower", [column.lower for column in read], problem.lower),
        ("upper", [column.upper for column in read], problem.upper),
        *levels,
    ]:
        for name, value, right in zip(columns, mine, expected.tolist(), strict=True):
            if value != right:
                return f"{kind} of {name} is {value} instead of {right}"
    points = points_of(problem, 4)
    values = dict(zip(columns, points.T, strict=True))
    objective = [problem.objective_value(point) for point in points]
    return _value_difference("objective", model.objective.value(values), objective) or _row_difference(
        model, problem, points, values
    )


def _row_difference(model: Model, problem: Problem, points: Floats, values: Values) -> str:
    """The first row that differs, both turned to say `>=` or `==`."""
    names = iter(names_of(row_names(problem.rows)) if problem.rows else [])
    for family in problem.rows:
        sense = family.family.sense
        for expected in np.array([family.values(point) for point in points]).T:
            name = next(names)
            row = model.rows[name]
            if (row.sense == "==") != (sense == "=="):
                return f"{name} says {row.sense} instead of {sense}"
            mine = row.left.value(values) - row.right.value(values)
            turns = [-1.0 if relation == "<=" else 1.0 for relation in (row.sense, sense)]
            if wrong := _value_difference(name, turns[0] * mine, turns[1] * expected):
                return wrong
    return ""


def _value_difference(place: str, values: Any, expected: Any) -> str:
    values, expected = np.broadcast_to(values, np.shape(expected)), np.asarray(expected)
    wrong = ~(np.abs(values - expected) <= ACCURACY * np.abs(expected).max())
    return f"{place} is {values[wrong][0]!r} instead of {expected[wrong][0]!r}" if wrong.any() else ""
