"""The compiled code for one pixel and one pair: (min,+) products of labels with a pair's cost.

For one parity of the jump the cost 2 (A^2 + B^2) is a sum of a term in alpha and one in beta. So the
product is one over beta (min_plus.py) and then one over alpha: O(N^3) for N^2 labels. A^2 is
the least over all jumps of that parity: A is taken modulo pi.

The first call compiles for some 12 s of CPU; cached code loads in 0.3 s.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from ...instance.angles import HALF
from ...instance.domain import Floats
from ...processes.compilation import compiled, compiled_inside, inlined
from .min_plus import (
    RaggedMatrix,
    RightMatrix,
    beta_lines,
    fill_product_over_beta,
    least_beta_cost,
    least_value,
    lower_rows,
)
from .state import Indices, RowEnds, State

PASS: Final = 0
MINIMA: Final = 1
COMB: Final = 2

_PI: Final = float(np.pi)


class RaggedLabels(NamedTuple):
    """Numbers of the labels of a pixel, one row for each alpha, and the part of each row that is in use."""

    values: Floats
    columns: int
    ends: RowEnds


@compiled
def work_on(  # noqa: PLR0917
    task: int, numbers: Indices, place: int, state: State, excesses: Floats, values: Floats
) -> None:
    """Do a task on some pixels or pairs, one after the other.

    One function for all tasks, because each would contain the code of `fill_product`. task: PASS over pixels,
    with `place` 0 forwards and 2 backwards; MINIMA of pairs, filled in; or COMB, with its line from each
    pixel, as of `_follow`, to `place` of `State.around`, added to the values.
    """
    for number in numbers:
        if task == PASS:
            visit_pixel(number, place, state)
        elif task == MINIMA:
            values[number] = pair_minimum(number, state)
        else:
            _follow(number, place, state, excesses, values)


@inlined
def visit_pixel(i: int, earlier: int, state: State) -> None:
    """Take from pairs to earlier pixels, columns from `earlier` of `around`; pass on to the other two."""
    begin, end = state.pixels[i].start, state.pixels[i + 1].start
    mine, ends, columns = state.theta[begin:end], row_ends(i, state), state.pixels[i].beta_count
    _copy_used(state.unary[begin:end], ends, columns, mine)
    earlier_count, later_count = 0, 0
    for column in range(4):
        pair = state.around[i, column]
        if pair < 0:
            continue
        share = shares_at(pair, i, state)
        if column // 2 == earlier // 2:
            earlier_count += 1
            fill_product(pair, i, state, share)
        else:
            later_count += 1
        _add_used(share, ends, columns, mine)
    least = _least_used(mine, ends, columns)
    state.pixels[i].least = least
    for column in range(2 - earlier, 4 - earlier):
        pair = state.around[i, column]
        if pair >= 0:
            _give_to_later(
                mine, ends, columns, (least, 1.0 / max(earlier_count, later_count)), shares_at(pair, i, state)
            )


@inlined
def _copy_used(values: Floats, ends: RowEnds, columns: int, target: Floats) -> None:
    """Fill in the used part of the target."""
    for row in range(ends[0].size):
        for x in range(row * columns + ends[0][row], row * columns + ends[1][row]):
            target[x] = values[x]


@inlined
def _add_used(values: Floats, ends: RowEnds, columns: int, target: Floats) -> None:
    """Add the values to the used part of the target."""
    for row in range(ends[0].size):
        for x in range(row * columns + ends[0][row], row * columns + ends[1][row]):
            target[x] += values[x]


@inlined
def _least_used(values: Floats, ends: RowEnds, columns: int) -> float:
    """The least value that is used."""
    least = np.inf
    for row in range(ends[0].size):
        if ends[0][row] < ends[1][row]:
            least = min(
                least, least_value(values[row * columns + ends[0][row] : row * columns + ends[1][row]])
            )
    return least


@inlined
def _give_to_later(
    theta: Floats, ends: RowEnds, columns: int, least_and_part: tuple[float, float], share: Floats
) -> None:
    """Deduct a part of theta less its least value from the share of a pair."""
    least, part = least_and_part
    for row in range(ends[0].size):
        for x in range(row * columns + ends[0][row], row * columns + ends[1][row]):
            if theta[x] < np.inf:
                share[x] -= part * (theta[x] - least)


@compiled
def add_to(target: Floats, values: Floats) -> None:
    """Add the values to the target; `+=` would compile texts of errors too, which takes seconds."""
    for x in range(target.size):
        target[x] += values[x]


@compiled
def shares_at(pair: int, i: int, state: State) -> Floats:
    """The shares of a pair at its end i."""
    if state.pairs[pair].first == i:
        return state.shares_first[state.pairs[pair].start_first : state.pairs[pair + 1].start_first]
    return state.shares_second[state.pairs[pair].start_second : state.pairs[pair + 1].start_second]


@compiled
def fill_reparametrised(begin: int, end: int, state: State, theta: Floats) -> None:
    """Fill in the cost of each label of some pixels plus the shares of all pairs there."""
    for i in range(begin, end):
        costs = theta[state.pixels[i].start : state.pixels[i + 1].start]
        copy_to(state.unary[state.pixels[i].start : state.pixels[i + 1].start], costs)
        for pair in state.around[i]:
            if pair >= 0:
                add_to(costs, shares_at(pair, i, state))


@inlined
def pair_minimum(pair: int, state: State) -> float:
    """The least c - shares of a pair over the allowed labels."""
    i = state.pairs[pair].first
    share = shares_at(pair, i, state)
    most = np.empty(share.size)
    fill_product(pair, i, state, most)
    unary = state.unary[state.pixels[i].start : state.pixels[i + 1].start]
    begin, end = row_ends(i, state)
    least, columns = np.inf, state.pixels[i].beta_count
    for row in range(begin.size):
        for x in range(row * columns + begin[row], row * columns + end[row]):
            if unary[x] < np.inf:
                least = min(least, most[x] - share[x])
    return least


@inlined
def _follow(i: int, after: int, state: State, excesses: Floats, sums: Floats) -> None:
    """Add to the labels of a column or row, which begins at pixel i, the least excesses before each pixel.

    after: the place of the next pixel in `State.around`.
    """
    carried = excesses[state.pixels[i].start : state.pixels[i + 1].start].copy()
    while state.around[i, after] >= 0:
        pair = state.around[i, after]
        j = state.pairs[pair].first + state.pairs[pair].second - i
        carried = _message(pair, i, carried, state)
        add_to(sums[state.pixels[j].start : state.pixels[j + 1].start], carried)
        add_to(carried, excesses[state.pixels[j].start : state.pixels[j + 1].start])
        i = j


@inlined
def _message(pair: int, i: int, carried: Floats, state: State) -> Floats:
    """The least of the carried excess at end i plus c - shares of a pair, at labels of its share_j end."""
    j = state.pairs[pair].first + state.pairs[pair].second - i
    share_i, share_j = shares_at(pair, i, state), shares_at(pair, j, state)
    before, message = share_i.copy(), share_j.copy()
    _subtract(share_i, carried)
    fill_product(pair, j, state, message)
    copy_to(before, share_i)
    _subtract(message, share_j)
    return message


@inlined
def _subtract(target: Floats, values: Floats) -> None:
    """Subtract the values from the target."""
    for x in range(target.size):
        target[x] -= values[x]


@compiled
def fill_product(pair: int, i: int, state: State, out: Floats) -> None:
    """Greatest share of a pair at the labels x of its end i: min over y of c(x, y) - share(y).

    Labels that are not allowed get 0 between allowed ones of their row, and elsewhere keep their number.
    """
    j = state.pairs[pair].first + state.pairs[pair].second - i
    rows, columns = state.pixels[i].alpha_count, state.pixels[i].beta_count
    ragged = RaggedMatrix(
        np.empty((state.pixels[j].alpha_count, state.pixels[j].beta_count)), row_ends(j, state)
    )
    rows_j, columns_j = ragged.values.shape
    many = max(rows_j, 4)
    terms = RightMatrix(np.empty((many, columns)), np.empty(many), np.empty(many))
    terms.rows[rows_j:], terms.least[rows_j:] = np.inf, np.inf
    _fill_negative_shares(pair, j, state, ragged, terms.least)
    ends = row_ends(i, state)
    begin, end = ends
    for row in range(rows):
        for x in range(row * columns + begin[row], row * columns + end[row]):
            out[x] = np.inf
    least, reached = least_value(terms.least), np.inf
    tabled = state.clusters.of_pair[pair, 0] >= 0
    in_alpha = np.empty((rows if tabled else 0, rows_j)), np.empty(rows + rows_j - 1)
    for turn in range(2):
        odd = (state.pairs[pair].odd + turn) % 2 == 1
        line_i, line_j = beta_lines(pair, i, state, odd)
        if tabled:
            cheapest = alpha_costs(pair, i, state, odd, in_alpha[0])
        else:
            cheapest = step_costs(pair, i, state, odd, in_alpha[1])
        cheapest += least_beta_cost(line_i, line_j, (columns, columns_j), state.power)
        if cheapest + least < reached:
            fill_product_over_beta(ragged, line_i, line_j, state.power, terms.rows)
            reached = _lower_all(RaggedLabels(out, columns, ends), in_alpha, terms)
    unary = state.unary[state.pixels[i].start : state.pixels[i + 1].start]
    less = state.h**2 if state.power == 2 else 0.0
    for row in range(rows):
        for x in range(row * columns + begin[row], row * columns + end[row]):
            out[x] = out[x] - less if unary[x] < np.inf else 0.0


@inlined
def _lower_all(out: RaggedLabels, in_alpha: tuple[Floats, Floats], terms: RightMatrix) -> float:
    """Lower all rows to costs in alpha plus the terms; return the greatest that is left.

    in_alpha: the costs of each row, or without any row, those by steps.
    """
    rows, many, (of_rows, of_steps) = out.ends[0].size, terms.least.size, in_alpha
    left, targets, reached = np.empty((4, many)), np.empty((4, out.columns)), -np.inf
    left[:] = np.inf
    for first in range(0, rows, 4):
        low, high = _take_rows(out, first, targets)
        if low < high:
            for row in range(first, min(first + 4, rows)):
                steps = of_steps[rows - 1 - row : of_steps.size - row]
                costs = of_rows[row] if of_rows.shape[0] else steps
                copy_to(costs, left[row - first, : costs.size])
            reached = max(reached, lower_rows(targets, left, terms, low, high))
            _put_back_rows(out, first, targets, low)
    return reached


@inlined
def _take_rows(rows: RaggedLabels, first: int, targets: Floats) -> tuple[int, int]:
    """Copy the used part of four rows to the targets, -inf elsewhere; return its columns."""
    (begin, end), last = rows.ends, min(first + 4, rows.ends[0].size)
    low, high = int(np.int64(rows.columns)), int(np.int64(0))  # types that do not change below
    for row in range(first, last):
        if begin[row] < end[row]:
            low, high = min(low, begin[row]), max(high, end[row])
    targets[:, : max(high - low, 0)] = -np.inf
    for row in range(first, last):
        for x in range(begin[row], end[row]):
            targets[row - first, x - low] = rows.values[row * rows.columns + x]
    return low, high


@inlined
def _put_back_rows(rows: RaggedLabels, first: int, targets: Floats, low: int) -> None:
    """Copy the targets back to the used part of four rows, of which the first column is `low`."""
    begin, end = rows.ends
    for row in range(first, min(first + 4, begin.size)):
        for x in range(begin[row], end[row]):
            rows.values[row * rows.columns + x] = targets[row - first, x - low]


@inlined
def row_ends(i: int, state: State) -> RowEnds:
    """The first allowed label of each row of a pixel, and the one after the last."""
    low, high = state.pixels[i].row_start, state.pixels[i + 1].row_start
    return state.begin[low:high], state.end[low:high]


@inlined
def _fill_negative_shares(pair: int, j: int, state: State, ragged: RaggedMatrix, least: Floats) -> None:
    """Fill in minus the shares of a pair at its end j, inf at labels that are not allowed.

    Only what is in use is filled in. least: receives the least number of each row, inf without any.
    """
    share, unary = shares_at(pair, j, state), state.unary[state.pixels[j].start : state.pixels[j + 1].start]
    (begin, end), values = ragged.ends, ragged.values
    for row in range(values.shape[0]):
        least[row] = np.inf
        for y in range(begin[row], end[row]):
            at = row * values.shape[1] + y
            values[row, y] = -share[at] if unary[at] < np.inf else np.inf
            least[row] = min(least[row], values[row, y])


@inlined
def size_of(residual: float, power: int) -> float:
    """The square or the absolute value of a residual."""
    return residual * residual if power == 2 else abs(residual)


@inlined
def least_a(a: float) -> float:
    """The A of least size over all jumps of one parity, from the A of one of them."""
    return float(a - _PI * np.rint(a / _PI))


@compiled_inside
def step_costs(pair: int, i: int, state: State, odd: bool, of_steps: Floats) -> float:
    """Fill in 2 A^2 or 2 |A| for labels x of end i and y of the other end; return the least.

    By x - y, from the last x to minus the last y.
    """
    j, last = state.pairs[pair].first + state.pairs[pair].second - i, state.pixels[i].alpha_count - 1
    a = state.pixels[i].alpha - state.pixels[j].alpha
    if odd:
        a += HALF
    for place in range(of_steps.size):
        of_steps[place] = 2 * size_of(least_a(a + state.h * (last - place)), state.power)
    return least_value(of_steps)


@compiled_inside
def alpha_costs(pair: int, i: int, state: State, odd: bool, cost: Floats) -> float:
    """Fill in 2 A^2 or 2 |A|, plus the tables of the pair, at labels x of end i and y of the other end.

    Returns the least.
    """
    last = cost.shape[0] - 1
    of_steps = np.empty(last + cost.shape[1])
    step_costs(pair, i, state, odd, of_steps)
    for x in range(cost.shape[0]):
        copy_to(of_steps[last - x : last - x + cost.shape[1]], cost[x])
    for place in range(2):
        number = state.clusters.of_pair[pair, place]
        if number >= 0:
            _add_table(number, state.pairs[pair].first == i, state, cost)
    return least_of_rows(cost)


@inlined
def least_of_rows(matrix: Floats) -> float:
    """The least number of a matrix."""
    least = np.inf
    for x in range(matrix.shape[0]):
        least = min(least, least_value(matrix[x]))
    return least


@inlined
def _add_table(number: int, upright: bool, state: State, cost: Floats) -> None:
    """Add a table to the costs, turned if their rows are the labels of the pair's second pixel."""
    start = state.clusters.start
    table = state.clusters.tables[start[number] : start[number + 1]]
    rows, columns = cost.shape
    for x in range(rows):
        for y in range(columns):
            cost[x, y] += table[x * columns + y if upright else y * rows + x]


@compiled
def copy_to(values: Floats, target: Floats) -> None:
    """Fill in the target."""
    for x in range(target.size):
        target[x] = values[x]
