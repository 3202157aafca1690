"""Names of columns and rows: `alpha_012_034`, `p1_012_034_u`, `c14_012_034_r`.

Block or row tag, row and column of the pixel (for a pair: of its first pixel), and for a pair `u` for the upper or `r` for the right
neighbour. Zero-padded to the grid's width: at most 15 characters, no leading e, i or n, unique without regard to case
(formats.md, rule 11), so that a solver's log can be read and every solution file maps back without the model.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from ..models.instance import Instance
from ..models.notation import IndexSet, pixel_of
from ..models.problem import Bound, Problem
from .records import Bytes, digits, table

ONE: Final = b"ONE"
"""The column fixed to 1 that carries the objective's constant in LP and MPS."""

OBJECTIVE: Final = b"obj"
"""Name of the objective row."""


def element_names(instance: Instance, tag: str, over: IndexSet) -> Bytes:
    """Names `tag_row_column[_u|_r]` of all elements of an index set, shape (count, width), no padding."""
    grid = instance.grid
    at = pixel_of(instance, over)
    width = max(2, len(str(max(grid.height, grid.width) - 1)))
    row, column = digits(grid.rows[at], width), digits(grid.columns[at], width)
    line = np.full((len(row), 1), ord("_"), dtype=np.uint8)
    stem = np.broadcast_to(np.frombuffer(tag.encode(), dtype=np.uint8), (len(row), len(tag)))
    parts = [stem, line, row, line, column]
    if over == "pairs":
        side = np.where(grid.upward, ord("u"), ord("r")).astype(np.uint8)
        parts += [line, side[:, None]]
    return np.concatenate(parts, axis=1)


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


def family_names(family: Bound) -> Bytes:
    """Names of the rows of a family, shape (count, width), no padding."""
    return element_names(family.problem.instance, family.family.tag, family.family.over)[family.elements]


def row_names(problem: Problem) -> Bytes:
    """Names of all rows in row order, shape (rows, width), padded with NUL."""
    return stacked([family_names(family) for family in problem.rows])


def with_one(names: Bytes) -> Bytes:
    """The names and ONE after them."""
    return stacked([names, table([ONE])])
