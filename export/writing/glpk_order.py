"""The order in which GLPK numbers the columns of our .mod: within a block, in the order of first occurrence.

Every pair names its second pixel before its first one: (14) and (16) have both on the right side, and GLPK
adds from the back. Then the strokes follow, and for the skew all pixels. Order: GLPK 5.0, `glpsol -m x.mod -d
x.dat --wglp` names the columns it numbers.

`crossfield read` needs this order: it accepts what `glpsol -w` writes for a .mod model (docs/files.md), and
such a file carries no names.
"""

from __future__ import annotations

import numpy as np

from ...models.formulations.problem import Problem
from ...models.instance.grid import Ints


def glpk_order(problem: Problem) -> Ints:
    """Columns (k,) of the problem in GLPK's order, without an angle alpha that is in no row."""
    instance = problem.instance
    grid = instance.grid
    named = np.concatenate([np.stack([grid.second, grid.first], axis=1).ravel(), instance.stroke_index])
    orders = {"alpha": _first(named), "beta": _first(np.concatenate([named, np.arange(grid.size)]))}
    return np.concatenate(
        [
            block.offset + orders.get(name, np.arange(block.count, dtype=np.int64))
            for name, block in problem.blocks.items()
        ]
    ).astype(np.int32)


def _first(named: Ints) -> Ints:
    """Every number once, in the order of first occurrence."""
    numbers, places = np.unique(named, return_index=True)
    return numbers[np.argsort(places)]
