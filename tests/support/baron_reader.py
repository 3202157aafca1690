"""A reader of BARON's own format, after section 4 of the BARON user manual.

Sections have one order. What the manual leaves open is refused: a minus before a power, a power of a power,
constants on the left side of an equation, and whole variables without bounds.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cache
from typing import Any

import numpy as np
from algebraic import (
    ARITHMETIC,
    Arithmetic,
    Column,
    Expression,
    Model,
    Row,
    WrongTextError,
    number_of,
    parsed,
    power,
)
from lark import Lark

GRAMMAR = r"""
start: binary integer positive free lower upper equations "OBJ" ":" "minimize" expression ";" starting
binary: ["BINARY_VARIABLES" names ";"]
integer: ["INTEGER_VARIABLES" names ";"]
positive: ["POSITIVE_VARIABLES" names ";"]
free: ["VARIABLES" names ";"]
lower: ["LOWER_BOUNDS" numbers]
upper: ["UPPER_BOUNDS" numbers]
equations: ["EQUATIONS" names ";" definition+]
starting: ["STARTING_POINT" numbers]
numbers: "{" entry+ "}"
entry: NAME ":" signed ";"
definition: NAME ":" expression RELATION signed ";"
lead: atom (TIMES factor)*
?power: atom | atom "^" EXPONENT -> raised
?atom: NUMBER -> number | NAME -> symbol | "(" expression ")"
EXPONENT: /\d+/
RELATION: "==" | "<=" | ">="
NAME: /[a-z]\w*/i
"""

LONGEST_NAME = 15

BOUNDS = (
    ("binary", 0.0, 1.0),
    ("integer", np.nan, np.nan),
    ("continuous", 0.0, np.inf),
    ("continuous", -np.inf, np.inf),
)
"""Kind and default bounds of the variables of each section, in their order."""


class _Sections(Arithmetic):
    """The parts of the sections, in their order."""

    def raised(self, items: list[Any]) -> Expression:
        base, exponent = items
        return power(base, int(exponent))

    def entry(self, items: list[Any]) -> tuple[str, float]:
        return str(items[0]), items[1]

    def equations(self, items: list[Any]) -> tuple[list[str], list[Any]]:
        names, *definitions = items
        return names or [], list(filter(None, definitions))

    def _optional(self, items: list[Any]) -> list[Any]:
        return items[0] or []

    binary = integer = positive = free = lower = upper = starting = _optional
    numbers = definition = start = list


@cache
def _parser() -> Lark:
    return Lark(GRAMMAR + ARITHMETIC, parser="lalr")


def read(text: str) -> Model:
    """The model of a .bar file."""
    *kinds, lower, upper, (names, definitions), objective, start = parsed(
        _parser(), _Sections(), re.sub(r"//.*", "", text)
    )
    model = Model()
    for section, bounds in zip(kinds, BOUNDS, strict=True):
        for name in section:
            _check_name(name, model.columns)
            model.columns[name] = Column(*bounds)
    for attribute, entries in (("lower", lower), ("upper", upper), ("level", start)):
        seen: set[str] = set()
        for name, number in entries:
            if name not in model.columns or name in seen:
                raise WrongTextError(f"the {attribute} of {name}: not a column, or stated twice")
            seen.add(name)
            setattr(model.columns[name], attribute, number)
    for name in names:
        _check_name(name, [*model.columns, *model.rows])
        model.rows[name] = None
    if [name for name, *_ in definitions] != names:
        raise WrongTextError("the equations are not those declared, in their order")
    for name, left, relation, right in definitions:
        model.check_names(left, name)
        if left.value(dict.fromkeys(left.names, 0.0)) != 0:
            raise WrongTextError(f"{name} has a constant on the left side")
        model.rows[str(name)] = Row(left, str(relation), number_of(right))
    model.objective = model.check_names(objective, "OBJ")
    return model


def _check_name(name: str, others: Iterable[str]) -> None:
    if len(name) > LONGEST_NAME or name.lower() in map(str.lower, others):
        raise WrongTextError(f"{name} is too long, or stands for two things")
