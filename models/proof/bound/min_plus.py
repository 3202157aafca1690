"""Compiled (min,+) products: of two matrices, and of labels with the part of a pair's cost in beta.

Products over beta are distance transforms, which take a time linear in the number of labels: in the 2-norm
the lower envelope of parabolas, and for absolute values a sweep each way (Felzenszwalb and Huttenlocher,
Distance transforms of sampled functions, Theory of Computing 8, 2012).
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...instance.domain import Floats
from ...processes.compilation import compiled, compiled_in_any_order, inlined
from .state import RowEnds, State

_BEFORE: Final = 1  # terms on both sides of the best one of a row that come before the others


class RightMatrix(NamedTuple):
    """The right matrix of a product, a lower bound of each of its rows, and room for a sum with each."""

    rows: Floats
    least: Floats
    sums: Floats


@compiled
def lower_rows(targets: Floats, left: Floats, terms: RightMatrix, begin: int, end: int) -> float:
    """Lower four rows to the least of left[:, y] + rows[y], without y that cannot lower any of them.

    targets (4, t), left (4, n), of terms (n, ...) with n >= 4. begin, end: the columns of the terms that
    belong to the first columns of the targets. Returns the greatest of these that is left; a target of -inf
    stays.
    """
    sums, many, width, zero = (
        terms.sums,
        terms.least.size,
        end - begin,
        int(np.int64(0)),
    )  # a literal would be compiled for itself
    lowest, reached = _add_up_least(left, terms.least, sums), _most_of_rows(targets, width)
    if lowest >= reached:
        return reached
    best = 0
    while sums[best] > lowest:
        best += 1
    _lower_four(targets, left, terms.rows, zero, max(0, min(best - _BEFORE, many - 4)), begin, end)
    reached = _most_of_rows(targets, width)
    for first in range(0, many, 4):
        y = min(first, many - 4)
        if min(sums[y], sums[y + 1], sums[y + 2], sums[y + 3]) < reached:
            _lower_four(targets, left, terms.rows, zero, y, begin, end)
    return _most_of_rows(targets, width)


@compiled
def min_plus(left: Floats, right: Floats) -> Floats:
    """The (min,+) product of two matrices of which nearly all terms are needed.

    Four rows with four terms at a time, so that few numbers are loaded and stored.
    """
    out, zero = np.empty((left.shape[0], right.shape[1])), int(np.int64(0))
    out[:] = np.inf
    rows, terms = left.shape
    if rows < 4 or terms < 4:
        for row in range(rows):
            for y in range(terms):
                _lower(out[row], right[y], left[row, y])
        return out
    for begin in range(0, rows, 4):
        row = min(begin, rows - 4)
        first, end = _finite_columns(left, row)
        for y in range(first, end, 4):
            _lower_four(out, left, right, row, min(y, terms - 4), zero, right.shape[1])
    return out


@inlined
def _finite_columns(left: Floats, row: int) -> tuple[int, int]:
    """The first column with a number below inf in four rows of a matrix, and the one after the last."""
    first, end = left.shape[1], 0
    for line in range(row, row + 4):
        y, last = 0, left.shape[1]
        while y < first and left[line, y] == np.inf:
            y += 1
        while last > end and left[line, last - 1] == np.inf:
            last -= 1
        first, end = min(first, y), max(end, last)
    return first, end


# Minima do not depend on the order of their terms; in any order, processors find several at once.


@compiled_in_any_order
def least_value(values: Floats) -> float:
    """The least value; infinity without any."""
    least = np.inf
    for x in range(values.size):
        least = min(least, values[x])
    return least


@compiled_in_any_order
def _lower(target: Floats, values: Floats, plus: float) -> None:
    """Lower the target to the values + plus."""
    for x in range(target.size):
        target[x] = min(target[x], values[x] + plus)


@compiled_in_any_order
def _most_of_rows(rows: Floats, columns: int) -> float:
    """The greatest value in the first columns of four rows."""
    most = -np.inf
    for x in range(columns):
        most = max(most, rows[0, x], rows[1, x], rows[2, x], rows[3, x])
    return most


@compiled_in_any_order
def _add_up_least(rows: Floats, others: Floats, sums: Floats) -> float:
    """Fill in the sums of the least of four rows and of an array; return the least."""
    least = np.inf
    for x in range(others.size):
        sums[x] = min(rows[0, x], rows[1, x], rows[2, x], rows[3, x]) + others[x]
        least = min(least, sums[x])
    return least


@compiled_in_any_order
def _lower_four(  # noqa: PLR0917 - a tuple would be compiled once for each literal in it
    out: Floats, left: Floats, right: Floats, row: int, y: int, begin: int, end: int
) -> None:
    """Lower the first columns of four rows of a product to four of its terms: few loads and stores.

    row, y: the first row and the first term. begin, end: the columns of `right`.
    """
    width = end - begin
    o0, o1, o2, o3 = out[row, :width], out[row + 1, :width], out[row + 2, :width], out[row + 3, :width]
    r0, r1, r2, r3 = (
        right[y, begin:end], right[y + 1, begin:end], right[y + 2, begin:end], right[y + 3, begin:end]
    )  # fmt: skip
    a0, a1, a2, a3 = left[row, y], left[row, y + 1], left[row, y + 2], left[row, y + 3]
    b0, b1, b2, b3 = left[row + 1, y], left[row + 1, y + 1], left[row + 1, y + 2], left[row + 1, y + 3]
    c0, c1, c2, c3 = left[row + 2, y], left[row + 2, y + 1], left[row + 2, y + 2], left[row + 2, y + 3]
    d0, d1, d2, d3 = left[row + 3, y], left[row + 3, y + 1], left[row + 3, y + 2], left[row + 3, y + 3]
    for x in range(width):
        v0, v1, v2, v3 = r0[x], r1[x], r2[x], r3[x]
        o0[x] = min(o0[x], v0 + a0, v1 + a1, v2 + a2, v3 + a3)
        o1[x] = min(o1[x], v0 + b0, v1 + b1, v2 + b2, v3 + b3)
        o2[x] = min(o2[x], v0 + c0, v1 + c1, v2 + c2, v3 + c3)
        o3[x] = min(o3[x], v0 + d0, v1 + d1, v2 + d2, v3 + d3)


Line = tuple[float, float]
"""First value and step of equally spaced numbers."""


class RaggedMatrix(NamedTuple):
    """A matrix by alpha and beta, and the part of each row that is in use."""

    values: Floats
    ends: RowEnds


class _Room(NamedTuple):
    """Room for parabolas of one width with their centres at 0, 1, ..., and for their envelope.

    values: least value of each. envelope: those in it; begins: where each of them begins. slopes: half of
    the reciprocal of the slope's change over each distance.
    """

    values: Floats
    envelope: NDArray[np.int64]
    begins: Floats
    slopes: Floats


@inlined
def beta_lines(pair: int, i: int, state: State, odd: bool) -> tuple[Line, Line]:
    """The betas of end i of a pair, and those of the other end, negative for odd jumps."""
    first = state.pixels[state.pairs[pair].first + state.pairs[pair].second - i].beta
    return (state.pixels[i].beta, state.h), ((-first, -state.h) if odd else (first, state.h))


@inlined
def least_beta_cost(line_i: Line, line_j: Line, counts: tuple[int, int], power: int) -> float:
    """A lower bound of 2 B^2 or 2 |B| over all betas, of which there are so many."""
    high, end = line_i[0] + line_i[1] * (counts[0] - 1), line_j[0] + line_j[1] * (counts[1] - 1)
    away = max(0.0, line_i[0] - max(line_j[0], end), min(line_j[0], end) - high)
    return 2 * away * away if power == 2 else 2 * away


@compiled
def fill_product_over_beta(labels: RaggedMatrix, line_i: Line, line_j: Line, power: int, out: Floats) -> None:
    """Fill in the least over y of labels[row, y] + 2 B^2 or 2 |B|, at betas x of one end."""
    backwards, h = line_j[1] < 0, line_i[1]
    first = line_j[0] + line_j[1] * (labels.values.shape[1] - 1) if backwards else line_j[0]
    if power == 2:
        _fill_over_squares(labels, (first - line_i[0]) / h, 2 * h * h, backwards, out)
    else:
        _fill_over_sizes(labels, (first - line_i[0]) / h, 2 * h, backwards, out)


@inlined
def _fill_over_squares(
    labels: RaggedMatrix, apart: float, weight: float, backwards: bool, out: Floats
) -> None:
    """Fill in the least over y of labels[row, y] + weight (x - y - apart)^2, counting y backwards or not."""
    columns, ends = labels.values.shape[1], labels.ends
    room = _Room(np.empty(columns), np.empty(columns, np.int64), np.empty(columns + 1), np.empty(columns))
    for y in range(1, columns):
        room.slopes[y] = 0.5 / (weight * y)
    for row in range(labels.values.shape[0]):
        begin, end = ends[0][row], ends[1][row]
        if backwards:
            begin, end = columns - end, columns - begin
        for y in range(begin, end):
            room.values[y] = labels.values[row, columns - 1 - y if backwards else y]
        if _find_envelope(room, begin, end) > 0:
            _fill_from_envelope(room, apart, weight, out[row])
        else:
            out[row] = np.inf


@inlined
def _find_envelope(room: _Room, first: int, end: int) -> int:
    """Find those of some parabolas of finite value that are the least somewhere; return their number."""
    values, envelope, begins = room.values, room.envelope, room.begins
    count = 0
    for y in range(first, end):
        if values[y] == np.inf:
            continue
        begin = -np.inf
        while count > 0:
            z = envelope[count - 1]
            begin = (values[y] - values[z]) * room.slopes[y - z] + 0.5 * (y + z)
            if begin > begins[count - 1]:
                break
            count -= 1
        envelope[count] = y
        begins[count] = begin if count > 0 else -np.inf
        count += 1
    begins[count] = np.inf
    return count


@inlined
def _fill_from_envelope(room: _Room, apart: float, weight: float, out: Floats) -> None:
    """Fill in the envelope."""
    piece = 0
    for x in range(out.size):
        while room.begins[piece + 1] < x - apart:
            piece += 1
        away = x - apart - room.envelope[piece]
        out[x] = room.values[room.envelope[piece]] + weight * away * away


@inlined
def _fill_over_sizes(labels: RaggedMatrix, apart: float, weight: float, backwards: bool, out: Floats) -> None:
    """Fill in the least over y of labels[row, y] + weight |x - y - apart|, counting y backwards or not."""
    columns, ends = labels.values.shape[1], labels.ends
    values = np.empty(columns)
    for row in range(labels.values.shape[0]):
        begin, end = ends[0][row], ends[1][row]
        if backwards:
            begin, end = columns - end, columns - begin
        for y in range(begin, end):
            values[y] = labels.values[row, columns - 1 - y if backwards else y]
        y, least = begin, np.inf  # of those y that are not above x
        for x in range(out.shape[1]):
            while y < end and y + apart <= x:
                least = min(least, values[y] - weight * (y + apart))
                y += 1
            out[row, x] = least + weight * x
        y, least = end - 1, np.inf  # of those that are not below
        for x in range(out.shape[1] - 1, -1, -1):
            while y >= begin and y + apart >= x:
                least = min(least, values[y] + weight * (y + apart))
                y -= 1
            out[row, x] = min(out[row, x], least - weight * x)
