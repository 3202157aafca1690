"""What a point can have saved by the rows that it breaks: an upper bound, column by column.

A solver keeps rows to a tolerance, and a weight makes more of it in the objective. Angles and jumps say which
field a point is; its other columns follow from them, by rows that say how small each may be. One that is too
small breaks such a row by as much. So the broken rows tell what the objective can lack, and no more.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

import numpy as np

from ...models.formulations.families import Monomial, PlacedFamily
from ...models.formulations.problem import Problem
from ...models.instance.grid import Floats

_CHOSEN: Final = frozenset({"alpha", "beta", "p", "p1", "p2"})
"""Blocks of columns that say which field a point is."""


def saved(problem: Problem, point: Floats) -> float:
    """The most by which rows and bounds that a point (columns,) breaks can have lowered its objective.

    A column that follows from angles and jumps may be off by the most that one of its bounds and rows is
    broken. That holds first for those without a cost (z), then for those with one, in whose rows the others
    stand. The sum of costs times distances is at least what the objective of the point's field is above its
    own; 0 where no row is broken. Terms of degree 1 and 2 are counted: no other has such a column.
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
    """Raise `off` of the wanted blocks to what this family's rows let them be off.

    Rows in which blocks stand that come later say nothing of these.
    """
    slacks = [(_block(term), term) for term in family.of_degree(1) if _block(term) not in _CHOSEN]
    own = [term for name, term in slacks if name in wanted]
    if not own or any(name in later for name, _ in slacks):
        return
    reach = np.maximum(family.excess(point), 0.0)
    for _, term in slacks:
        if term is not own[0]:
            reach = reach + np.abs(term.coefficient) * off[term.factors[0]]
    np.maximum.at(off, own[0].factors[0], reach / np.abs(own[0].coefficient))


def _block(term: Monomial) -> str:
    return term.family.block(term.symbols[0]).name
