"""Families of terms and rows, placed on an instance: blocks of columns, monomials and their sums, values."""

from __future__ import annotations

import builtins
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, reduce
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..instance.domain import Bools, Floats, Ints
from ..instance.instance import Instance
from .declaration import Family
from .expressions import Expression, Functions, Symbol
from .symbols import SCALARS, IndexSet, index_map, values_at

Coefficient = float | Floats
Monomials = tuple[tuple[tuple[Symbol, ...], Expression], ...]
"""Symbols, each repeated as often as its power, and a coefficient without these symbols."""

_NOISE: Final = 1e-12
"""Rounding noise relative to an element's largest coefficient: cancelled terms, angles of 1e-16."""
ANY_DEGREE: Final = 99
"""Degree of a function that is not a polynomial."""


@dataclass(frozen=True)
class Block:
    """A block of columns: offset of the first one, bounds (count,), and whether they are integer."""

    name: str
    over: IndexSet
    offset: int
    lower: Floats
    upper: Floats
    integer: bool

    @property
    def count(self) -> int:
        """Number of columns."""
        return len(self.lower)

    @property
    def slice(self) -> builtins.slice:
        """The columns as a slice of a point."""
        return slice(self.offset, self.offset + self.count)


@dataclass(frozen=True, eq=False)
class Monomial:
    """A monomial of a family: symbols, each as often as its power, and coefficient (one or (count,))."""

    family: PlacedFamily
    symbols: tuple[Symbol, ...]
    coefficient: Coefficient

    @property
    def factors(self) -> tuple[Ints, ...]:
        """Columns of its symbols, one array (count,) each; created at every call to save memory."""
        return tuple(map(self.family.column_of, self.symbols))

    @property
    def degree(self) -> int:
        """Number of factors."""
        return len(self.symbols)


@dataclass(frozen=True, eq=False)
class PlacedFamily:
    """A family placed on an instance: where its elements are and which columns its symbols mean.

    elements: indices into the family's index set, shape (count,). blocks, quantities: columns and arrays
    that symbols may mean, by name. `terms` is None unless it is a polynomial.
    """

    family: Family
    elements: Ints
    instance: Instance
    blocks: dict[str, Block]
    quantities: dict[str, Any]

    @property
    def count(self) -> int:
        """Number of rows, or of summands of the objective."""
        return len(self.elements)

    @cached_property
    def variables(self) -> tuple[Symbol, ...]:
        """Symbols that mean columns."""
        slots = self.family.slots
        return tuple(symbol for symbol in self.family.symbols if slots[symbol][0] in self.blocks)

    def column_of(self, symbol: Symbol) -> Ints:
        """Column of the symbol at each element, shape (count,)."""
        block, inside = self.block(symbol), self.inside(symbol)
        places = np.arange(block.count, dtype=np.int32) if inside is None else inside
        return places + np.int32(block.offset)

    def block(self, symbol: Symbol) -> Block:
        """The block of columns that a symbol means."""
        return self.blocks[self.family.slots[symbol][0]]

    def inside(self, symbol: Symbol) -> Ints | None:
        """The symbol's place in its block at each element, (count,); None: the element's own."""
        index = index_map(self.instance, self.family.slots[symbol][1])
        if isinstance(index, slice):
            return None if self.covers_index_set else self.elements
        return index if self.covers_index_set else index[self.elements]

    @property
    def covers_index_set(self) -> bool:
        """Whether its elements are the whole index set."""
        return self.family.only is None

    def data(self, expression: Expression) -> Coefficient:
        """Value of an expression free of columns: a number, or an array (count,)."""
        value = expression.evaluate({symbol: self.datum(symbol) for symbol in expression.symbols})
        return value if np.ndim(value) else float(value)

    def datum(self, symbol: Symbol) -> Any:
        """Value of a symbol that means no column: a number, or an array (count,)."""
        if symbol in SCALARS:
            return getattr(self.instance, SCALARS[symbol])
        name, kind = self.family.slots[symbol]
        values = values_at(self.instance, kind, self.quantities[name])
        return values if self.covers_index_set else values[self.elements]

    @cached_property
    def terms(self) -> tuple[Monomial, ...] | None:
        """Its monomials, the constant one included, or None when it is no polynomial."""
        split = monomials(self.family, self.variables)
        if split is None:
            return None
        return tuple(Monomial(self, symbols, self.data(c)) for symbols, c in split)

    @property
    def degree(self) -> int:
        """Degree of the polynomial; 99 for other functions."""
        return ANY_DEGREE if self.terms is None else max((term.degree for term in self.terms), default=0)

    def of_degree(self, degree: int) -> tuple[Monomial, ...]:
        """Its monomials of that degree."""
        return tuple(term for term in self.terms or () if term.degree == degree)

    @cached_property
    def scale(self) -> Floats:
        """The largest coefficient of each element's monomials, (count,): the scale of rounding errors."""
        sizes = sorted((np.abs(term.coefficient) for term in self.terms or ()), key=np.ndim)
        return np.broadcast_to(reduce(np.maximum, sizes, np.zeros(())), (self.count,))

    @cached_property
    def limit(self) -> Floats:
        """Right side of each row once its constant has moved there, shape (count,)."""
        constant = sum((np.asarray(term.coefficient) for term in self.of_degree(0)), np.zeros(()))
        return np.broadcast_to(0.0 - constant, (self.count,))

    def values(self, point: Floats) -> Floats:
        """The expression (of a row: left minus right side) at a point, shape (count,)."""
        values = {
            symbol: point[self.column_of(symbol)] if symbol in self.variables else self.datum(symbol)
            for symbol in self.family.body.symbols
        }
        return np.broadcast_to(np.asarray(self.family.body.evaluate(values), dtype=float), (self.count,))

    def over_objects(
        self, expression: Expression, columns: Sequence[Any], functions: Functions
    ) -> Iterator[Any]:
        """An expression at each element over objects with operators, such as variables of a solver package.

        columns: one object for each column of the problem. functions: of such objects.
        """
        values = {symbol: self._objects(symbol, columns) for symbol in expression.symbols}
        elements = zip(*values.values(), strict=True) if values else [()] * self.count
        return (expression.evaluate(dict(zip(values, each, strict=True)), functions) for each in elements)

    def _objects(self, symbol: Symbol, columns: Sequence[Any]) -> list[Any]:
        if symbol in self.variables:
            return [columns[column] for column in self.column_of(symbol).tolist()]
        return np.broadcast_to(self.datum(symbol), (self.count,)).tolist()  # type: ignore[no-any-return]

    def excess(self, point: Floats) -> Floats:
        """By how much a point breaks each row, shape (count,): 0 or less where it holds."""
        values = self.values(point)
        by_sense: dict[str, Floats] = {"==": np.abs(values), "<=": values, ">=": -values}
        return by_sense[self.family.sense]


