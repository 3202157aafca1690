"""The canonical form of a problem for writers of its files and readers of their answers.

It determines the columns of the files (the column fixed to 1 among them), their kinds and costs, the limits
of the rows, and the order of columns in each kind of file, once for all. It follows MathOptInterface's
bridges and linopy's `matrices`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...models.formulations.families import Block, Coefficient, Monomial
from ...models.formulations.problem import Problem
from ...models.instance.domain import Bools, Floats, Ints
from .mod_order import mod_column_order
from .names import Names
from .nl_order import NlOrder
from .records import TaggedWords, Texts, check_coefficients, texts_of_bytes
from .stamps import one_column_name

ColumnKind = Literal["continuous", "binary", "integer"]

ColumnOrder = Literal["nl", "lp", "mps", "mod"]
"""Kinds of files by the order of their columns: .nl has one of its own, LP and MPS put the column fixed to 1
first and last, and of a .mod GLPK numbers the columns as it meets them."""


BOUND_KINDS: Final = ("fixed", "boxed", "lower", "upper", "free")
"""Kinds of bounds: both ends equal, both finite, one finite, none."""


class BlockBounds(NamedTuple):
    """Columns of a block whose bounds are of one kind, and their ends."""

    kind: str
    names: TaggedWords
    lower: Floats
    upper: Floats


@dataclass(frozen=True, eq=False)
class CanonicalForm:
    """A problem as files hold it: with products lifted if the format needs that."""

    problem: Problem

    @cached_property
    def names(self) -> Names:
        """Names of columns and rows as pieces of records."""
        return Names(self.problem)

    @cached_property
    def column_names(self) -> Texts:
        """Names of the problem's columns, shape (columns,)."""
        return texts_of_bytes(self.names.all.table)

    @cached_property
    def constant(self) -> float:
        """The constant of the objective."""
        return float(self.problem.merged_objective(0)[1][0])

    @property
    def one(self) -> bytes:
        """Name of the column of LP and MPS that is fixed to 1; its cost is the constant of the objective.

        Solvers repeat it, and it carries the stamp, so that an answer identifies its problem. A model without
        rows gets the row `c_ONE`, which fixes this column too.
        """
        return one_column_name(self.problem.stamp)

    @cached_property
    def costs(self) -> Floats:
        """Cost of every column (columns,). Raises UnsupportedByFormatError for an extreme one."""
        index, coefficient = self.problem.merged_objective(1)
        costs = np.zeros(self.problem.n_columns)
        costs[index[:, 0]] = coefficient
        check_coefficients(coefficient, "the objective")
        return costs

    def products(self) -> tuple[Ints, Floats]:
        """The objective's products: columns (k, 2) and coefficients (k,). Raises as `costs`."""
        index, coefficient = self.problem.merged_objective(2)
        check_coefficients(coefficient, "the objective")
        return index, coefficient

    @cached_property
    def binary(self) -> Bools:
        """True for binary columns: integers with exactly the bounds [0, 1], shape (columns,).

        The header of an .nl file counts more columns as binary: `nl_order.binary`.
        """
        return np.concatenate(
            [block.integer & _is_zero_to_one(block) for block in self.problem.blocks.values()]
        )

    def kind(self, block: Block) -> ColumnKind:
        """The kind of a block of columns; binary only when all of them are."""
        if not block.integer:
            return "continuous"
        return "binary" if _is_zero_to_one(block).all() else "integer"

    def blocks(self, kind: ColumnKind) -> list[Block]:
        """The nonempty blocks of a kind, in order."""
        return [block for block in self.problem.blocks.values() if block.count and self.kind(block) == kind]

    def bounds(self, block: Block) -> Iterator[BlockBounds]:
        """The bounds of a block, kind by kind."""
        names, kinds = self.names.of(block), bound_kinds(block)
        for number, kind in enumerate(BOUND_KINDS):
            at = np.flatnonzero(kinds == number)
            if len(at) == block.count > 0:
                yield BlockBounds(kind, names, block.lower, block.upper)
            elif len(at):
                yield BlockBounds(kind, names.at(at), block.lower[at], block.upper[at])

    @cached_property
    def nl_order(self) -> NlOrder:
        """Order of columns and rows in the .nl file."""
        return NlOrder(self.problem)

    def order(self, file: ColumnOrder) -> Ints:
        """The problem's column at each place of a file; the column fixed to 1 comes after its last one."""
        if file == "nl":
            return self.nl_order.order
        if file == "mod":
            return mod_column_order(self.problem)
        columns, one = np.arange(self.problem.n_columns, dtype=np.int32), [self.problem.n_columns]
        return np.concatenate([one, columns] if file == "lp" else [columns, one]).astype(np.int32)

    def row_count(self, file: ColumnOrder) -> int:
        """Number of rows in a file: LP and MPS have at least one, and GLPK counts the objective of a .mod."""
        return self.problem.n_rows + {"nl": 0, "mod": 1}.get(file, not self.problem.rows)


def bound_kinds(block: Block) -> NDArray[np.int8]:
    """The kind of the bounds of every column of a block, a place in BOUND_KINDS, shape (count,)."""
    low, high = np.isfinite(block.lower), np.isfinite(block.upper)
    return np.select([block.lower == block.upper, low & high, low, high], [0, 1, 2, 3], 4).astype(np.int8)


def _is_zero_to_one(block: Block) -> Bools:
    zero_to_one: Bools = (block.lower == 0) & (block.upper == 1)
    return zero_to_one


def coefficient(term: Monomial) -> Coefficient:
    """The coefficient of a term of a row. Raises UnsupportedByFormatError for an extreme one."""
    check_coefficients(term.coefficient, f"row family {term.family.family.tag}")
    return term.coefficient
