"""The product p1 beta_i as a variable z, for formats that hold nothing beyond quadratic."""

from __future__ import annotations

from dataclasses import replace

import sympy as sp

from .declaration import Formulation
from .formulations import facets_of_z
from .notation import beta_i, p1, z


def lift_products(formulation: Formulation) -> Formulation:
    """The same problem with z for every product p1 beta_i, and the hull facets that make it exact.

    A square stays a square of a linear expression, so that (8) becomes convex; (9) stays the expanded polynomial with 4 z beta_j.
    """
    lifted = tuple(replace(family, expression=_lift(family.expression)) for family in formulation.objective)
    return replace(
        formulation,
        objective=lifted,
        rows=(*facets_of_z("hull"), *formulation.rows),
        lifted="z = p1 beta_i with the hull facets (26)-(29), exact",
    )


def _lift(expression: sp.Expr) -> sp.Expr:
    squares_kept = expression.replace(
        lambda e: e.is_Pow and e.base.is_Add, lambda e: sp.expand(e.base).subs(p1 * beta_i, z) ** e.exp
    )
    return squares_kept.subs(p1 * beta_i, z)
