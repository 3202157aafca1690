"""Coefficients by index: as programs read them, and as OSiL lists them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...models.instance.domain import Floats, Ints


class Terms(NamedTuple):
    """Coefficients by index: at (k, indices) and value (k,); sorted, each index once, no zeros."""

    at: Ints
    value: Floats


def merged_terms(
    at: Iterable[Sequence[int]], value: Iterable[float], *, indices: int, products: int = 0
) -> Terms:
    """The terms of that many indices; the last `products` have no order among themselves."""
    index = np.array(list(at) if not isinstance(at, np.ndarray) else at, dtype=np.int64).reshape(-1, indices)
    values = np.array(list(value) if not isinstance(value, np.ndarray) else value, dtype=np.float64)
    if products:
        index[:, indices - products :] = np.sort(index[:, indices - products :], axis=1)
    unique, inverse = np.unique(index, axis=0, return_inverse=True)
    total = np.zeros(len(unique))
    np.add.at(total, inverse.ravel(), values)
    return Terms(unique[total != 0], total[total != 0])


def terms_of_entries(entries: Sequence[tuple[Any, ...]], *, indices: int, products: int = 0) -> Terms:
    """The terms of entries (index, ..., coefficient)."""
    at, value = [entry[:-1] for entry in entries], [entry[-1] for entry in entries]
    return merged_terms(at, value, indices=indices, products=products)


def terms_of_triangle(row: Ints, column: Ints, value: Floats) -> Terms:
    """The terms of x'Qx/2, given by one triangle."""
    halved = np.where(row == column, value / 2, value)
    return merged_terms(np.stack([row, column], axis=1), halved, indices=2, products=2)
