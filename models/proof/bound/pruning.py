"""Pruning of a refinement level: the cells that may hold crosses of fields of at most the energy U.

Labels are excluded by lower bounds of their min-marginals, the least energy with one label fixed. A pixel's
box is the bounding box of the cells that are left, as in branch and bound.

1. After a forward pass (dual.py), label x of pixel i survives where `bound` + theta_i(x) - min
   theta_i <= U + tolerance, and in two further tests where `bound` + the excess of a comb (combs.py) is.
   Section 5 of docs/proofs.md proves the tests.
2. A cell (k, l), (k + 1, l + 1) is left where its four vertices are allowed and in each test one of them
   survives.
3. The next level has the same centres. If it also has the same spacing, it allows the vertices of the cells
   that are left. If it has half the spacing, it allows every label whose cells meet a cell that is left,
   except labels beyond the cells that cover |beta| <= pi/4. In its steps, cell (k, l) begins at
   (2 k + o, 2 l + o): a vertex on black pixels and the middle of a cell on white ones.

The checker tolerates less for its rounding, and takes the final U, which is no greater. So it never keeps a
cell that was dropped here.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...instance.domain import Bools, Floats, Ints
from ...processes.compilation import compiled, inlined
from .lattice import Lattice, Starts, beta_range, block_starts, ranges


@dataclass(frozen=True, eq=False)
class RemainingCells:
    """The cells that are left on a lattice.

    cells: bool, flat like the labels: whether the cell from this label upwards is left.
    """

    lattice: Lattice
    cells: Bools

    @property
    def is_empty(self) -> bool:
        """Whether a pixel has no cell, so that no field is left."""
        return bool((np.add.reduceat(self.cells, self.lattice.start[:-1], dtype=np.int64) == 0).any())

    @property
    def boxes(self) -> Floats:
        """The box round each pixel's cells: alpha from, to, beta from, to in radians; shape (n, 4)."""
        lattice = self.lattice
        centre = np.repeat(np.stack([lattice.alpha, lattice.beta], axis=1), 2, axis=1)
        return centre + lattice.h * (_vertex_ranges(lattice, self.cells) + lattice.offset[:, None])


def surviving_cells(lattice: Lattice, survives: Bools) -> Bools:
    """The cells whose vertices are allowed and of which one survives; both flat like the labels."""
    cells = np.zeros(len(survives), dtype=bool)
    _mark_cells(rectangles(lattice), lattice.allowed, survives, cells)
    return cells


# Copies keep one layout of arrays, for which functions are compiled once.


def finer_lattice(left: RemainingCells) -> Lattice:
    """The lattice of half the spacing on the cells that are left."""
    lattice = left.lattice
    h, half = lattice.h / 2, (lattice.offset > 0).astype(np.int32)
    lowest, highest = beta_range(lattice.beta, h, lattice.offset)
    ends = 2 * _vertex_ranges(lattice, left.cells)
    ends[:, 1] += half
    ends[:, 2], ends[:, 3] = np.maximum(ends[:, 2], lowest), np.minimum(ends[:, 3] + half, highest)
    new = replace(lattice, h=h, **ranges(*ends.T.copy()))
    return _allow_vertices(left, new, 2, 3 + half)


def smaller_lattice(left: RemainingCells) -> Lattice:
    """The vertices of the cells that are left, as a lattice of the same spacing."""
    lattice = left.lattice
    new = replace(lattice, **ranges(*_vertex_ranges(lattice, left.cells).T.copy()))
    return _allow_vertices(left, new, 1, np.full(len(lattice.count), 2, np.int32))


def _allow_vertices(left: RemainingCells, new: Lattice, times: int, side: Ints) -> Lattice:
    """The new lattice with the labels of `_allow` alone."""
    allowed = new.allowed
    allowed[:] = False
    _allow((rectangles(left.lattice), left.cells), (rectangles(new), allowed), times, side)
    return new


def interpolate_shares(old: Lattice, shares: tuple[Floats, Floats], new: Lattice) -> tuple[Floats, Floats]:
    """Shares at both ends of all pairs, interpolated on a finer or smaller lattice with the same centres."""
    grid = old.instance.grid
    first, second = (np.zeros(int(new.share_starts(ends)[-1])) for ends in (grid.first, grid.second))
    for ends, values, fine in ((grid.first, shares[0], first), (grid.second, shares[1], second)):
        was = rectangles(old), old.share_starts(ends), values
        now = rectangles(new), new.share_starts(ends), fine
        _interpolate(was, now, ends, new.h / old.h, (new.offset, new.allowed))
    return first, second


def corners_of(lattice: Lattice, cells: Bools) -> Bools:
    """The labels at the corners of some cells; both flat."""
    corners = np.zeros(len(cells), dtype=bool)
    of_all = rectangles(lattice)
    _allow((of_all, cells), (of_all, corners), 1, np.full(len(lattice.count), 2, np.int32))
    return corners


def allowed_rows(lattice: Lattice, allowed: Bools) -> tuple[Starts, Starts, Starts]:
    """Where the rows of each pixel start, one for each alpha, and where the allowed labels of each row are.

    These are the first label and the one after the last; twice 0 in a row without any.
    """
    start = block_starts(lattice.alpha_count)
    begin, end = np.zeros(start[-1], np.int64), np.zeros(start[-1], np.int64)
    _find_rows(rectangles(lattice), allowed, start, begin, end)
    return start, begin, end


