"""Greedy rounding of mixed-integer quadrangulation (Bommes, Zimmer, Kobbelt, ACM Trans. Graph. 28, 2009).

Integers on a forest grown from the strokes are 0, which only chooses labels. All others may be real at first.
Then the one nearest to a whole number is rounded, and angles are solved for again, until all are whole.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from ..instance.angles import HALF
from ..instance.cycles import grow_forest
from ..instance.domain import Bools, Ints
from ..instance.sparse_systems import factor_matrix
from ..processes.blas_threads import one_thread
from ..processes.deadline import IsOver, never
from .energy import MOST_DENSE, OrthogonalEnergy

_UPDATES: Final = 40  # of rank one between two factorisations
_SHARE: Final = 0.2  # of the open integers, rounded per factorisation where there are many points


@one_thread()
def round_greedily(energy: OrthogonalEnergy, is_over: IsOver = never) -> Ints:
    """Integers by greedy rounding, (r,), one after the other with the best angles in between.

    With more than 6,000 points a fifth of the open integers are rounded per factorisation, those nearest to
    whole numbers. Once time is over, all that are open are rounded.
    """
    z, known = np.zeros(len(energy.first), dtype=np.int32), find_forest_rows(energy)
    while not known.all():
        weight = np.where(known, energy.weight, 0.0)
        solve = factor_matrix(energy.weighted_matrix(weight), pull=0.0)
        alpha = np.append(-solve(energy.force(weight, z)), 0.0)
        # A row that is known from now on changes the inverse by a matrix factor column column' of rank one.
        columns, factors = np.zeros((energy.size + 1, _UPDATES)), np.zeros(_UPDATES)
        for number in range(_UPDATES):
            open_ = np.nonzero(~known)[0]
            many = (
                len(open_) if is_over() else np.ceil(_SHARE * len(open_)) if energy.size > MOST_DENSE else 1
            )
            turns = energy.turns(alpha[:-1])[open_]
            distance = np.round(np.abs(turns - np.round(turns)), 9)  # rounding errors must not decide ties
            chosen = np.argsort(distance, kind="stable")[: int(many)]
            z[open_[chosen]], known[open_[chosen]] = np.round(turns[chosen]), True
            if many != 1 or known.all():
                break
            row = open_[chosen[0]]
            i, j, omega = energy.first[row], energy.second[row], energy.weight[row]
            ends = np.zeros(energy.size)
            ends[i], ends[j] = 1.0, -1.0
            column = np.append(solve(ends), 0.0) - columns @ (factors * (columns[i] - columns[j]))
            factors[number] = omega / (1 + omega * (column[i] - column[j]))
            alpha -= factors[number] * (alpha[i] - alpha[j] + energy.constant[row] + HALF * z[row]) * column
            columns[:, number] = column
    return z


def find_forest_rows(energy: OrthogonalEnergy) -> Bools:
    """Whether each row is a stroke or in the forest grown in breadth from the ground, (r,)."""
    used, known = np.nonzero(energy.weight > 0)[0], energy.second == energy.size
    forest = grow_forest(energy.size + 1, energy.first[used], energy.second[used], [energy.size])
    known[used[forest.pair[forest.pair >= 0]]] = True
    return np.asarray(known)
