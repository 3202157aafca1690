"""Families of terms and rows, placed on an instance: blocks of columns, monomials, values at points."""

from __future__ import annotations

import builtins
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, Protocol

import numpy as np
import sympy as sp

from ..instance.grid import Floats, Ints
from ..instance.instance import Instance
from .declaration import Family
from .monomials import beyond_noise, monomials
from .symbols import SCALARS, SLOTS, IndexSet, numeric, way

Coefficient = float | Floats

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


class Placement(Protocol):
    """A problem as its families see it: instance, blocks of columns, data that symbols may mean, rows."""

    @property
    def instance(self) -> Instance:
        """The instance."""

    @property
    def blocks(self) -> dict[str, Block]:
        """Blocks of columns by name."""

    @property
    def data(self) -> dict[str, Any]:
        """Arrays by the name of their quantity."""

    @property
    def rows(self) -> tuple[PlacedFamily, ...]:
        """Families of rows in row order."""


@dataclass(frozen=True, eq=False)
class Monomial:
    """A monomial of a family: symbols, each as often as its power, and coefficient (one or (count,))."""

    family: PlacedFamily
    symbols: tuple[sp.Symbol, ...]
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

    elements: indices into the family's index set, shape (count,). `terms` is None unless it is a
    polynomial.
    """

    family: Family
    problem: Placement
    elements: Ints

    @property
    def count(self) -> int:
        """Number of rows, or of summands of the objective."""
        return len(self.elements)

    @cached_property
    def variables(self) -> tuple[sp.Symbol, ...]:
        """Symbols that mean columns."""
        slots = SLOTS[self.family.over]
        return tuple(symbol for symbol in self.family.symbols if slots[symbol][0] in self.problem.blocks)

    def column_of(self, symbol: sp.Symbol) -> Ints:
        """Column of the symbol at each element, shape (count,)."""
        block, inside = self.block(symbol), self.inside(symbol)
        own = np.arange(block.count, dtype=np.int32) if inside is None else inside
        return own + np.int32(block.offset)

    def block(self, symbol: sp.Symbol) -> Block:
        """The block of columns that a symbol means."""
        return self.problem.blocks[SLOTS[self.family.over][symbol][0]]

    def inside(self, symbol: sp.Symbol) -> Ints | None:
        """The symbol's place in its block at each element, (count,); None: the element's own."""
        index = way(self.problem.instance, SLOTS[self.family.over][symbol][1])
        if isinstance(index, slice):
            return None if self.everywhere else self.elements
        return index if self.everywhere else index[self.elements]

    @property
    def everywhere(self) -> bool:
        """Whether its elements are the whole index set."""
        return self.family.only is None

    def data(self, expression: sp.Expr) -> Coefficient:
        """Value of an expression free of columns: a number, or an array (count,)."""
        symbols = sorted(expression.free_symbols, key=symbol_name)
        if not symbols:
            return float(expression)
        value = numeric(symbols, expression)(*(self._datum(symbol) for symbol in symbols))
        return value if np.ndim(value) else float(value)

    def _datum(self, symbol: sp.Symbol) -> Any:
        if symbol in SCALARS:
            return getattr(self.problem.instance, SCALARS[symbol])
        name, kind = SLOTS[self.family.over][symbol]
        return self.problem.data[name][way(self.problem.instance, kind)][self.elements]

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
        scale = np.zeros(self.count)
        for term in self.terms or ():
            scale = np.maximum(scale, np.abs(term.coefficient))
        return scale

    @cached_property
    def limit(self) -> Floats:
        """Right side of each row once its constant has moved there, shape (count,)."""
        constant = sum((np.asarray(term.coefficient) for term in self.of_degree(0)), np.zeros(()))
        return np.broadcast_to(0.0 - constant, (self.count,))

    def values(self, point: Floats) -> Floats:
        """The expression (of a row: left minus right side) at a point, shape (count,)."""
        symbols = sorted(self.family.body.free_symbols, key=symbol_name)
        evaluate = numeric(symbols, self.family.body)
        given = (point[self.column_of(s)] if s in self.variables else self._datum(s) for s in symbols)
        return np.broadcast_to(np.asarray(evaluate(*given), dtype=float), (self.count,))

    def excess(self, point: Floats) -> Floats:
        """By how much a point breaks each row, shape (count,): 0 or less where it holds."""
        values = self.values(point)
        by_sense: dict[str, Floats] = {"==": np.abs(values), "<=": values, ">=": -values}
        return by_sense[self.family.sense]


def block_costs(terms: list[Monomial], block: Block) -> tuple[Ints, Floats]:
    """As `merged`, for single columns of a block: one number each, terms added in turn."""
    if not terms:
        return np.zeros((0, 1), np.int32), np.zeros(0)
    total, scale = np.zeros(block.count), np.zeros(block.count)
    for term in terms:
        inside = term.family.inside(term.symbols[0])
        _add(total, inside, term.coefficient)
        _add(scale, inside, term.family.scale)
    kept = np.nonzero(beyond_noise(total, scale))[0]
    return (block.offset + kept).astype(np.int32)[:, None], total[kept]


def _add(sums: Floats, inside: Ints | None, values: Coefficient) -> None:
    if inside is None:
        sums += values
    else:
        np.add.at(sums, inside, values)


def symbol_name(symbol: sp.Symbol) -> str:
    """Name of a symbol, as text: the order of symbols."""
    return str(symbol.name)