def _vertex_ranges(lattice: Lattice, cells: Bools) -> Ints:
    """Least and greatest k, then l, of the vertices of each pixel's cells, shape (n, 4)."""
    ends = np.zeros((len(lattice.count), 4), np.int32)
    _find_vertex_ranges(rectangles(lattice), cells, ends)
    return ends + np.stack([lattice.alpha_first] * 2 + [lattice.beta_first] * 2, axis=1)


class Rectangles(NamedTuple):
    """Start of the labels of each pixel, their numbers in alpha and beta, and the first k and l."""

    start: Starts
    rows: Ints
    columns: Ints
    first_row: Ints
    first_column: Ints


def rectangles(lattice: Lattice) -> Rectangles:
    """The rectangles of labels of all pixels."""
    return Rectangles(
        lattice.start, lattice.alpha_count, lattice.beta_count, lattice.alpha_first, lattice.beta_first
    )


@compiled
def _mark_cells(at: Rectangles, allowed: Bools, survives: Bools, cells: Bools) -> None:
    """Mark the cells that are left."""
    for i in range(len(at.rows)):
        begin, columns = at.start[i], at.columns[i]
        for k in range(at.rows[i] - 1):
            for low in range(begin + k * columns, begin + (k + 1) * columns - 1):
                high = low + columns
                is_allowed = allowed[low] and allowed[low + 1] and allowed[high] and allowed[high + 1]
                has_survivor = survives[low] or survives[low + 1] or survives[high] or survives[high + 1]
                cells[low] = is_allowed and has_survivor


@compiled
def _find_rows(at: Rectangles, allowed: Bools, start: Starts, begin: Starts, end: Starts) -> None:
    """Find the first allowed label of each row, and the one after the last."""
    for i in range(len(at.rows)):
        for row in range(start[i], start[i + 1]):
            label = at.start[i] + (row - start[i]) * at.columns[i]
            for x in range(at.columns[i]):
                if allowed[label + x]:
                    begin[row] = begin[row] if end[row] else x
                    end[row] = x + 1


@compiled
def _find_vertex_ranges(at: Rectangles, cells: Bools, ends: Ints) -> None:
    """Find the first and last vertex of the cells in alpha and in beta, counted from the first label."""
    for i in range(len(at.rows)):
        low_k, high_k, low_l, high_l = at.rows[i], 0, at.columns[i], 0
        for x in range(at.start[i + 1] - at.start[i]):
            if cells[at.start[i] + x]:
                k, l = x // at.columns[i], x % at.columns[i]  # noqa: E741 - the letter of the equation
                low_k, high_k = min(low_k, k), max(high_k, k + 1)
                low_l, high_l = min(low_l, l), max(high_l, l + 1)
        ends[i, 0], ends[i, 1], ends[i, 2], ends[i, 3] = low_k, high_k, low_l, high_l


@compiled
def _allow(was: tuple[Rectangles, Bools], now: tuple[Rectangles, Bools], times: int, side: Ints) -> None:
    """Allow labels of a lattice `times` as fine: for each cell that is left, `side` of them each way."""
    (old, cells), (new, allowed) = was, now
    for i in range(len(old.rows)):
        columns = old.columns[i]
        for x in range(old.start[i + 1] - old.start[i]):
            if not cells[old.start[i] + x]:
                continue
            row = times * (old.first_row[i] + x // columns) - new.first_row[i]
            column = times * (old.first_column[i] + x % columns) - new.first_column[i]
            for k in range(row, row + side[i]):
                if not 0 <= k < new.rows[i]:
                    continue
                begin = new.start[i] + k * new.columns[i]
                for l in range(max(column, 0), min(column + side[i], new.columns[i])):  # noqa: E741
                    allowed[begin + l] = True


@compiled
def _interpolate(
    old: tuple[Rectangles, Starts, Floats],
    new: tuple[Rectangles, Starts, Floats],
    ends: Ints,
    ratio: float,
    offset_and_allowed: tuple[Floats, Bools],
) -> None:
    """Fill in new shares at the allowed labels of those ends of pairs, bilinear between the old ones."""
    (was, was_start, values), (now, now_start, fine) = old, new
    offset, allowed = offset_and_allowed
    for pair in range(len(ends)):
        i = ends[pair]
        coarse = values[was_start[pair] : was_start[pair + 1]].reshape((was.rows[i], was.columns[i]))
        target = fine[now_start[pair] : now_start[pair + 1]].reshape((now.rows[i], now.columns[i]))
        labels = allowed[now.start[i] : now.start[i + 1]].reshape(target.shape)
        for k in range(now.rows[i]):
            row, up = _between(now.first_row[i] + k, offset[i], ratio, was.first_row[i], was.rows[i])
            for l in range(now.columns[i]):  # noqa: E741 - the letter of the equation
                if labels[k, l]:
                    column, right = _between(
                        now.first_column[i] + l, offset[i], ratio, was.first_column[i], was.columns[i]
                    )
                    target[k, l] = (1 - up) * (
                        (1 - right) * coarse[row, column] + right * coarse[row, column + 1]
                    ) + up * ((1 - right) * coarse[row + 1, column] + right * coarse[row + 1, column + 1])


@inlined
def _between(step: int, offset: float, ratio: float, first: int, count: int) -> tuple[int, float]:
    """The old label below a new one, and the fraction from there to the next: 0 to 1."""
    place = min(max((step + offset) * ratio - offset - first, 0.0), count - 1.0)
    low = min(int(place), count - 2)
    return low, place - low
