"""The compiled code for one pixel and one pair: (min,+) products of labels with a pair's cost.

For one parity of the jump the cost 2 (A^2 + B^2) is a sum of a term in alpha and one in beta. So the
product is one over beta (models/proof/over_beta.py) and then one over alpha: O(N^3) for N^2 labels. A^2 is
the least over all jumps of that parity: A is taken modulo pi.

The first call compiles for some 20 s; cached code loads in 0.3 s. Cached code is not renewed when only
functions in other files that it calls have changed: delete `*.nbi` then. The names of `State` and
`Rectangles` are part of the cache: after renaming them, old files cannot be read.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from ..instance.grid import Floats
from ..processes.compiled import compiled
from .min_plus import finite_part, least_of, lower_by_product
from .over_beta import betas, least_cost, over_beta
from .state import State

_HALF: Final = float(np.pi / 2)
_PI: Final = float(np.pi)


@compiled
def pixel_pass(i: int, earlier: int, state: State) -> None:
    """Take from pairs to earlier pixels, columns from `earlier` of `around`; pass on to the other two."""
    begin, end = state.start[i], state.start[i + 1]
    mine, unary = state.theta[begin:end], state.unary[begin:end]
    for x in range(mine.size):
        mine[x] = unary[x]
    taken, given = 0, 0
    for column in range(4):
        pair = state.around[i, column]
        if pair < 0:
            continue
        share = share_of(pair, i, state)
        if column // 2 == earlier // 2:
            taken += 1
            product(pair, i, state, share)
            for x in range(mine.size):
                share[x] = share[x] if mine[x] < np.inf else 0.0
        else:
            given += 1
        add(mine, share)
    least = mine.min()
    state.least[i] = least
    for column in range(2 - earlier, 4 - earlier):
        pair = state.around[i, column]
        if pair >= 0:
            _hand_on(share_of(pair, i, state), mine, least, 1.0 / max(taken, given))


@compiled
def _hand_on(share: Floats, theta: Floats, least: float, part: float) -> None:
    """Deduct a part of theta from the share of a pair."""
    for x in range(share.size):
        if theta[x] < np.inf:
            share[x] -= part * (theta[x] - least)


@compiled
def add(target: Floats, values: Floats) -> None:
    """Add the values to the target; `+=` would compile texts of errors too, which takes seconds."""
    for x in range(target.size):
        target[x] += values[x]


@compiled
def share_of(pair: int, i: int, state: State) -> Floats:
    """The shares of a pair at its end i."""
    if state.first[pair] == i:
        return state.shares_first[state.start_first[pair] : state.start_first[pair + 1]]
    return state.shares_second[state.start_second[pair] : state.start_second[pair + 1]]


@compiled
def all_taken(i: int, state: State) -> Floats:
    """The cost of each label of a pixel plus the shares of all its pairs."""
    theta = state.unary[state.start[i] : state.start[i + 1]].copy()
    for pair in state.around[i]:
        if pair >= 0:
            add(theta, share_of(pair, i, state))
    return theta


@compiled
def pair_minimum(pair: int, state: State) -> float:
    """The least c - shares of a pair over the allowed labels."""
    i = state.first[pair]
    share = share_of(pair, i, state)
    most = np.empty(share.size)
    product(pair, i, state, most)
    unary = state.unary[state.start[i] : state.start[i + 1]]
    least = np.inf
    for x in range(share.size):
        if unary[x] < np.inf:
            least = min(least, most[x] - share[x])
    return least


@compiled
def product(pair: int, i: int, state: State, out: Floats) -> None:
    """Greatest share of a pair at the labels x of its end i: min over y of c(x, y) - share(y)."""
    j = state.second[pair] if state.first[pair] == i else state.first[pair]
    rows, columns = state.alpha_count[j], state.beta_count[j]
    source = -share_of(pair, j, state)
    unary = state.unary[state.start[j] : state.start[j + 1]]
    for y in range(source.size):
        source[y] = source[y] if unary[y] < np.inf else np.inf
    given = source.reshape((rows, columns))
    found = out.reshape((state.alpha_count[i], state.beta_count[i]))
    found[:] = np.inf
    begin, end = np.empty(found.shape[0], np.int64), np.empty(found.shape[0], np.int64)
    unary = state.unary[state.start[i] : state.start[i + 1]].reshape(found.shape)
    for row in range(found.shape[0]):
        begin[row], end[row] = finite_part(unary[row])
    in_alpha = np.empty((found.shape[0], rows))
    half = np.empty((rows, found.shape[1]))
    least, reached = least_of(source), np.inf
    for turn in range(2):
        odd = (state.odd[pair] + turn) % 2 == 1
        mine, other = betas(pair, i, state, odd)
        cheapest = alpha_costs(pair, i, state, odd, in_alpha)
        cheapest += least_cost(mine, other, (half.shape[1], columns), state.power)
        if cheapest + least < reached:
            over_beta(given, mine, other, state.power, half)
            reached = lower_by_product(in_alpha, half, found, begin, end)
    if state.power == 2:
        for x in range(out.size):
            out[x] -= state.h * state.h


@compiled
def sized(residual: float, power: int) -> float:
    """The square or the absolute value of a residual."""
    return residual * residual if power == 2 else abs(residual)


@compiled
def alpha_costs(pair: int, i: int, state: State, odd: bool, cost: Floats) -> float:
    """Fill in 2 A^2 or 2 |A|, plus the tables of the pair, at labels x of end i and y of the other end.

    Returns the least.
    """
    j = state.first[pair] + state.second[pair] - i
    a = state.alpha[i] - state.alpha[j]
    if odd:
        a += _HALF
    last = cost.shape[0] - 1
    of_steps = np.empty(last + cost.shape[1])  # for x - y from the last x to minus the last y
    for place in range(of_steps.size):
        away = a + state.h * (last - place)
        away -= _PI * np.round(away / _PI)
        of_steps[place] = 2 * sized(away, state.power)
    for x in range(cost.shape[0]):
        copy(of_steps[last - x : last - x + cost.shape[1]], cost[x])
    for place in range(2):
        number = state.clusters.of_pair[pair, place]
        if number >= 0:
            _add_table(number, state.first[pair] == i, state, cost)
    return least_of(cost.reshape(-1))


@compiled
def _add_table(number: int, upright: bool, state: State, cost: Floats) -> None:
    """Add a table to the costs, turned if their rows are the labels of the pair's second pixel."""
    start = state.clusters.start
    table = state.clusters.tables[start[number] : start[number + 1]]
    if upright:
        add(cost.reshape(-1), table)
        return
    rows, columns = cost.shape
    for x in range(rows):
        for y in range(columns):
            cost[x, y] += table[y * rows + x]


@compiled
def copy(values: Floats, target: Floats) -> None:
    """Fill in the target."""
    for x in range(target.size):
        target[x] = values[x]