def row_sides(families: Iterable[PlacedFamily]) -> tuple[Floats, Floats]:
    """Left and right sides of all rows, constants moved there; -inf and inf without a side."""
    lower, upper = [np.zeros(0)], [np.zeros(0)]
    for family in families:
        sense, nothing = family.family.sense, np.full(family.count, np.inf)
        lower.append(-nothing if sense == "<=" else family.limit)
        upper.append(nothing if sense == ">=" else family.limit)
    return np.concatenate(lower) + 0.0, np.concatenate(upper) + 0.0


@cache
def monomials(family: Family, variables: tuple[Symbol, ...]) -> Monomials | None:
    """The monomials of a declaration by degree, constant included; None if it is not a polynomial.

    Declarations are few and fixed: each is expanded once, for any number of instances.
    """
    terms = family.body.polynomial(variables)
    return None if terms is None else tuple(terms.items())


def merge_terms(
    families: Iterable[PlacedFamily], degree: int, columns: int, *, up_to: int = ANY_DEGREE
) -> tuple[Ints, Floats]:
    """Terms of a degree of a sum, each set of columns once: columns (k, degree), coefficients (k,).

    columns: number of the problem's columns. up_to: greatest degree of the families that are counted.
    """
    chosen = [family for family in families if family.degree <= up_to]
    terms = [(term, family) for family in chosen for term in family.of_degree(degree)]
    coefficients = [np.broadcast_to(term.coefficient, (family.count,)) for term, family in terms]
    if degree == 0:
        total = sum(float(np.sum(values)) for values in coefficients)
        return np.zeros((1, 0), np.int32), np.array([total])
    if not terms:
        return np.zeros((0, degree), np.int32), np.zeros(0)
    index = np.concatenate([sort_factors(term.factors) for term, _ in terms])
    scale = np.concatenate([family.scale for _, family in terms])
    return merge_monomials(index, np.concatenate(coefficients), scale, columns)


def sort_factors(factors: tuple[Ints, ...]) -> Ints:
    """Columns of each monomial in ascending order, shape (count, degree)."""
    if len(factors) == 2:  # nearly all monomials, and faster than sorting rows
        return np.stack([np.minimum(*factors), np.maximum(*factors)], axis=1)
    return np.sort(np.stack(factors, axis=1), axis=1)


def merge_monomials(index: Ints, coefficient: Floats, scale: Floats, columns: int) -> tuple[Ints, Floats]:
    """Sums over equal rows of `index`, sorted, without noise. columns: a number above every index."""
    key = index[:, 0].astype(np.int64)
    for factor in range(1, index.shape[1]):
        key = key * columns + index[:, factor]
    _, place, rank = np.unique(key, return_index=True, return_inverse=True)
    total, largest = (_sums_by_rank(values, rank, len(place)) for values in (coefficient, scale))
    nonzero = exceeds_noise(total, largest)
    return index[place[nonzero]], total[nonzero]


def _sums_by_rank(values: Floats, rank: NDArray[Any], count: int) -> Floats:
    return np.bincount(rank, weights=values, minlength=count).astype(np.float64, copy=False)


def exceeds_noise(total: Floats, scale: Floats) -> Bools:
    """Whether sums exceed rounding, for terms of that scale."""
    return np.abs(total) > _NOISE * scale
