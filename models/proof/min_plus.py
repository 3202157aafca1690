"""Compiled (min,+) products of matrices, which leave out terms that are nowhere the least."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from ..instance.grid import Floats
from ..processes.compiled import compiled, compiled_if_needed, compiled_in_any_order

_NEAR: Final = 1  # terms on both sides of the best one of a row that come before the others


class Terms(NamedTuple):
    """The right matrix of a product, a lower bound of each of its rows, and room for a sum with each.

    Rows whose bound is inf are not used.
    """

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
def lower_row(target: Floats, left: Floats, terms: Terms, first: int, begin: int) -> float:
    """Lower the target to the least of left[y] + rows[first + y, begin:], without y that cannot lower it.

    Returns the greatest that is left.
    """
    sums, end = terms.sums, begin + target.size
    lowest = _add_up(left, terms.least[first : first + left.size], sums)
    best = 0
    while sums[best] > lowest:
        best += 1
    near, far = max(best - _NEAR, 0), min(best + _NEAR + 1, left.size)
    for y in range(near, far):
        if sums[y] < np.inf:
            _lower(target, terms.rows[first + y, begin:end], left[y])
    reached = _most_of(target)
    for y in range(left.size):
        if sums[y] < reached and not near <= y < far:
            _lower(target, terms.rows[first + y, begin:end], left[y])
    return _most_of(target)


@compiled_if_needed
def min_plus(left: Floats, right: Floats) -> Floats:
    """The (min,+) product of two matrices."""
    out = np.empty((left.shape[0], right.shape[1]))
    out[:] = np.inf
    terms = terms_of(right)
    for row in range(out.shape[0]):
        lower_row(out[row], left[row], terms, 0, 0)
    return out


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
