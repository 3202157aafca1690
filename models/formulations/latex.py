"""LaTeX of a formulation, derived from its declaration."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

import sympy as sp

from .declaration import Family, Formulation
from .symbols import LATEX, SLOTS, IndexSet, Variable, w, w_beta, w_strokes

_SUM: Final[dict[IndexSet, str]] = {
    "pixels": r"\sum_{i \in I}",
    "strokes": r"\sum_{i \in S_c}",
    "pairs": r"\sum_{(i,j) \in E}",
    "cycles": r"\sum_{c \in C}",
}
_FOR: Final[dict[IndexSet, str]] = {
    "pixels": r"i \in I",
    "strokes": r"i \in S_c",
    "pairs": r"(i,j) \in E",
    "cycles": r"c \in C",
}
_WEIGHTS: Final = (w_strokes, w_beta, w)
_SENSE: Final = {">=": r"\ge", "<=": r"\le", "==": "="}


def expression(value: sp.Expr) -> str:
    """An expression in the paper's notation."""
    return str(sp.latex(value, symbol_names=LATEX, fold_frac_powers=True))


def latex(formulation: Formulation) -> str:
    """The whole model as one `aligned` environment: objective, rows with their equation numbers, domains."""
    variables = map(formulation.variable, formulation.variables)
    domains = [f"& {domain(variable, formulation)} && {_FOR[variable.over]}" for variable in variables]
    return aligned([*objective_and_rows(formulation), *domains])


def aligned(lines: Iterable[str]) -> str:
    """Lines as one environment."""
    return "\\begin{aligned}\n" + " \\\\\n".join(lines) + "\n\\end{aligned}"


def objective_and_rows(formulation: Formulation) -> list[str]:
    """A line per term of the objective, and per row or two rows that bound the same expression."""
    terms = [
        f"& {'+' if place else ''} {_SUM[family.over]} {_summand(family)}"
        for place, family in enumerate(formulation.objective)
    ]
    lines = [r"\min\ " + terms[0], *(rf"\quad {term}" for term in terms[1:])]
    rows = list(formulation.rows)
    while rows:
        first = rows.pop(0)
        both = _two_rows(first, rows[0]) if rows else ""
        papers = list(dict.fromkeys([first.paper, *([rows.pop(0).paper] if both else [])]))
        label = rf"\quad \text{{{', '.join(papers)}}}"
        lines.append(f"& {both or _row(first)} && {_FOR[first.over]} {label}")
    return lines


def domain(variable: Variable, formulation: Formulation) -> str:
    """The domain of a variable."""
    name, lower, upper = (expression(e) for e in (_symbol_of(variable), variable.lower, variable.upper))
    if variable.integer and not formulation.options.relax:
        between = [] if variable.upper - variable.lower == 1 else [r"\ldots"]
        return rf"{name} \in \{{{', '.join([lower, *between, upper])}\}}"
    if variable.lower == -sp.oo:
        return rf"{name} \in \mathbb{{R}}"
    if variable.upper == sp.oo:
        return rf"{name} \ge {lower}"
    return rf"{lower} \le {name} \le {upper}"


def _symbol_of(variable: Variable) -> sp.Symbol:
    """The symbol that denotes the variable itself."""
    return next(symbol for symbol, slot in SLOTS[variable.over].items() if slot == (variable.name, "itself"))


def _summand(family: Family) -> str:
    """A term of the objective: its weights first, a sum in brackets."""
    value = family.expression
    if value.is_Add:
        return rf"\Bigl[ {expression(value)} \Bigr]"
    weights, rest = value.as_independent(*(value.free_symbols - set(_WEIGHTS)))
    first = [LATEX[symbol] for symbol in _WEIGHTS if symbol in weights.free_symbols]
    number, _ = weights.as_coeff_Mul()
    return r" \, ".join([*first, expression(number * rest)])


def _row(family: Family) -> str:
    relation = family.expression
    return f"{expression(relation.lhs)} {_SENSE[family.sense]} {expression(relation.rhs)}"


def _two_rows(first: Family, second: Family) -> str:
    """Both bounds of an expression, or an expression above a value and its negative; else empty."""
    one, two = first.expression, second.expression
    if (one.lhs, first.over) != (two.lhs, second.over):
        return ""
    if {first.sense, second.sense} == {">=", "<="}:
        least, most = (one.rhs, two.rhs) if first.sense == ">=" else (two.rhs, one.rhs)
        return rf"{expression(least)} \le {expression(one.lhs)} \le {expression(most)}"
    if first.sense == second.sense == ">=" and sp.expand(one.rhs + two.rhs) == 0:
        value = rf"\left({expression(one.rhs)}\right)" if one.rhs.is_Add else expression(one.rhs)
        return rf"{expression(one.lhs)} \ge \pm {value}"
    return ""
