"""The compiled (min,+) product of labels with the part of a pair's cost that depends on beta.

In the 2-norm it is the lower envelope of parabolas, which takes a time linear in their number: Felzenszwalb
and Huttenlocher, Distance transforms of sampled functions, Theory of Computing 8 (2012).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..instance.grid import Floats
from ..processes.compiled import compiled
from .min_plus import lower_row, terms_of
from .state import Ends, State

Line = tuple[float, float]
"""First value and step of equally spaced numbers."""


class Given(NamedTuple):
    """A matrix by alpha and beta, and the part of each row that is in use."""

    values: Floats
    ends: Ends


class _Room(NamedTuple):
    """Room for parabolas of one width with their centres at 0, 1, ..., and for their envelope.

    values: least value of each. kept: those of the envelope; begins: where each begins. slopes: half of the
    reciprocal of the slope's change over each distance.
    """

    values: Floats
    kept: NDArray[np.int64]
    begins: Floats
    slopes: Floats


@compiled
def betas(pair: int, i: int, state: State, odd: bool) -> tuple[Line, Line]:
    """The betas of end i of a pair, and those of the other end, negative for odd jumps."""
    first = state.beta[state.first[pair] + state.second[pair] - i]
    return (state.beta[i], state.h), ((-first, -state.h) if odd else (first, state.h))


@compiled
def least_cost(mine: Line, other: Line, counts: tuple[int, int], power: int) -> float:
    """A lower bound of 2 B^2 or 2 |B| over all betas, of which there are so many."""
    high, end = mine[0] + mine[1] * (counts[0] - 1), other[0] + other[1] * (counts[1] - 1)
    away = max(0.0, mine[0] - max(other[0], end), min(other[0], end) - high)
    return 2 * away * away if power == 2 else 2 * away


@compiled
def over_beta(given: Given, mine: Line, other: Line, power: int, out: Floats) -> None:
    """Fill in the least over y of given[row, y] + 2 B^2 or 2 |B|, at betas x of one end."""
    if power == 2:
        backwards = other[1] < 0
        first = other[0] + other[1] * (given.values.shape[1] - 1) if backwards else other[0]
        _over_squares(given, (first - mine[0]) / mine[1], 2 * mine[1] * mine[1], backwards, out)
    else:
        _over_sizes(given, mine, other, out)


@compiled
def _over_squares(given: Given, apart: float, weight: float, backwards: bool, out: Floats) -> None:
    """Fill in the least over y of given[row, y] + weight (x - y - apart)^2, counting y backwards or not."""
    columns, ends = given.values.shape[1], given.ends
    room = _Room(np.empty(columns), np.empty(columns, np.int64), np.empty(columns + 1), np.empty(columns))
    for y in range(1, columns):
        room.slopes[y] = 0.5 / (weight * y)
    for row in range(given.values.shape[0]):
        begin, end = ends[0][row], ends[1][row]
        if backwards:
            begin, end = columns - end, columns - begin
        for y in range(begin, end):
            room.values[y] = given.values[row, columns - 1 - y if backwards else y]
        if _find_envelope(room, begin, end) > 0:
            _fill_in(room, apart, weight, out[row])
        else:
            out[row] = np.inf


@compiled
def _find_envelope(room: _Room, first: int, end: int) -> int:
    """Find those of some parabolas of finite value that are the least somewhere; return their number."""
    values, kept, begins = room.values, room.kept, room.begins
    count = 0
    for y in range(first, end):
        if values[y] == np.inf:
            continue
        begin = -np.inf
        while count > 0:
            z = kept[count - 1]
            begin = (values[y] - values[z]) * room.slopes[y - z] + 0.5 * (y + z)
            if begin > begins[count - 1]:
                break
            count -= 1
        kept[count] = y
        begins[count] = begin if count > 0 else -np.inf
        count += 1
    begins[count] = np.inf
    return count


@compiled
def _fill_in(room: _Room, apart: float, weight: float, out: Floats) -> None:
    """Fill in the envelope."""
    piece = 0
    for x in range(out.size):
        while room.begins[piece + 1] < x - apart:
            piece += 1
        away = x - apart - room.kept[piece]
        out[x] = room.values[room.kept[piece]] + weight * away * away


@compiled
def _over_sizes(given: Given, mine: Line, other: Line, out: Floats) -> None:
    """Fill in the least over y of given[row, y] + 2 |x - y|."""
    cost = np.empty((given.values.shape[1], out.shape[1]))
    for y in range(cost.shape[0]):
        for x in range(cost.shape[1]):
            cost[y, x] = 2 * abs(mine[0] + mine[1] * x - (other[0] + other[1] * y))
    terms = terms_of(cost)
    for row in range(given.values.shape[0]):
        begin, end = given.ends[0][row], given.ends[1][row]
        out[row] = np.inf
        if begin < end:
            lower_row(out[row], given.values[row, begin:end], terms, begin, 0)
