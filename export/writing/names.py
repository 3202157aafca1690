"""Names of columns and rows: `alpha_012_034`, `p1_012_034_u`, `c14_012_034_r`.

Block or row tag, row and column of the pixel (for a pair: of its first pixel), and for a pair `u` for the
upper or `r` for the right neighbour. Zero-padded to the grid's width: at most 15 characters, no leading e, i
or n, unique without regard to case (docs/format-rules.md, W6), so that a solver's log can be read and every
solution file maps back without the model.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, Final

import numpy as np
import sympy as sp

from ...models.formulations.families import Block, PlacedFamily
from ...models.formulations.problem import Problem
from ...models.formulations.symbols import SLOTS, IndexSet, pixel_of
from ...models.instance.instance import Instance
from .records import Bytes, Piece, Tagged, Words, digits, filled, table

ONE: Final = b"ONE"
"""The column fixed to 1 that carries the objective's constant in LP and MPS."""

OBJECTIVE: Final = b"obj"
"""Name of the objective row."""


def problem_name(problem: Problem) -> str:
    """Name that solvers repeat in their solution files: instance and stamp, at most 52 word characters."""
    return f"{problem.instance.name}_{problem.stamp}"


class Names:
    """Names of columns and rows as pieces of records: a tag, and words for where the elements lie.

    The words are the same for all blocks and families over an index set, so that there are few of them and
    each is made once.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._places: dict[IndexSet, Words] = {}
        self._reached: dict[tuple[Any, ...], Words] = {}

    def of(self, block: Block) -> Tagged:
        """Names of a block's columns in order."""
        return Tagged(block.name.encode(), self._of(block.over))

    def row(self, family: PlacedFamily) -> Tagged:
        """Names of the rows of a family in order."""
        words = self._of(family.family.over)
        return Tagged(family.family.tag.encode(), words if family.everywhere else words.at(family.elements))

    def at(self, family: PlacedFamily, symbol: sp.Symbol) -> Tagged:
        """Name of the symbol's column at each element of a family."""
        block, (_, way) = family.block(symbol), SLOTS[family.family.over][symbol]
        key = (family.family.over, way, family.family.only)
        if key not in self._reached:
            words, inside = self._of(block.over), family.inside(symbol)
            self._reached[key] = words if inside is None else words.at(inside)
        return Tagged(block.name.encode(), self._reached[key])

    def _of(self, over: IndexSet) -> Words:
        if over not in self._places:
            self._places[over] = Words(element_names(self._problem.instance, "", over), None)
        return self._places[over]

    @cached_property
    def all(self) -> Words:
        """Names of all columns in order, padded to one length."""
        return Words(column_names(self._problem), None)


def element_names(instance: Instance, tag: str, over: IndexSet) -> Bytes:
    """Names `tag_row_column[_u|_r]` of all elements of an index set, shape (count, width), no padding."""
    grid = instance.grid
    at = pixel_of(instance, over)
    labels = digits(np.arange(max(grid.height, grid.width)), _digits(instance))
    parts: list[Piece] = [
        tag.encode() + b"_",
        Words(labels, grid.rows[at]),
        b"_",
        Words(labels, grid.columns[at]),
    ]
    if over == "pairs":
        parts.append(Words(table([b"_r", b"_u"]), grid.upward.view(np.uint8)))
    return filled(parts, len(at))


def name_length(instance: Instance, tag: str, over: IndexSet) -> int:
    """Length of each of these names."""
    return len(tag) + 2 * (1 + _digits(instance)) + (2 if over == "pairs" else 0)


def _digits(instance: Instance) -> int:
    """Digits of a row or column number: as many as the largest has, at least two."""
    return max(2, len(str(max(instance.grid.height, instance.grid.width) - 1)))


def stacked(matrices: list[Bytes]) -> Bytes:
    """Matrices of names below each other, narrower ones padded with NUL on the right."""
    width = max((matrix.shape[1] for matrix in matrices), default=1)
    out = np.zeros((sum(len(matrix) for matrix in matrices), width), dtype=np.uint8)
    start = 0
    for matrix in matrices:
        out[start : start + len(matrix), : matrix.shape[1]] = matrix
        start += len(matrix)
    return out


def column_names(problem: Problem) -> Bytes:
    """Names of all columns in column order, shape (columns, width), padded with NUL."""
    return stacked(
        [element_names(problem.instance, block.name, block.over) for block in problem.blocks.values()]
    )


def family_names(family: PlacedFamily) -> Bytes:
    """Names of the rows of a family, shape (count, width), no padding."""
    names = element_names(family.problem.instance, family.family.tag, family.family.over)
    return names if family.everywhere else names[family.elements]


def row_names(problem: Problem) -> Bytes:
    """Names of all rows in row order, shape (rows, width), padded with NUL."""
    return stacked([family_names(family) for family in problem.rows])
