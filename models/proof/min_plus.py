"""Compiled (min,+) products of matrices, which leave out terms that are nowhere the least."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from ..instance.grid import Floats
from ..processes.compiled import compiled, compiled_if_needed, compiled_in_any_order
from .lattice import Starts

_NEAR: Final = 1  # terms on both sides of the best one of a row that come before the others


@compiled
def lower_by_product(left: Floats, right: Floats, out: Floats, begin: Starts, end: Starts) -> float:
    """Lower a part of each row of `out` to the (min,+) product of two matrices; return the greatest left."""
    terms = terms_of(right)
    most = -np.inf
    for row in range(out.shape[0]):
        if begin[row] < end[row]:
            target = out[row, begin[row] : end[row]]
            lower_row(target, left[row], terms, 0, begin[row])
            most = max(most, _most_of(target))
    return most


class Terms(NamedTuple):
    """The right matrix of a product, the least value of each of its rows, and room for a sum with each."""

    rows: Floats
    least: Floats
    sums: Floats


@compiled
def terms_of(rows: Floats) -> Terms:
    """The right matrix of a product."""
    least = np.empty(rows.shape[0])
    for y in range(least.size):
        least[y] = least_of(rows[y])
    return Terms(rows, least, np.empty(least.size))


@compiled
def lower_row(target: Floats, left: Floats, terms: Terms, first: int, begin: int) -> None:
    """Lower the target to the least of left[y] + rows[first + y, begin:], without y that cannot lower it."""
    sums, end = terms.sums, begin + target.size
    lowest = _add_up(left, terms.least[first : first + left.size], sums)
    best = 0
    while sums[best] > lowest:
        best += 1
    near, far = max(best - _NEAR, 0), min(best + _NEAR + 1, left.size)
    for y in range(near, far):
        _lower(target, terms.rows[first + y, begin:end], left[y])
    reached = _most_of(target)
    for y in range(left.size):
        if sums[y] < reached and not near <= y < far:
            _lower(target, terms.rows[first + y, begin:end], left[y])


@compiled_if_needed
def min_plus(left: Floats, right: Floats) -> Floats:
    """The (min,+) product of two matrices."""
    out = np.empty((left.shape[0], right.shape[1]))
    out[:] = np.inf
    lower_by_product(left, right, out, np.zeros(len(out), np.int64), np.full(len(out), out.shape[1]))
    return out


@compiled
def finite_part(values: Floats) -> tuple[int, int]:
    """The places of the first value below infinity, and after the last one; twice 0 without any."""
    end = values.size
    while end > 0 and values[end - 1] == np.inf:
        end -= 1
    begin = 0
    while begin < end and values[begin] == np.inf:
        begin += 1
    return begin, end


# Minima do not depend on the order of their terms; in any order, processors find several at once.


@compiled_in_any_order
def least_of(values: Floats) -> float:
    """The least value; infinity without any."""
    least = np.inf
    for x in range(values.size):
        least = min(least, values[x])
    return least


@compiled_in_any_order
def _most_of(values: Floats) -> float:
    most = -np.inf
    for x in range(values.size):
        most = max(most, values[x])
    return most


@compiled_in_any_order
def _add_up(values: Floats, others: Floats, sums: Floats) -> float:
    """Fill in the sums of two arrays; return the least."""
    least = np.inf
    for x in range(values.size):
        sums[x] = values[x] + others[x]
        least = min(least, sums[x])
    return least


@compiled_in_any_order
def _lower(target: Floats, values: Floats, plus: float) -> None:
    """Lower the target to the values + plus."""
    for x in range(target.size):
        target[x] = min(target[x], values[x] + plus)
