"""LaTeX of a formulation, derived from its declaration."""

from __future__ import annotations

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
    terms = [
        f"& {'+' if place else ''} {_SUM[family.over]} {_summand(family)}"
        for place, family in enumerate(formulation.objective)
    ]
    lines = [r"\min\ " + terms[0], *(rf"\quad {term}" for term in terms[1:])]
    lines += [_row(family) for family in formulation.rows]
    lines += [_domain(formulation.variable(name), formulation) for name in formulation.variables]
    return "\\begin{aligned}\n" + " \\\\\n".join(lines) + "\n\\end{aligned}"


def _domain(variable: Variable, formulation: Formulation) -> str:
    """A line with the domain of a variable."""
    name, lower, upper = (expression(e) for e in (_symbol_of(variable), variable.lower, variable.upper))
    if variable.integer and not formulation.options.relax:
        between = [] if variable.upper - variable.lower == 1 else [r"\ldots"]
        domain = rf"{name} \in \{{{', '.join([lower, *between, upper])}\}}"
    elif variable.lower == -sp.oo:
        domain = rf"{name} \in \mathbb{{R}}"
    elif variable.upper == sp.oo:
        domain = rf"{name} \ge {lower}"
    else:
        domain = rf"{lower} \le {name} \le {upper}"
    return rf"& {domain} && {_FOR[variable.over]}"


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
    text = (
        rf"& {expression(relation.lhs)} {_SENSE[family.sense]} {expression(relation.rhs)} && "
        rf"{_FOR[family.over]}"
    )
    return rf"{text} \quad \text{{{family.paper}}}"
