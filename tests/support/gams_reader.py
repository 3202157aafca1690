"""A reader of scalar GAMS models, after the GAMS User's Guide, and their comparison with a problem.

It knows scalar variables and equations, options, definitions, assignments to attributes, one model and one
solve; the dollar control options `$offListing` and `$ifThen set`; and nothing else. It knows nothing of our
writer, and refuses every text whose meaning is in doubt.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache, reduce
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
"""No operator follows another; a minus may begin an expression, before a term."""

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
    """A model that is to be minimized, with its type and its options.

    start: the level of the objective variable. unstated: bounds that are the defaults of GAMS.
    """

    columns: dict[str, Column] = field(default_factory=dict)
    rows: dict[str, Row] = field(default_factory=dict)
    objective: Expression | None = None
    type: str = ""
    start: float | None = None
    unstated: set[str] = field(default_factory=set)
    options: dict[str, str] = field(default_factory=dict)

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


class _Statements(Transformer):
    """Each statement as its name and its parts; names in lower case: GAMS ignores case."""

    def number(self, items: list[Token]) -> Expression:
        return number_of(float(items[0]))

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

    def symbol(self, items: list[Token]) -> Expression:
        name = items[0].lower()
        return Expression(lambda values: values[name], 1, frozenset([name]))

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
    return Lark(GRAMMAR, parser="lalr")


def _parse(text: str) -> Any:
    """The statements of a text; raises WrongTextError."""
    try:
        return _Statements().transform(_parser().parse(text))
    except UnexpectedInput as error:
        raise WrongTextError(f"line {error.line}: {error.get_context(text)}") from error
    except VisitError as error:
        if isinstance(error.orig_exc, WrongTextError):
            raise error.orig_exc from error
        raise


def read(text: str) -> Model:
    """The model that a text hands to the solver."""
    return _Reader().run(_parse(_without_controls(text)))


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
        self.model = Model()
        self.symbols: dict[str, str] = {}
        self.undefined: set[str] = set()
        self.solved: Model | None = None

    def run(self, statements: list[tuple[str, list[Any]]]) -> Model:
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
