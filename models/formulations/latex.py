"""LaTeX of formulations, derived from their declarations by SymPy, which only notebooks and pages need."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

import sympy as sp

from .declaration import Family, Formulation
from .expressions import Expression, Factor, Function, Operand, Symbol, Term, expression_of
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


_FUNCTIONS: Final = {
    "cos": sp.cos,
    "floor": sp.floor,
    "abs": sp.Abs,
    "parity": lambda value: sp.Mod(value, 2),
}


def to_sympy(value: Operand) -> sp.Expr:
    """An expression in SymPy."""
    terms = (
        sp.Mul(
            sp.Rational(*term.constant.ratio.as_integer_ratio()),
            sp.pi**term.constant.power,
            *(_to_sympy(factor) ** power for factor, power in term.factors),
        )
        for term in expression_of(value).terms
    )
    return sp.Add(*terms)


def _to_sympy(factor: Factor) -> sp.Expr:
    if isinstance(factor, Symbol):
        return sp.Symbol(factor.name, real=True)
    if isinstance(factor, Function):
        return _FUNCTIONS[factor.name](to_sympy(factor.argument))
    return to_sympy(factor)


def expression(value: Operand) -> str:
    """An expression in the paper's notation."""
    names = {_to_sympy(symbol): text for symbol, text in LATEX.items()}
    return str(sp.latex(to_sympy(value), symbol_names=names, fold_frac_powers=True))


def aligned(lines: Iterable[str]) -> str:
    """Lines as one environment."""
    return "\\begin{aligned}\n" + " \\\\\n".join(lines) + "\n\\end{aligned}"


def model(formulation: Formulation) -> str:
    """Objective, rows and domains, the domains of an index set on one line."""
    domains: dict[IndexSet, list[str]] = {}
    for variable in map(formulation.variable, formulation.variables):
        domains.setdefault(variable.over, []).append(domain(variable, formulation))
    lines = ["& " + r", \qquad ".join(texts) + f" && {_FOR[over]}" for over, texts in domains.items()]
    return aligned([*objective_and_rows(formulation), *lines])


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
    name, lower, upper = (
        "" if end is None else expression(end)
        for end in (_symbol_of(variable), variable.lower, variable.upper)
    )
    if variable.integer and not formulation.options.relax:
        between = [] if (lower, upper) == ("0", "1") else [r"\ldots"]
        return rf"{name} \in \{{{', '.join([lower, *between, upper])}\}}"
    if not lower:
        return rf"{name} \in \mathbb{{R}}"
    return rf"{lower} \le {name} \le {upper}" if upper else rf"{name} \ge {lower}"


def _symbol_of(variable: Variable) -> Symbol:
    """The symbol that denotes the variable itself."""
    return next(symbol for symbol, slot in SLOTS[variable.over].items() if slot == (variable.name, "itself"))


def _summand(family: Family) -> str:
    """A term of the objective: its weights first, a sum in brackets."""
    if len(family.body.terms) > 1:
        return rf"\Bigl[ {expression(family.body)} \Bigr]"
    (term,) = family.body.terms
    rest = tuple(factor for factor in term.factors if factor[0] not in _WEIGHTS)
    first = [LATEX[symbol] for symbol in _WEIGHTS if (symbol, 1) in term.factors]
    return r" \, ".join([*first, expression(Expression((Term(term.constant, rest),)))])


def _row(family: Family) -> str:
    relation = family.relation
    return f"{expression(relation.left)} {_SENSE[relation.sense]} {expression(relation.right)}"


def _two_rows(first: Family, second: Family) -> str:
    """Both bounds of an expression, or an expression above a value and its negative; else empty."""
    one, two = first.relation, second.relation
    if (one.left, first.over) != (two.left, second.over):
        return ""
    if {one.sense, two.sense} == {">=", "<="}:
        least, most = (one.right, two.right) if one.sense == ">=" else (two.right, one.right)
        return rf"{expression(least)} \le {expression(one.left)} \le {expression(most)}"
    if one.sense == two.sense == ">=" and not (one.right + two.right).terms:
        right = expression(one.right)
        value = rf"\left({right}\right)" if len(one.right.terms) > 1 else right
        return rf"{expression(one.left)} \ge \pm {value}"
    return ""
