"""A reader of scalar GAMS models, after the GAMS User's Guide.

It knows scalar variables and equations, options, definitions, assignments to attributes, one model, one solve
and `put`; the dollar control options `$offListing` and `$ifThen set`; and nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from algebraic import ARITHMETIC, Arithmetic, Column, Expression, Model, Row, WrongTextError, parsed, power
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
  | FILE NAME "/" QUOTED "/" -> file
  | PUT NAME -> select
  | PUT item+ -> put
  | PUTCLOSE NAME -> close
setting: NAME "=" (NUMBER | NAME)
infinite: [PLUS | MINUS] INF
?item: QUOTED -> text | NAME "." NAME (":" NUMBER)* -> attribute | "/" -> end_of_line
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
FILE.2: /files?\b/i
PUT.2: /put\b/i
PUTCLOSE.2: /putclose\b/i
INF.2: /inf\b/i
RELATION: /=[gle]=/i
QUOTED: /'[^'\n]*'|"[^"\n]*"/
NAME: /[a-z][a-z0-9_]*/i
"""

LONGEST_NAME = 63
LONGEST_LINE = 80_000
_RESERVED = """
abort acronym acronyms alias all and assign binary break card continue diag display do else elseif
endfor endif endloop endwhile eps eq equation equations execute execute_load execute_unload file files
for free function functions ge gt if imp inf integer le loop lt maximizing minimizing model models na ne
negative no nonnegative not option options or ord parameter parameters positive prod put putclear
putclose puthd putpage puttitle puttl repeat sameas sand scalar scalars semicont semiint set sets
singleton smax smin solve sor sos1 sos2 sum system table tables then undf until using variable variables
while xor yes abs arctan ceil cos errorf exp floor log log10 log2 max min mod normal pi power round sign
sin sqr sqrt tan trunc uniform
"""
RESERVED = frozenset(_RESERVED.split())
"""Words that name no symbol of a user: those of the language, and its functions."""

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
    """A model with its type, its options, and the lines that a results file would have.

    start: the level of the objective variable. unstated: bounds that are the defaults of GAMS. In the lines,
    values are `<symbol.attribute>` with the format at that point.
    """

    type: str = ""
    start: float | None = None
    unstated: set[str] = field(default_factory=set)
    options: dict[str, str] = field(default_factory=dict)
    results: list[str] = field(default_factory=list)


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

    def text(self, items: list[Token]) -> str:
        return items[0][1:-1]

    def attribute(self, items: list[Token]) -> tuple[str, ...]:
        return tuple(str(item).lower() for item in items)

    def end_of_line(self, _: list[Any]) -> str:
        return "\n"

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


def read(text: str, **defined: str) -> GamsModel:
    """The model that a text hands to the solver; `defined` as by `--NAME=value` on the command line."""
    return _Reader().run(parsed(_parser(), _Statements(), _without_controls(text, defined)))


def _without_controls(text: str, defined: dict[str, str]) -> str:
    """The statements without comments; lines that a dollar control option leaves out are empty."""
    lines, taken = [], [True]
    for number, line in enumerate(text.splitlines(), 1):
        if len(line) > LONGEST_LINE:
            raise WrongTextError(f"line {number} has {len(line)} characters")
        words = line.lower().split()
        if line.startswith("$"):
            match words:
                case ["$offlisting"]:
                    pass
                case ["$ifthen", "set", name]:
                    taken.append(name.upper() in defined)
                case ["$endif"] if len(taken) > 1:
                    taken.pop()
                case _:
                    raise WrongTextError(f"line {number}: {line}")
        for name, value in defined.items():
            line = line.replace(f"%{name}%", value)  # noqa: PLW2901
        lines.append(line if all(taken) and not line.startswith(("*", "$")) else "")
    if len(taken) > 1:
        raise WrongTextError("$ifThen without $endIf")
    return "\n".join(lines)


class _Reader:
    """The symbols of a program, in the order in which its statements are executed."""

    def __init__(self) -> None:
        self.model = GamsModel()
        self.symbols: dict[str, str] = {}
        self.undefined: set[str] = set()
        self.formats: dict[str, str] = {}
        self.line = ""
        self.stream = ""
        self.solved: GamsModel | None = None

    def run(self, statements: list[tuple[str, list[Any]]]) -> GamsModel:
        for name, parts in statements:
            getattr(self, f"_{name}")(*parts)
        if self.solved is None:
            raise WrongTextError("nothing is solved")
        if self.stream:
            raise WrongTextError(f"{self.stream} is not closed")
        return self.solved

    def _declare(self, names: list[str], kind: str) -> list[str]:
        for name in map(str.lower, names):
            if name in self.symbols:
                raise WrongTextError(f"{name} is declared twice")
            if name in RESERVED or len(name) > LONGEST_NAME:
                raise WrongTextError(f"{name} cannot be a name")
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
        if self.symbols.get(name.lower()) == "file":
            self.formats[attribute.lower()] = f"{number:g}"
            return
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

    def _file(self, _: Token, name: str, __: str) -> None:
        self._declare([name], "file")

    def _select(self, _: Token, name: str) -> None:
        self.stream = self._expect(name, "file")

    def _put(self, _: Token, *items: Any) -> None:
        if not self.stream:
            raise WrongTextError("put without a file")
        for item in items:
            if item == "\n":
                self.model.results.append(self.line)
                self.line = ""
            elif isinstance(item, str):
                self.line += item
            else:
                name, attribute, *digits = item
                if name not in self.symbols:
                    raise WrongTextError(f"{name} is not declared")
                formats = "".join(f" {key}={value}" for key, value in sorted(self.formats.items()))
                self.line += f"<{name}.{attribute}{':'.join(['', *digits])}{formats}>"

    def _close(self, _: Token, name: str) -> None:
        if self.stream != self._expect(name, "file"):
            raise WrongTextError(f"{name} is not open")
        self.stream = ""
