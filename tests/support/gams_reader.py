"""A reader of scalar GAMS models, after the GAMS User's Guide, and their comparison with a problem.

It knows scalar variables and equations, options, definitions, assignments to attributes, one model and one
solve; the dollar control options `$offListing` and `$ifThen set`; and nothing else. It knows nothing of our
writer, and refuses every text whose meaning is in doubt.
"""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from crossfield.export.programs.comparison import values_at
from crossfield.export.programs.model_content import Points
from crossfield.models.formulations.families import row_sides
from crossfield.models.formulations.problem import Problem

ACCURACY = 1e-12
"""Largest difference of values, relative to the largest one of the same expression at the points."""

NAME = r"[a-z]\w*+"
NUMBER = r"(?:\d++\.?+\d*+|\.\d++)(?:e[+-]?\d++)?+(?![\w.])"
NAMES = rf"{NAME}(?:\s*,\s*{NAME})*+"
SETTING = rf"{NAME}\s*=\s*(?:{NUMBER}|{NAME})"
STATEMENTS = {
    "variables": rf"(?:(free|binary|integer)\s+)?variables?\s+({NAMES})",
    "equations": rf"equations?\s+({NAMES})",
    "options": rf"options?\s+({SETTING}(?:\s*,\s*{SETTING})*)",
    "definition": rf"({NAME})\s*\.\.(.+)=([gle])=(.+)",
    "assignment": rf"({NAME})\.(lo|up|fx|l)\s*=\s*(.+)",
    "model": rf"model\s+({NAME})\s*/\s*all\s*/",
    "solve": rf"solve\s+({NAME})\s+using\s+({NAME})\s+minimizing\s+({NAME})",
}
TYPES = {
    "lp": (1, False), "mip": (1, True), "qcp": (2, False), "miqcp": (2, True), "nlp": (np.inf, False),
    "minlp": (np.inf, True),
}  # fmt: skip
"""The largest degree of a model of each type, and whether it may have discrete variables."""
FUNCTIONS = {"sqr": np.square, "power": np.power, "cos": np.cos}


class WrongTextError(Exception):
    """The text is not in the language, or its meaning is in doubt."""


class Expression:
    """An expression: GAMS and Python agree on numbers, names, brackets and operators, none after another."""

    def __init__(self, text: str) -> None:
        word = rf"\s*+(?:{NUMBER}|{NAME}|[-+*/(),])"
        if not re.fullmatch(rf"(?:{word})++\s*+", text) or re.search(r"[-+*/]\s*[-+*/]", text):
            raise WrongTextError(text)
        try:
            self.tree = ast.parse(f"({text})", mode="eval")
        except SyntaxError as error:
            raise WrongTextError(text) from error
        self.degree = _degree(self.tree.body)
        self.names = {node.id for node in ast.walk(self.tree) if isinstance(node, ast.Name)} - {*FUNCTIONS}

    def at(self, values: dict[str, Any]) -> Any:
        """Its value at points."""
        return eval(compile(self.tree, "model", "eval"), {"__builtins__": {}} | FUNCTIONS, values)


def _degree(node: ast.expr) -> float:
    """The degree as written, infinite if it is no polynomial."""
    match node:
        case ast.Constant():
            return 0
        case ast.Name():
            return 1
        case ast.UnaryOp(operand=operand):
            return _degree(operand)
        case ast.BinOp(left, ast.Add() | ast.Sub(), right):
            return max(_degree(left), _degree(right))
        case ast.BinOp(left, ast.Mult(), right):
            return _degree(left) + _degree(right)
        case ast.BinOp(left, ast.Div(), right):
            return np.inf if _degree(right) else _degree(left)
        case ast.Call(ast.Name("sqr"), [base]):
            return 2 * _degree(base)
        case ast.Call(ast.Name("power"), [base, ast.Constant(int(exponent))]) if exponent > 0:
            return exponent * _degree(base)
        case ast.Call(ast.Name("cos"), [angle]):
            return np.inf if _degree(angle) else 0
    raise WrongTextError(ast.unparse(node))


@dataclass
class Column:
    """A column; bounds that are not stated are NaN, because defaults depend on the version."""

    kind: str
    lower: float = np.nan
    upper: float = np.nan
    level: float | None = None


