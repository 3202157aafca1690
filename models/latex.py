"""LaTeX of a formulation, read off its declaration."""

from __future__ import annotations

from typing import Final

import sympy as sp

from .formulations import Family, Formulation
from .notation import LATEX, VARIABLES, IndexSet, w, w_beta, w_strokes

_SUM: Final[dict[IndexSet, str]] = {
    "pixels": r"\sum_{i \in I}",
    "strokes": r"\sum_{i \in S_c}",
    "pairs": r"\sum_{(i,j) \in E}",
}
_FOR: Final[dict[IndexSet, str]] = {"pixels": r"i \in I", "strokes": r"i \in S_c", "pairs": r"(i,j) \in E"}
_WEIGHTS: Final = (w_strokes, w_beta, w)
_SENSE: Final = {">=": r"\ge", "<=": r"\le", "==": "="}
_DOMAIN: Final = {
    "alpha": r"\underline\alpha_i \le \alpha_i \le \underline\alpha_i + \tfrac{\pi}{2}",
    "beta": r"-\tfrac{\pi}{4} \le \beta_i \le \tfrac{\pi}{4}",
    "p": r"p_{ij} \in \{p^{\min}_{ij}, \ldots, p^{\max}_{ij}\}",
    "p1": r"p_{ij,1} \in \{0, 1\}",
    "p2": r"p_{ij,2} \in \{\lfloor p^{\min}_{ij}/2 \rfloor, \ldots, \lfloor p^{\max}_{ij}/2 \rfloor\}",
    "s": r"s_{ij} \ge 0",
    "t": r"t_{ij} \ge 0",
    "z": r"-\tfrac{\pi}{4} \le z_{ij} \le \tfrac{\pi}{4}",
    "d": r"d_{ij} \in \mathbb{R}",
    "u": r"u_{ij} \in \mathbb{R}",
    "gamma": r"\gamma_i \ge 0",
    "psi": r"\psi_i \ge 0",
}


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
    lines += [rf"& {_DOMAIN[name]} && {_FOR[VARIABLES[name].over]}" for name in formulation.variables]
    return "\\begin{aligned}\n" + " \\\\\n".join(lines) + "\n\\end{aligned}"


def _summand(family: Family) -> str:
    """A term of the objective: its weights first, a sum in brackets."""
    value = family.expression
    if value.is_Add:
        return rf"\Bigl[ {expression(value)} \Bigr]"
    weights, rest = value.as_independent(*(value.free_symbols - set(_WEIGHTS)))
    first = [LATEX[symbol] for symbol in _WEIGHTS if symbol in weights.free_symbols]
    return r" \, ".join([*first, expression(rest)])


def _row(family: Family) -> str:
    relation = family.expression
    text = rf"& {expression(relation.lhs)} {_SENSE[family.sense]} {expression(relation.rhs)} && {_FOR[family.over]}"
    return rf"{text} \quad \text{{{family.paper}}}"
