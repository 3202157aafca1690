"""Order of columns in which GLPK numbers those of our .mod."""

from __future__ import annotations

import numpy as np

from ...models.formulations.problem import Problem
from ...models.instance.domain import Ints


def mod_column_order(problem: Problem) -> Ints:
    """Columns (k,) in the order in which GLPK 5.0 numbers those of our .mod, without an angle in no row.

    It numbers the columns of a block as they first occur. Every pair names its second pixel before its first
    one: (14) and (16) have both on the right side, and GLPK adds from the back. Then the strokes follow, and
    for the skew all pixels. `glpsol -m x.mod -d x.dat --wglp` names the columns that it numbers.
    """
    instance = problem.instance
    domain = instance.domain
    named = np.concatenate([np.stack([domain.second, domain.first], axis=1).ravel(), instance.stroke_index])
    orders = {
        "alpha": _first_occurrences(named),
        "beta": _first_occurrences(np.concatenate([named, np.arange(domain.size)])),
    }
    return np.concatenate(
        [
            block.offset + orders.get(name, np.arange(block.count, dtype=np.int64))
            for name, block in problem.blocks.items()
        ]
    ).astype(np.int32)


def _first_occurrences(indices: Ints) -> Ints:
    """Every number once, in the order of first occurrence."""
    numbers, places = np.unique(indices, return_index=True)
    return numbers[np.argsort(places)]
