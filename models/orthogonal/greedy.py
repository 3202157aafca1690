"""Greedy rounding of mixed-integer quadrangulation (Bommes, Zimmer, Kobbelt, ACM Trans. Graph. 28, 2009).

Integers on a forest grown from the strokes are 0, which only chooses labels. All others may be real at first.
Then the one nearest to a whole number is rounded, and angles are solved for again, until all are whole.
Integers along rings of prescribed indices are known at first; the forest joins what they join.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

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
    z, known = energy.with_sums(np.zeros(len(energy.first), dtype=np.int32)), find_forest_rows(energy)
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
            ends = np.zeros(energy.size + 1)
            ends[i], ends[j] = 1.0, -1.0
            column = np.append(solve(ends[:-1]), 0.0) - columns @ (factors * (columns[i] - columns[j]))
            factors[number] = omega / (1 + omega * (column[i] - column[j]))
            alpha -= factors[number] * (alpha[i] - alpha[j] + energy.constant[row] + HALF * z[row]) * column
            columns[:, number] = column
    return z


def find_forest_rows(energy: OrthogonalEnergy) -> Bools:
    """Whether each row is held, a stroke of a point in no held row, or in the forest, (r,).

    The forest grows in breadth from the ground, between the points that held rows join.
    """
    size, held = energy.size + 1, energy.is_held
    links = coo_array((held[held], (energy.first[held], energy.second[held])), shape=(size, size))
    number = connected_components(links, directed=False)[1].astype(np.int32)
    first, second, alone = number[energy.first], number[energy.second], np.bincount(number)[number] == 1
    used = np.nonzero((energy.weight > 0) & (first != second))[0]
    known = held | ((energy.second == energy.size) & alone[energy.first])
    forest = grow_forest(number.max() + 1, first[used], second[used], [number[energy.size]])
    known[used[forest.pair[forest.pair >= 0]]] = True
    return np.asarray(known)
