"""Crosses from shares: pixel by pixel the label of least estimated cost.

In the order of a pass, each pixel takes the label of least D + cost to the neighbours that have their label +
shares of the neighbours that have none (Kolmogorov 2006, 5).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from ..instance.grid import Bools, Floats
from ..processes.compiled import compiled
from .products import add, least_a, share_of, sized
from .state import Indices, State

_HALF: Final = float(np.pi / 2)


def decode(order: Indices, state: State) -> tuple[Floats, Floats]:
    """Alpha and beta of the crosses, found pixel by pixel in that order."""
    alpha, beta = np.zeros((2, len(order)))
    _decode(order, state, alpha, beta, np.zeros(len(order), dtype=bool))
    return alpha, beta


@compiled
def _decode(order: Indices, state: State, alpha: Floats, beta: Floats, fixed: Bools) -> None:
    """Fill in the angles, pixel by pixel in that order. fixed: the pixels that have theirs."""
    for i in order:
        cost = state.unary[state.start[i] : state.start[i + 1]].copy()
        for column in range(4):
            pair = state.around[i, column]
            if pair < 0:
                continue
            j = state.first[pair] + state.second[pair] - i
            if fixed[j]:
                _add_distance(i, state, alpha[j], beta[j], cost)
            else:
                add(cost, share_of(pair, i, state))
        x = np.argmin(cost)
        alpha[i] = state.alpha[i] + state.h * (x // state.beta_count[i])
        beta[i] = state.beta[i] + state.h * (x % state.beta_count[i])
        fixed[i] = True


@compiled
def _add_distance(i: int, state: State, alpha: float, beta: float, cost: Floats) -> None:
    """Add the cost of a pair of pixel i with a fixed cross."""
    columns = state.beta_count[i]
    for row in range(state.alpha_count[i]):
        even = state.alpha[i] + state.h * row - alpha
        even, odd = least_a(even), least_a(even + _HALF)
        for column in range(columns):
            mine = state.beta[i] + state.h * column
            same = sized(even, state.power) + sized(mine - beta, state.power)
            other = sized(odd, state.power) + sized(mine + beta, state.power)
            cost[row * columns + column] += 2 * min(same, other)