@dataclass
class Model:
    """A model that is to be minimized, with its type and its options; start: of the objective variable.

    rows: left side, the letter of the relation, and right side.
    """

    columns: dict[str, Column] = field(default_factory=dict)
    rows: dict[str, tuple[Expression, str, Expression] | None] = field(default_factory=dict)
    objective: Expression | None = None
    type: str = ""
    start: float | None = None
    options: dict[str, str] = field(default_factory=dict)
    name: str = ""

    def check(self, condition: object, words: str) -> None:
        """Raise WrongTextError unless a condition holds."""
        if not condition:
            raise WrongTextError(words)

    def declare(self, names: str) -> list[str]:
        """The names of a list, all of them new."""
        listed = re.split(r"\s*,\s*", names)
        known = [*self.columns, *self.rows, *FUNCTIONS, *listed]
        self.check(len({*known}) == len(known) and not self.name, f"{names} are declared twice, or too late")
        return listed

    def variables(self, kind: str | None, names: str) -> None:
        self.columns |= {name: Column(kind or "free") for name in self.declare(names)}

    def equations(self, names: str) -> None:
        self.rows |= dict.fromkeys(self.declare(names))

    def options_(self, settings: str) -> None:
        self.options |= dict(re.split(r"\s*=\s*", setting) for setting in re.split(r"\s*,\s*", settings))

    def definition(self, name: str, left: str, relation: str, right: str) -> None:
        self.check(name in self.rows and self.rows[name] is None, f"{name} is unknown or defined twice")
        sides = Expression(left), Expression(right)
        self.check(sides[0].names | sides[1].names <= {*self.columns}, f"{name} has names of no column")
        self.rows[name] = sides[0], relation, sides[1]

    def assignment(self, name: str, attribute: str, text: str) -> None:
        self.check(name in self.columns, f"{name} is no variable")
        column, number = self.columns[name], re.fullmatch(r"[-+]?inf", text) or Expression(text)
        value = float(text if isinstance(number, re.Match) else number.at({}))
        if attribute in {"lo", "fx"}:
            column.lower = value
        if attribute in {"up", "fx"}:
            column.upper = value
        if attribute in {"l", "fx"}:
            column.level = value

    def model(self, name: str) -> None:
        (self.name,) = self.declare(name)
        self.check(all(self.rows.values()), "an equation is not defined")

    def solve(self, name: str, kind: str, objective: str) -> None:
        self.check(name == self.name and objective in self.columns and not self.type, "the solve is wrong")
        goal = self.columns.pop(objective)
        self.check(goal.kind == "free" and np.isnan([goal.lower, goal.upper]).all(), f"{objective} is bound")
        uses = [row for row, (left, _, right) in self.rows.items() if objective in left.names | right.names]
        self.check(len(uses) == 1, f"the objective variable is in {len(uses)} equations")
        left, relation, right = self.rows.pop(uses[0])
        is_alone = isinstance(left.tree.body, ast.Name) and relation == "e" and objective not in right.names
        self.check(is_alone, f"{uses[0]} does not define the objective variable alone")
        self.objective, self.type, self.start = right, kind, goal.level
        degree, discrete = TYPES[kind]
        sides = [right, *(side for left, _, right in self.rows.values() for side in (left, right))]
        self.check(max(side.degree for side in sides) <= degree, f"the degree is not that of {kind}")
        self.check(discrete or {column.kind for column in self.columns.values()} <= {"free"}, f"not a {kind}")


def read(text: str) -> Model:
    """The model that a text hands to the solver; raises WrongTextError."""
    model = Model()
    *statements, rest = _without_controls(text.lower()).split(";")
    model.check(not rest.strip(), f"no statement ends with {rest!r}")
    for statement in map(str.strip, statements):
        model.check(not model.type, f"{statement} follows the solve")
        for name, pattern in STATEMENTS.items():
            if match := re.fullmatch(pattern, statement, re.DOTALL):
                getattr(model, "options_" if name == "options" else name)(*match.groups())
                break
        else:
            raise WrongTextError(statement)
    model.check(model.type, "nothing is solved")
    return model


def _without_controls(text: str) -> str:
    """The statements without comments; lines between `$ifThen set` and `$endIf` are empty: nothing is set."""
    lines, taken = [], True
    for line in text.splitlines():
        match line.split():
            case ["$ifthen", "set", _] if taken:
                taken = False
            case ["$endif"] if not taken:
                taken = True
            case ["$offlisting"]:
                pass
            case _ if line.startswith("$"):
                raise WrongTextError(line)
        lines.append(line if taken and not line.startswith(("*", "$")) else "")
    return "\n".join(lines)


def difference(model: Model, problem: Problem, points: Points, start: Any) -> str:
    """The first difference between a model and a problem; empty if there is none."""
    rows = problem.to_arrays().row_names.tolist()
    for kind, names, expected in (("column", model.columns, points.names), ("row", model.rows, rows)):
        for name in sorted({*names} ^ {*expected}):
            return f"a {kind} {name} too {'many' if name in names else 'few'}"
    columns = [model.columns[name] for name in points.names]
    for kind, mine, expected in (
        ("whole", [column.kind != "free" for column in columns], problem.integer),
        ("lower", [column.lower for column in columns], problem.lower),
        ("upper", [column.upper for column in columns], problem.upper),
        ("start", [column.level for column in columns], start),
    ):
        for name, value, right in zip(points.names, mine, expected.tolist(), strict=True):
            if value != right:
                return f"{kind} of {name} is {value} instead of {right}"
    values = dict(zip(points.names, points.values.T, strict=True))
    objective, activities = values_at(problem, points.values)
    if not _is_close(model.objective.at(values), objective):
        return "the objective"
    for name, activity, lower, upper in zip(rows, activities.T, *row_sides(problem.rows), strict=True):
        left, relation, right = model.rows[name]
        sense = "e" if lower == upper else "g" if np.isfinite(lower) else "l"
        turn = 1 if relation == sense else -1
        same = _is_close(
            turn * (left.at(values) - right.at(values)), activity - (upper if sense == "l" else lower)
        )
        if not same or (relation == "e") != (sense == "e"):
            return f"the row {name}"
    return ""


def _is_close(values: Any, expected: Any) -> bool:
    return bool(np.allclose(values, expected, 0, ACCURACY * np.abs(expected).max()))
