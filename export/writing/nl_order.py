"""Order in an .nl file: nine groups of columns, nonlinear rows first (docs/format-rules.md, N1, N2).

Nonlinear in objective and rows; only in rows; only in the objective; linear. The first three are split into
continuous and integer, the last into continuous, binary and integer.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...models.formulations.expressions import Symbol
from ...models.formulations.families import Block, Monomial, PlacedFamily
from ...models.formulations.problem import Problem
from ...models.instance.domain import Bools, Ints
from .names import OBJECTIVE, Names
from .records import render


@dataclass(frozen=True, eq=False)
class NlOrder:
    """Order of columns and rows in a .nl file.

    order: column of the problem at each place of the file; place: the inverse. rows: families in file order.
    """

    problem: Problem

    @cached_property
    def nonlinear_rows(self) -> tuple[PlacedFamily, ...]:
        """Families of rows that are not linear."""
        return tuple(family for family in self.problem.rows if family.degree > 1)

    @cached_property
    def rows(self) -> tuple[PlacedFamily, ...]:
        """Families of rows, nonlinear ones first."""
        return self.nonlinear_rows + tuple(family for family in self.problem.rows if family.degree <= 1)

    @cached_property
    def nonlinear_objective(self) -> tuple[PlacedFamily, ...]:
        """Terms of the objective that are not linear."""
        return tuple(family for family in self.problem.objective if family.degree > 1)

    @cached_property
    def in_objective(self) -> Bools:
        """True for columns in nonlinear terms of the objective."""
        columns = np.zeros(self.problem.n_columns, dtype=bool)
        for family in self.nonlinear_objective:
            for symbol in family.variables:
                columns[family.column_of(symbol)] = True
        return columns

    @cached_property
    def in_rows(self) -> Bools:
        """True for columns in nonlinear terms of rows."""
        columns = np.zeros(self.problem.n_columns, dtype=bool)
        for family in self.nonlinear_rows:
            for term in nonlinear_terms(family):
                for factor in term.factors:
                    columns[factor] = True
        return columns

    @cached_property
    def binary(self) -> Bools:
        """True for integer columns within [0, 1], fixed ones too: the header counts them as binary (N1)."""
        blocks = self.problem.blocks.values()
        return np.concatenate([block.integer & (block.lower >= 0) & (block.upper <= 1) for block in blocks])

    @cached_property
    def group(self) -> NDArray[np.int8]:
        """Group 0..8 of each column; small integers are sorted by counting."""
        problem, rows, objective = self.problem, self.in_rows, self.in_objective
        nonlinear = np.where(rows & objective, 0, np.where(rows, 2, 4)) + problem.integer
        linear = np.where(self.binary, 7, np.where(problem.integer, 8, 6))
        return np.where(rows | objective, nonlinear, linear).astype(np.int8)

    @cached_property
    def order(self) -> Ints:
        """Column of the problem at each place of the file."""
        return np.argsort(self.group, kind="stable").astype(np.int32)

    @cached_property
    def place(self) -> Ints:
        """Place in the file of each column of the problem."""
        place = np.empty_like(self.order)
        place[self.order] = np.arange(len(place), dtype=np.int32)
        return place

    @cached_property
    def stretches(self) -> list[tuple[Block, slice]]:
        """Runs of places that hold columns of one block, in file order."""
        blocks = [block for block in self.problem.blocks.values() if block.count]
        number = np.repeat(np.arange(len(blocks), dtype=np.int8), [block.count for block in blocks])
        return [(blocks[number[self.order[run.start]]], run) for run in equal_runs(number[self.order])]

    def places(self, family: PlacedFamily, symbol: Symbol) -> Ints:
        """Place in the file of the symbol's column at each element of a family."""
        places, inside = self.place[family.block(symbol).slice], family.inside(symbol)
        return places if inside is None else places[inside]

    def column_file(self) -> Iterator[bytes]:
        """The bytes of the .col file: names of columns in file order, one per line."""
        names = Names(self.problem)
        for block, run in self.stretches:
            inside = self.order[run] - block.offset
            yield from render([names.of(block).at(inside), b"\n"], len(inside))

    def row_file(self) -> Iterator[bytes]:
        """The bytes of the .row file: names of rows in file order, then of the objective, one per line."""
        names = Names(self.problem)
        for family in self.rows:
            yield from render([names.row(family), b"\n"], family.count)
        yield OBJECTIVE + b"\n"


def equal_runs(values: NDArray[Any]) -> list[slice]:
    """Stretches of equal values; none of no values."""
    cuts = [0, *(np.nonzero(np.diff(values))[0] + 1).tolist(), len(values)]
    return [slice(first, last) for first, last in pairwise(cuts) if first < last]


def nonlinear_terms(family: PlacedFamily) -> tuple[Monomial, ...]:
    """The monomials of degree two and more."""
    return tuple(term for term in family.terms or () if term.degree > 1)
