"""Monomials of a declaration, and the sums of equal ones over all its elements."""

from __future__ import annotations

from functools import cache
from typing import Any, Final

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ..instance.grid import Bools, Floats, Ints
from .declaration import Family

Monomials = tuple[tuple[tuple[sp.Symbol, ...], sp.Expr], ...]
"""Symbols, each repeated as often as its power, and a coefficient without these symbols."""

_NOISE: Final = 1e-12
"""Rounding noise relative to an element's largest coefficient: cancelled terms, angles of 1e-16."""


@cache
def monomials(family: Family, variables: tuple[sp.Symbol, ...]) -> Monomials | None:
    """The monomials of a declaration by degree, constant included; None if it is not a polynomial.

    Declarations are few and fixed: SymPy expands each once, for any number of instances.
    """
    if not variables:
        return (((), family.body),)
    try:
        terms = sp.Poly(family.body, *variables).terms()
    except sp.PolynomialError:
        return None
    terms = sorted(terms, key=lambda term: (sum(term[0]), tuple(-power for power in term[0])))
    return tuple(
        (tuple(s for s, power in zip(variables, powers, strict=True) for _ in range(power)), value)
        for powers, value in terms
        if value != 0
    )


def ordered(factors: tuple[Ints, ...]) -> Ints:
    """Columns of each monomial in ascending order, shape (count, degree)."""
    if len(factors) == 2:  # nearly all monomials, and faster than sorting rows
        return np.stack([np.minimum(*factors), np.maximum(*factors)], axis=1)
    return np.sort(np.stack(factors, axis=1), axis=1)


def merged(index: Ints, coefficient: Floats, scale: Floats, columns: int) -> tuple[Ints, Floats]:
    """Sums over equal rows of `index`, sorted, without noise. columns: a number above every index."""
    key = index[:, 0].astype(np.int64)
    for factor in range(1, index.shape[1]):
        key = key * columns + index[:, factor]
    place, rank = ranked(key)
    total, largest = (_sums(values, rank, len(place)) for values in (coefficient, scale))
    kept = beyond_noise(total, largest)
    return index[place[kept]], total[kept]


def _sums(values: Floats, rank: NDArray[np.intp], count: int) -> Floats:
    return np.bincount(rank, weights=values, minlength=count).astype(np.float64, copy=False)


def beyond_noise(total: Floats, scale: Floats) -> Bools:
    """Whether sums exceed rounding, for terms of that scale."""
    return np.abs(total) > _NOISE * scale


def ranked(values: NDArray[Any]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Positions of the distinct values in ascending order, and the rank of every value among them."""
    order = np.argsort(values, kind="stable")
    ascending = values[order]
    new = np.ones(len(values), dtype=bool)
    np.not_equal(ascending[1:], ascending[:-1], out=new[1:])
    rank = np.empty(len(values), dtype=np.intp)
    rank[order] = np.cumsum(new) - 1
    return order[new], rank
