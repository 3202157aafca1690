"""Products p1 beta_i lifted to z, for formats that hold nothing beyond quadratic."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from .catalogue import facets_of_z
from .declaration import Formulation
from .expressions import Expression, Term
from .symbols import beta_i, p1, z

_EXACT: Final = "z = p1 beta_i with the hull facets (26)-(29), exact"
_WEAKER: Final = (
    "z for p1 beta_i between the hull facets (26)-(29), a relaxation: "
    "p1 is not only 0 or 1 here; .nl and .gms hold the products"
)


def lift_products(formulation: Formulation) -> Formulation:
    """The formulation with z for every product p1 beta_i, and its hull facets.

    It is the same problem while p1 is 0 or 1. With integrality dropped the result is a relaxation
    (`Formulation.weakened`). A square stays a square of a linear expression, so that (8) becomes convex; (9)
    stays the expanded polynomial with 4 z beta_j.
    """
    lifted = tuple(replace(family, expression=_lift(family.body)) for family in formulation.objective)
    return replace(
        formulation,
        objective=lifted,
        rows=(*facets_of_z("hull"), *formulation.rows),
        lifted=_WEAKER if formulation.options.relax else _EXACT,
    )


def _lift(expression: Expression) -> Expression:
    """The expression with z for p1 beta_i; squares of sums are kept, and the sums expanded."""
    inside = expression.map_factors(
        lambda factor, power: (
            (_lift(factor.expanded() if power > 1 else factor) if isinstance(factor, Expression) else factor)
            ** power
        )
    )
    return Expression(tuple(map(_lift_term, inside.terms)))


def _lift_term(term: Term) -> Term:
    powers = dict(term.factors)
    if p1 not in powers or beta_i not in powers:
        return term
    powers |= {p1: powers[p1] - 1, beta_i: powers[beta_i] - 1, z: 1}
    return Term(term.constant, tuple((factor, power) for factor, power in powers.items() if power))
