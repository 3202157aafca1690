"""Upper bound of the objective that a point saves by breaking rows, column by column.

A solver keeps rows to a tolerance, and a weight amplifies it in the objective. Angles and jumps determine the
field of a point. Its other columns follow from them, by rows that bound each from below. A column that is too
small breaks such a row by the same amount. So the broken rows bound the missing part of the objective.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

import numpy as np

from ...models.formulations.families import Monomial, PlacedFamily
from ...models.formulations.problem import Problem
from ...models.instance.domain import Floats

_CHOSEN: Final = frozenset({"alpha", "beta", "p", "p1", "p2", "k"})
"""Blocks of columns that determine the field of a point."""


def objective_leeway(problem: Problem, point: Floats) -> float:
    """Greatest reduction of the objective by the rows and bounds that a point (columns,) breaks.

    The error of a column that follows from angles and jumps is at most the greatest violation of its bounds
    and rows. That holds first for columns without a cost (z), then for columns with one, whose rows contain
    the others. The sum of costs times errors is at least the difference between the objective of the point's
    field and its own; 0 if no row is broken. Terms of degree 1 and 2 are counted: no other has such a column.
    """
    costs, products = problem.merged_objective(1), problem.merged_objective(2)
    block_of = np.repeat(list(problem.blocks), [block.count for block in problem.blocks.values()])
    priced = set(block_of[np.concatenate([costs[0].ravel(), products[0].ravel()])]) - _CHOSEN
    off = np.maximum(np.maximum(problem.lower - point, point - problem.upper), 0.0)
    off[np.isin(block_of, list(_CHOSEN))] = 0.0
    for wanted in (set(problem.blocks) - _CHOSEN - priced, priced):
        for family in problem.rows:
            _spread(family, point, off, wanted, priced - wanted)
    (first, second), value, size = products[0].T, np.abs(products[1]), np.abs(point)
    by_products = size[first] * off[second] + size[second] * off[first] + off[first] * off[second]
    return float(np.abs(costs[1]) @ off[costs[0][:, 0]] + value @ by_products)


def _spread(
    family: PlacedFamily, point: Floats, off: Floats, wanted: Collection[str], later: Collection[str]
) -> None:
    """Raise `off` of the wanted blocks to the errors that this family's rows allow.

    Rows with blocks that come later give no limit for these.
    """
    slacks = [(_block(term), term) for term in family.of_degree(1) if _block(term) not in _CHOSEN]
    terms = [term for name, term in slacks if name in wanted]
    if not terms or any(name in later for name, _ in slacks):
        return
    reach = np.maximum(family.excess(point), 0.0)
    for _, term in slacks:
        if term is not terms[0]:
            reach = reach + np.abs(term.coefficient) * off[term.factors[0]]
    np.maximum.at(off, terms[0].factors[0], reach / np.abs(terms[0].coefficient))


def _block(term: Monomial) -> str:
    return term.family.block(term.symbols[0]).name
