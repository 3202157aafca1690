"""The product p1 beta_i as a variable z, for formats up to quadratic terms."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import sympy as sp

from .catalogue import facets_of_z
from .declaration import Formulation
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
    lifted = tuple(replace(family, expression=_lift(family.expression)) for family in formulation.objective)
    return replace(
        formulation,
        objective=lifted,
        rows=(*facets_of_z("hull"), *formulation.rows),
        lifted=_WEAKER if formulation.options.relax else _EXACT,
    )


def _lift(expression: sp.Expr) -> sp.Expr:
    squares_kept = expression.replace(
        lambda e: e.is_Pow and e.base.is_Add, lambda e: sp.expand(e.base).subs(p1 * beta_i, z) ** e.exp
    )
    return squares_kept.subs(p1 * beta_i, z)
