"""Check of a written file against its problem: counts while writing, and expected counts.

A writer counts columns, rows and coefficients when it makes their bytes (`records.Counted`). At its end it
compares these counts with `Expected`, which derives them from the declaration and from arrays of its own. A
difference is an error before the file gets its name.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from functools import cache, cached_property

import numpy as np
import sympy as sp

from ...models.errors import ConsistencyError
from ...models.formulations.declaration import Family
from ...models.formulations.families import (
    Monomial,
    Monomials,
    PlacedFamily,
    add_at,
    beyond_noise,
    monomials,
)
from ...models.formulations.problem import Problem
from ...models.formulations.symbols import elements
from ...models.instance.grid import Floats

_EXACT = 1e-9
"""Largest difference of two sums of coefficients, relative to the sum of their absolute values."""


def check(written: Counter[str], expected: Mapping[str, int]) -> None:
    """Raise ConsistencyError unless both counts agree for everything in `expected`."""
    for what, count in expected.items():
        if written[what] != count:
            raise ConsistencyError(f"holds {written[what]} {what}, but the problem has {count}")


class Expected:
    """Counts of a problem, from its twin, which shares no computed array with the written one.

    Up to `degree` the objective's families are written as coefficients; those beyond it as declared.
    """

    def __init__(self, problem: Problem, degree: int = 2) -> None:
        self._problem = problem.twin
        self._degree = degree

    @property
    def columns(self) -> int:
        """Number of columns: the elements of every variable's index set."""
        problem = self._problem
        return sum(
            elements(problem.instance, problem.variable(name).over) for name in problem.formulation.variables
        )

    @property
    def rows(self) -> int:
        """Number of rows: the elements of every family, or those with the parity that it names."""
        return sum(map(self._elements, self._problem.formulation.rows))

    def _elements(self, family: Family) -> int:
        if family.only is None:
            return elements(self._problem.instance, family.over)
        name, parity = family.only
        return int(np.count_nonzero(self._problem.data[name] & 1 == parity))

    @cached_property
    def _expanded(self) -> list[PlacedFamily]:
        return [family for family in self._problem.objective if family.degree <= self._degree]

    def costs(self, *, noise: bool = False) -> int:
        """Number of columns with a nonzero linear cost. noise: also count sums that are only rounding."""
        by_block: dict[str, list[Monomial]] = {}
        for term in (term for family in self._expanded for term in family.of_degree(1)):
            by_block.setdefault(term.family.block(term.symbols[0]).name, []).append(term)
        return sum(_costs_of(terms, noise=noise) for terms in by_block.values())

    def products(self, merged: Floats) -> int:
        """Number of the objective's products; `merged` are their coefficients after merging equal ones.

        Raises ConsistencyError when their sum differs from the sum of the products before merging.
        """
        terms = [term for family in self._expanded for term in family.of_degree(2)]
        values = [np.broadcast_to(term.coefficient, (term.family.count,)) for term in terms]
        total, size = sum(map(np.sum, values)), sum(np.sum(np.abs(each)) for each in values)
        if abs(float(np.sum(merged)) - total) > _EXACT * size:
            raise ConsistencyError(
                f"holds products whose coefficients add up to {float(np.sum(merged))!r}, "
                f"but those of the problem add up to {float(total)!r}"
            )
        return len(merged)

    def nonzeros(self, degree: int) -> int:
        """Number of nonzero coefficients of the rows' terms of that degree."""
        return sum(
            self._elements(family) if not value.free_symbols else self._nonzero(family, value)
            for family in self._problem.formulation.rows
            for symbols, value in self._terms(family)
            if len(symbols) == degree
        )

    def _nonzero(self, family: Family, value: sp.Expr) -> int:
        placed = [each for each in self._problem.rows if each.family == family]
        return sum(int(np.count_nonzero(np.broadcast_to(each.data(value), (each.count,)))) for each in placed)

    def _terms(self, family: Family) -> Monomials:
        return monomials(family, self._unknowns(family)) or ()

    def _unknowns(self, family: Family) -> tuple[sp.Symbol, ...]:
        return tuple(family.unknowns(self._problem.formulation.fixed))

    def in_rows(self) -> dict[str, int]:
        """Counts of rows that are written as coefficients."""
        return {
            "rows": self.rows,
            "coefficients of rows": self.nonzeros(1),
            "products of rows": self.nonzeros(2),
        }

    def as_coefficients(self, products: Floats) -> dict[str, int]:
        """Counts of a file of coefficients. products: coefficients of the objective's merged products."""
        return {
            "columns": self.columns,
            "linear costs": self.costs(),
            "products of the objective": self.products(products),
            **self.in_rows(),
        }

    def data(self) -> dict[str, int]:
        """Counts of the data that layouts over sets list: pixels, strokes, nonzero jumps."""
        instance, jumps = self._problem.instance, self._problem.jumps
        return {
            "pixels": int(np.count_nonzero(instance.mask)),
            "strokes": len(instance.stroke_pixels),
            "jumps": 0 if jumps is None else int(np.count_nonzero(jumps)),
        }

    @property
    def declared(self) -> int:
        """Number of occurrences of columns in the objective's declared families."""
        return self._places(each.family for each in self._problem.objective if each.degree > self._degree)

    @property
    def declared_rows(self) -> int:
        """Number of occurrences of columns in the declared rows."""
        return self._places(self._problem.formulation.rows)

    def _places(self, families: Iterable[Family]) -> int:
        return sum(
            self._elements(family) * _occurrences(family.expression, self._unknowns(family))
            for family in families
        )

    @property
    def factors(self) -> int:
        """Number of factors of the rows' products."""
        return sum(
            self._elements(family) * len(symbols)
            for family in self._problem.formulation.rows
            for symbols, _ in self._terms(family)
            if len(symbols) > 1
        )


def _costs_of(terms: list[Monomial], *, noise: bool) -> int:
    """Number of columns of a block whose costs, the sums of these terms, are not 0."""
    first = terms[0]
    once = len(terms) == 1 and first.family.inside(first.symbols[0]) is None
    if once and np.ndim(first.coefficient) == 0:
        return first.family.count if first.coefficient else 0
    block = first.family.block(first.symbols[0])
    total, scale = np.zeros(block.count), np.zeros(block.count)
    for term in terms:
        inside = term.family.inside(term.symbols[0])
        add_at(total, inside, term.coefficient)
        add_at(scale, inside, term.family.scale)
    return int(np.count_nonzero(total if noise else beyond_noise(total, scale)))


@cache
def _occurrences(expression: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> int:
    """Number of places in an expression that hold one of the symbols."""
    return sum(node in symbols for node in sp.preorder_traversal(expression))
