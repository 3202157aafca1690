"""The compiled code for one pixel and one pair: (min,+) products of labels with a pair's cost.

For one parity of the jump the cost 2 (A^2 + B^2) is a sum of a term in alpha and one in beta. So the
product is one over beta (models/proof/min_plus.py) and then one over alpha: O(N^3) for N^2 labels. A^2 is
the least over all jumps of that parity: A is taken modulo pi.

The first call compiles for some 20 s; cached code loads in 0.3 s. Cached code is not renewed when only
functions in other files that it calls have changed: delete `*.nbi` then. The names of `State` and
`Clusters` are part of the cache: after renaming them, old files cannot be read.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from ..instance.grid import Floats
from ..processes.compilation import compiled
from .min_plus import Given, Terms, betas, least_cost, least_of, lower_rows, over_beta
from .state import Ends, State

_HALF: Final = float(np.pi / 2)
_PI: Final = float(np.pi)


class Used(NamedTuple):
    """Numbers of the labels of a pixel, one row for each alpha, and the part of each row that is in use."""

    values: Floats
    columns: int
    ends: Ends


@compiled
def pixel_pass(i: int, earlier: int, state: State) -> None:
    """Take from pairs to earlier pixels, columns from `earlier` of `around`; pass on to the other two."""
    begin, end = state.start[i], state.start[i + 1]
    mine, ends, columns = state.theta[begin:end], ends_of(i, state), state.beta_count[i]
    _copy_used(state.unary[begin:end], ends, columns, mine)
    taken, given = 0, 0
    for column in range(4):
        pair = state.around[i, column]
        if pair < 0:
            continue
        share = share_of(pair, i, state)
        if column // 2 == earlier // 2:
            taken += 1
            product(pair, i, state, share)
        else:
            given += 1
        _add_used(share, ends, columns, mine)
    least = _least_used(mine, ends, columns)
    state.least[i] = least
    for column in range(2 - earlier, 4 - earlier):
        pair = state.around[i, column]
        if pair >= 0:
            _hand_on(mine, ends, columns, (least, 1.0 / max(taken, given)), share_of(pair, i, state))


@compiled
def _copy_used(values: Floats, ends: Ends, columns: int, target: Floats) -> None:
    """Fill in the used part of the target."""
    for row in range(ends[0].size):
        for x in range(row * columns + ends[0][row], row * columns + ends[1][row]):
            target[x] = values[x]


@compiled
def _add_used(values: Floats, ends: Ends, columns: int, target: Floats) -> None:
    """Add the values to the used part of the target."""
    for row in range(ends[0].size):
        for x in range(row * columns + ends[0][row], row * columns + ends[1][row]):
            target[x] += values[x]


@compiled
def _least_used(values: Floats, ends: Ends, columns: int) -> float:
    """The least value that is used."""
    least = np.inf
    for row in range(ends[0].size):
        if ends[0][row] < ends[1][row]:
            least = min(least, least_of(values[row * columns + ends[0][row] : row * columns + ends[1][row]]))
    return least


@compiled
def _hand_on(
    theta: Floats, ends: Ends, columns: int, least_and_part: tuple[float, float], share: Floats
) -> None:
    """Deduct a part of theta less its least value from the share of a pair."""
    least, part = least_and_part
    for row in range(ends[0].size):
        for x in range(row * columns + ends[0][row], row * columns + ends[1][row]):
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
    begin, end = ends_of(i, state)
    least, columns = np.inf, state.beta_count[i]
    for row in range(begin.size):
        for x in range(row * columns + begin[row], row * columns + end[row]):
            if unary[x] < np.inf:
                least = min(least, most[x] - share[x])
    return least


@compiled
def product(pair: int, i: int, state: State, out: Floats) -> None:
    """Greatest share of a pair at the labels x of its end i: min over y of c(x, y) - share(y).

    Labels that are not allowed get 0 between allowed ones of their row, and elsewhere keep their number.
    """
    j = state.first[pair] + state.second[pair] - i
    rows, columns = state.alpha_count[i], state.beta_count[i]
    given = Given(np.empty((state.alpha_count[j], state.beta_count[j])), ends_of(j, state))
    others, columns_j = given.values.shape
    many = max(others, 4)
    terms = Terms(np.empty((many, columns)), np.empty(many), np.empty(many))
    terms.rows[others:], terms.least[others:] = np.inf, np.inf
    _fill_given(pair, j, state, given, terms.least)
    ends = ends_of(i, state)
    begin, end = ends
    for row in range(rows):
        for x in range(row * columns + begin[row], row * columns + end[row]):
            out[x] = np.inf
    least, reached = least_of(terms.least), np.inf
    tabled = state.clusters.of_pair[pair, 0] >= 0
    in_alpha = np.empty((rows if tabled else 0, others)), np.empty(rows + others - 1)
    for turn in range(2):
        odd = (state.odd[pair] + turn) % 2 == 1
        mine, other = betas(pair, i, state, odd)
        if tabled:
            cheapest = alpha_costs(pair, i, state, odd, in_alpha[0])
        else:
            cheapest = step_costs(pair, i, state, odd, in_alpha[1])
        cheapest += least_cost(mine, other, (columns, columns_j), state.power)
        if cheapest + least < reached:
            over_beta(given, mine, other, state.power, terms.rows)
            reached = _lower_all(Used(out, columns, ends), in_alpha, terms)
    unary, less = state.unary[state.start[i] : state.start[i + 1]], state.h**2 if state.power == 2 else 0.0
    for row in range(rows):
        for x in range(row * columns + begin[row], row * columns + end[row]):
            out[x] = out[x] - less if unary[x] < np.inf else 0.0


@compiled
def _lower_all(out: Used, in_alpha: tuple[Floats, Floats], terms: Terms) -> float:
    """Lower all rows to costs in alpha plus the terms; return the greatest that is left.

    in_alpha: the costs of each row, or without any row, those by steps.
    """
    rows, many, (whole, of_steps) = out.ends[0].size, terms.least.size, in_alpha
    left, targets, reached = np.full((4, many), np.inf), np.empty((4, out.columns)), -np.inf
    for first in range(0, rows, 4):
        at = _take(out, first, targets)
        if at[0] < at[1]:
            for row in range(first, min(first + 4, rows)):
                steps = of_steps[rows - 1 - row : of_steps.size - row]
                copy(whole[row] if whole.shape[0] else steps, left[row - first])
            reached = max(reached, lower_rows(targets, left, terms, at))
            _put_back(out, first, targets, at[0])
    return reached


@compiled
def _take(rows: Used, first: int, targets: Floats) -> tuple[int, int]:
    """Copy the used part of four rows to the targets, -inf elsewhere; return its columns."""
    (begin, end), last = rows.ends, min(first + 4, rows.ends[0].size)
    low, high = rows.columns, 0
    for row in range(first, last):
        if begin[row] < end[row]:
            low, high = min(low, begin[row]), max(high, end[row])
    targets[:, : max(high - low, 0)] = -np.inf
    for row in range(first, last):
        for x in range(begin[row], end[row]):
            targets[row - first, x - low] = rows.values[row * rows.columns + x]
    return low, high


@compiled
def _put_back(rows: Used, first: int, targets: Floats, low: int) -> None:
    """Copy the targets back to the used part of four rows, of which the first column is `low`."""
    begin, end = rows.ends
    for row in range(first, min(first + 4, begin.size)):
        for x in range(begin[row], end[row]):
            rows.values[row * rows.columns + x] = targets[row - first, x - low]


@compiled
def ends_of(i: int, state: State) -> Ends:
    """The first allowed label of each row of a pixel, and the one after the last."""
    low, high = state.row_start[i], state.row_start[i + 1]
    return state.begin[low:high], state.end[low:high]


@compiled
def _fill_given(pair: int, j: int, state: State, given: Given, least: Floats) -> None:
    """Fill in minus the shares of a pair at its end j, inf at labels that are not allowed.

    Only what is in use is filled in. least: receives the least number of each row, inf without any.
    """
    share, unary = share_of(pair, j, state), state.unary[state.start[j] : state.start[j + 1]]
    (begin, end), values = given.ends, given.values
    for row in range(values.shape[0]):
        least[row] = np.inf
        for y in range(begin[row], end[row]):
            at = row * values.shape[1] + y
            values[row, y] = -share[at] if unary[at] < np.inf else np.inf
            least[row] = min(least[row], values[row, y])


@compiled
def sized(residual: float, power: int) -> float:
    """The square or the absolute value of a residual."""
    return residual * residual if power == 2 else abs(residual)


@compiled
def least_a(a: float) -> float:
    """The A of least size over all jumps of one parity, from the A of one of them."""
    return float(a - _PI * np.round(a / _PI))


@compiled
def step_costs(pair: int, i: int, state: State, odd: bool, of_steps: Floats) -> float:
    """Fill in 2 A^2 or 2 |A| for labels x of end i and y of the other end; return the least.

    By x - y, from the last x to minus the last y.
    """
    j, last = state.first[pair] + state.second[pair] - i, state.alpha_count[i] - 1
    a = state.alpha[i] - state.alpha[j]
    if odd:
        a += _HALF
    for place in range(of_steps.size):
        of_steps[place] = 2 * sized(least_a(a + state.h * (last - place)), state.power)
    return least_of(of_steps)


@compiled
def alpha_costs(pair: int, i: int, state: State, odd: bool, cost: Floats) -> float:
    """Fill in 2 A^2 or 2 |A|, plus the tables of the pair, at labels x of end i and y of the other end.

    Returns the least.
    """
    last = cost.shape[0] - 1
    of_steps = np.empty(last + cost.shape[1])
    step_costs(pair, i, state, odd, of_steps)
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
