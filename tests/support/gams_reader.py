"""A reader of scalar GAMS models, after the GAMS User's Guide.

It knows scalar variables and equations, options, definitions, assignments to attributes, one model and one
solve; the dollar control options `$offListing` and `$ifThen set`; and nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass, field
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
    parse_text,
    power,
)
from lark import Lark, Token

GRAMMAR = r"""
start: (statement ";")*
?statement: [KIND] VARIABLES names -> variables
  | EQUATIONS names -> equations
  | OPTION setting ("," setting)* -> options
  | NAME ".." expression RELATION expression -> definition
  | NAME "." NAME "=" (expression | infinite) -> assignment
  | MODEL NAME "/" ALL "/" -> model
  | SOLVE NAME USING NAME MINIMIZING NAME -> solve
setting: NAME "=" (NUMBER | NAME)
infinite: [PLUS | MINUS] INF
?lead: term
?power: atom ("**" atom)*
?atom: NUMBER -> number | NAME -> symbol | "(" expression ")"
  | NAME "(" expression ("," expression)* ")" -> call
KIND.2: /(free|positive|nonnegative|binary|integer)\b/i
VARIABLES.2: /variables?\b/i
EQUATIONS.2: /equations?\b/i
OPTION.2: /options?\b/i
MODEL.2: /models?\b/i
ALL.2: /all\b/i
SOLVE.2: /solve\b/i
USING.2: /using\b/i
MINIMIZING.2: /minimizing\b/i
INF.2: /inf\b/i
RELATION: /=[gle]=/i
NAME: /[a-z][a-z0-9_]*/i
"""

BOUNDS = {
    None: ("continuous", -np.inf, np.inf),
    "free": ("continuous", -np.inf, np.inf),
    "positive": ("continuous", 0.0, np.inf),
    "nonnegative": ("continuous", 0.0, np.inf),
    "binary": ("binary", 0.0, 1.0),
    "integer": ("integer", 0.0, np.nan),  # 100 in old versions, inf in others
}
"""Kind and default bounds by type of variable."""

SENSES = {"=g=": ">=", "=l=": "<=", "=e=": "=="}

TYPES = {
    "lp": (1, False),
    "mip": (1, True),
    "qcp": (2, False),
    "miqcp": (2, True),
    "nlp": (np.inf, False),
    "minlp": (np.inf, True),
}
"""The largest degree of a model of each type, and whether it may have discrete variables."""


@dataclass
class GamsModel(Model):
    """A model with its type and its options.

    start: the level of the objective variable. unstated: bounds that are the defaults of GAMS.
    """

    type: str = ""
    start: float | None = None
    unstated: set[str] = field(default_factory=set)
    options: dict[str, str] = field(default_factory=dict)


class _Statements(Arithmetic):
    """Each statement as its name and its parts; names in lower case: GAMS ignores case."""

    def symbol(self, items: list[Token]) -> Expression:
        return super().symbol([items[0].lower()])

    def power(self, items: list[Expression]) -> Expression:
        """Powers from left to right, defined for positive bases only."""
        base, *exponents = items
        for exponent in exponents:
            base = _exponential(base, exponent)
        return base

    def call(self, items: list[Any]) -> Expression:
        function, argument, *more = items
        match function.lower(), more:
            case "sqr", []:
                return power(argument, 2)
            case "power", [exponent] if float(exponent.constant).is_integer() and exponent.constant > 0:
                return power(argument, int(exponent.constant))
            case "cos", []:
                return Expression(lambda v: np.cos(argument.value(v)), _bent(argument), argument.names)
        raise WrongTextError(f"the function {function} with {1 + len(more)} arguments")

    def infinite(self, items: list[Any]) -> float:
        return -np.inf if items[0] == "-" else np.inf

    def setting(self, items: list[Token]) -> tuple[str, str]:
        return items[0].lower(), str(items[1])

    def __default__(self, data: str, children: list[Any], meta: Any) -> Any:
        return list(children) if data == "start" else (str(data), children)


def _exponential(base: Expression, exponent: Expression) -> Expression:
    def value(values: Any) -> Any:
        number = base.value(values)
        return np.where(number > 0, np.abs(number) ** exponent.value(values), np.nan)

    return Expression(value, max(_bent(base), _bent(exponent)), base.names | exponent.names)


def _bent(expression: Expression) -> float:
    """The degree of a function of an expression that is not a polynomial of it."""
    return np.inf if expression.names else 0


@cache
def _parser() -> Lark:
    return Lark(GRAMMAR + ARITHMETIC, parser="lalr")


def read(text: str) -> GamsModel:
    """The model that a text hands to the solver."""
    return _Reader().run(parse_text(_parser(), _Statements(), _without_controls(text)))


def _without_controls(text: str) -> str:
    """The statements without comments; lines between `$ifThen set` and `$endIf` are empty: nothing is set."""
    lines, taken = [], True
    for number, line in enumerate(text.splitlines(), 1):
        match line.lower().split():
            case ["$ifthen", "set", _] if taken:
                taken = False
            case ["$endif"] if not taken:
                taken = True
            case ["$offlisting"]:
                pass
            case _ if line.startswith("$"):
                raise WrongTextError(f"line {number}: {line}")
        lines.append(line if taken and not line.startswith(("*", "$")) else "")
    return "\n".join(lines)


class _Reader:
    """The symbols of a program, in the order in which its statements are executed."""

    def __init__(self) -> None:
        self.model = GamsModel()
        self.symbols: dict[str, str] = {}
        self.undefined: set[str] = set()
        self.solved: GamsModel | None = None

    def run(self, statements: list[tuple[str, list[Any]]]) -> GamsModel:
        for name, parts in statements:
            getattr(self, f"_{name}")(*parts)
        if self.solved is None:
            raise WrongTextError("nothing is solved")
        return self.solved

    def _declare(self, names: list[str], kind: str) -> list[str]:
        for name in map(str.lower, names):
            if name in self.symbols:
                raise WrongTextError(f"{name} is declared twice")
            self.symbols[name] = kind
        return list(map(str.lower, names))

    def _expect(self, name: str, kind: str) -> str:
        if self.symbols.get(name.lower()) != kind:
            raise WrongTextError(f"{name} is not a {kind}")
        return name.lower()

    def _variables(self, kind: Token | None, _: Token, names: list[str]) -> None:
        bounds = BOUNDS[kind and kind.lower()]
        for name in self._declare(names, "variable"):
            self.model.columns[name] = Column(*bounds)
            self.model.unstated |= {f"{name}.lo", f"{name}.up"}

    def _equations(self, _: Token, names: list[str]) -> None:
        self.undefined |= set(self._declare(names, "equation"))
        self.model.rows |= dict.fromkeys(map(str.lower, names))

    def _options(self, _: Token, *settings: tuple[str, str]) -> None:
        self.model.options |= dict(settings)

    def _definition(self, name: str, left: Expression, relation: str, right: Expression) -> None:
        if self._expect(name, "equation") not in self.undefined:
            raise WrongTextError(f"{name} is defined twice")
        self.undefined.remove(name.lower())
        for side in (left, right):
            self.model.check_names(side, name)
        self.model.rows[name.lower()] = Row(left, SENSES[relation.lower()], right)

    def _assignment(self, name: str, attribute: str, value: Expression | float) -> None:
        number = value.constant if isinstance(value, Expression) else value
        column = self.model.columns[self._expect(name, "variable")]
        if self.solved is not None:
            raise WrongTextError(f"{name}.{attribute} changes after the model is solved")
        match attribute.lower():
            case "lo":
                column.lower = number
            case "up":
                column.upper = number
            case "fx":
                column.lower = column.upper = column.level = number
                self.model.unstated -= {f"{name.lower()}.lo", f"{name.lower()}.up"}
            case "l":
                column.level = number
            case _:
                raise WrongTextError(f"the attribute {attribute}")
        self.model.unstated.discard(f"{name}.{attribute}".lower())

    def _model(self, _: Token, name: str, __: Token) -> None:
        self._declare([name], "model")
        if self.undefined:
            raise WrongTextError(f"{min(self.undefined)} is not defined")

    def _solve(self, _: Token, name: str, __: Token, kind: str, ___: Token, objective: str) -> None:
        self._expect(name, "model")
        objective = self._expect(objective, "variable")
        goal = self.model.columns.pop(objective)
        if (goal.kind, goal.lower, goal.upper) != BOUNDS["free"]:
            raise WrongTextError("the objective variable is not free")
        rows = self.model.rows.items()
        uses = [name for name, row in rows if objective in row.left.names | row.right.names]
        if len(uses) != 1:
            raise WrongTextError(f"the objective variable is in {len(uses)} equations")
        definition = self.model.rows.pop(uses[0])
        left, sense, right = definition.left, definition.sense, definition.right
        is_alone = left.names == {objective} and left.degree == 1 and left.value({objective: 0.5}) == 0.5
        if not is_alone or sense != "==" or objective in right.names:
            raise WrongTextError(f"{uses[0]} does not define the objective variable alone")
        self.model.unstated -= {f"{objective}.lo", f"{objective}.up"}
        self.model.objective, self.model.type = right, kind.lower()
        degree, discrete = TYPES.get(self.model.type, (-1, False))
        if self.model.degree > degree or (self.model.is_discrete and not discrete):
            raise WrongTextError(f"the model is not of the type {kind}")
        self.model.start = goal.level
        self.solved = self.model
