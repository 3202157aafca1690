"""Parts of the remaining cells, cut between islands: groups of one pixel's cells with a gap between them.

If several fields have nearly the least energy, the cells of some pixels form one island for each of these
fields, and the bound mixes the fields. A cut between two islands gives two parts, and each part has levels of
its own. In most parts the bound soon exceeds the energy of the best field.

At the seam, the two ends of the strip of crosses are glued together. The labels of an island that crosses the
seam are at both ends. With the other label of one half, (alpha - pi/2, -beta), the box is narrow.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..field.jumps import free_jumps
from ..instance.angles import HALF, QUARTER
from ..instance.grid import Bools, Floats
from ..processes.compiled import compiled_if_needed
from .lattice import Starts, starts
from .pruning import Rectangles, RemainingCells, boxed, boxed_between, first_steps, rectangles


@dataclass(frozen=True)
class Cut:
    """A cut of a pixel's cells between two steps.

    axis: 0 for alpha, 1 for beta. step: the first one above the cut. share: of the pixel's cells that are in
    the smaller part.
    """

    pixel: int
    axis: int
    step: int
    share: float

    def parts(self, left: RemainingCells) -> tuple[RemainingCells, RemainingCells]:
        """The remaining cells below the cut, and those above it; other pixels keep all cells in both."""
        return self._part(left, above=False), self._part(left, above=True)

    def _part(self, left: RemainingCells, *, above: bool) -> RemainingCells:
        lattice, cells = left.lattice, left.cells.copy()
        first = (lattice.alpha_first, lattice.beta_first)[self.axis][self.pixel]
        shape = lattice.alpha_count[self.pixel], lattice.beta_count[self.pixel]
        own = cells[lattice.start[self.pixel] : lattice.start[self.pixel + 1]].reshape(shape)
        along = own.T if self.axis else own
        along[slice(None, self.step - first) if above else slice(self.step - first, None)] = False
        return boxed(lattice, cells)


def best_cut(left: RemainingCells, wanted: Bools) -> Cut | None:
    """The cut whose smaller part has the largest share of the pixel's cells, or None without a gap.

    wanted (n,): whether a pixel may be cut.
    """
    lattice, found = left.lattice, list[Cut]()
    for axis, first, counts in (
        (0, lattice.alpha_first, lattice.alpha_count),
        (1, lattice.beta_first, lattice.beta_count),
    ):
        start = starts(counts)
        cells = np.zeros(start[-1], np.int64)
        _count_cells(rectangles(lattice), left.cells, axis, start, cells)
        ends = np.concatenate([[0], np.cumsum(cells)])
        below = ends[:-1] - np.repeat(ends[start[:-1]], counts)
        total = np.repeat(np.diff(ends[start]), counts)
        at_gap = (cells == 0) & np.repeat(wanted, counts)
        share = np.where(at_gap, np.minimum(below, total - below) / np.maximum(total, 1), 0.0)
        place = int(share.argmax())
        pixel = int(np.searchsorted(start, place, side="right")) - 1
        found.append(Cut(pixel, axis, int(first[pixel]) + place - int(start[pixel]), float(share[place])))
    best = max(found, key=lambda cut: cut.share)
    return best if best.share > 0 else None


def island_of(left: RemainingCells, alpha: Floats, beta: Floats) -> RemainingCells | None:
    """The box round the island of each pixel that holds a field; None if the field is in no cell.

    alpha, beta: its angles, as from `labels_at`.
    """
    lattice = left.lattice
    row = np.floor((alpha - lattice.alpha) / lattice.h - lattice.offset) - lattice.alpha_first
    column = np.floor((beta - lattice.beta) / lattice.h - lattice.offset) - lattice.beta_first
    ends = np.zeros((len(lattice.count), 4), np.int64)
    if not _find_islands(
        rectangles(lattice), left.cells, (row.astype(np.int64), column.astype(np.int64)), ends
    ):
        return None
    return boxed_between(lattice, left.cells, ends + first_steps(lattice))


def across_seam(left: RemainingCells) -> tuple[RemainingCells, Floats]:
    """Boxes that are narrower with the other label of some crosses, and a direction of each stroke, (s,).

    The lattice has the middles of the boxes as its centres, and the best jumps there. A direction has the
    turn that is nearest to the middle of its box, in radians.
    """
    lattice = left.lattice
    groups = np.full((len(lattice.count), 6), -1, np.int64)
    _find_groups(rectangles(lattice), left.cells, groups)
    first = np.stack([lattice.alpha_first] * 2 + [lattice.beta_first] * 4, axis=1)
    origin = np.stack([lattice.alpha] * 2 + [lattice.beta] * 4, axis=1)
    last, next_, low, high, least, most = (origin + lattice.h * (groups + first + lattice.offset[:, None])).T
    alpha_low = np.minimum(left.alpha_low, next_ - HALF)
    alpha_high = np.maximum(last, left.alpha_high - HALF)
    turned = (groups[:, 0] >= 0) & (alpha_high - alpha_low < left.alpha_high - left.alpha_low)
    beta_low, beta_high = np.minimum(low, -most), np.maximum(high, -least)
    found = replace(
        left,
        alpha_low=np.where(turned, alpha_low, left.alpha_low),
        alpha_high=np.where(turned, alpha_high, left.alpha_high),
        beta_low=np.where(turned, np.maximum(beta_low, -QUARTER), left.beta_low),
        beta_high=np.where(turned, np.minimum(beta_high, QUARTER), left.beta_high),
    )
    alpha, beta = (found.alpha_low + found.alpha_high) / 2, (found.beta_low + found.beta_high) / 2
    instance = lattice.instance
    jumps, _ = free_jumps(instance, alpha, beta)
    target = instance.target + np.pi * np.round((alpha[instance.stroke_index] - instance.target) / np.pi)
    return replace(found, lattice=replace(lattice, alpha=alpha, beta=beta, p=jumps)), target


@compiled_if_needed
def _count_cells(at: Rectangles, cells: Bools, axis: int, start: Starts, found: Starts) -> None:
    """Count the cells of each step of alpha (axis 0) or beta (axis 1) of each pixel."""
    for i in range(len(at.rows)):
        for x in range(at.start[i + 1] - at.start[i]):
            if cells[at.start[i] + x]:
                place = x % at.columns[i] if axis else x // at.columns[i]
                found[start[i] + place] += 1


@compiled_if_needed
def _find_islands(at: Rectangles, cells: Bools, places: tuple[Starts, Starts], ends: Starts) -> bool:
    """Fill in the ends of the island round a place of each pixel; return whether all places are in one.

    An island is a rectangle with an empty or no row and column next to each of its sides.
    """
    for i in range(len(at.rows)):
        own = cells[at.start[i] : at.start[i + 1]].reshape((at.rows[i], at.columns[i]))
        place = _cell_near(own, places[0][i], places[1][i])
        if place[0] < 0:
            return False
        low, high, left, right = 0, own.shape[0], 0, own.shape[1]
        size = -1
        while size != (high - low) * (right - left):
            size = (high - low) * (right - left)
            low, high = _run(own[low:high, left:right], place[0] - low, low)
            left, right = _run(own[low:high, left:right].T, place[1] - left, left)
        ends[i, 0], ends[i, 1], ends[i, 2], ends[i, 3] = low, high, left, right
    return True


@compiled_if_needed
def _cell_near(own: Bools, row: int, column: int) -> tuple[int, int]:
    """The cell at a place, or one that shares its lower sides; -1 if there is none."""
    for k in range(row, row - 2, -1):
        for l in range(column, column - 2, -1):  # noqa: E741 - the letter of the equation
            if 0 <= k < own.shape[0] and 0 <= l < own.shape[1] and own[k, l]:
                return k, l
    return -1, -1


@compiled_if_needed
def _run(own: Bools, row: int, first: int) -> tuple[int, int]:
    """The rows with a cell that are connected with a row, counted from `first`."""
    low, high = row, row + 1
    while low > 0 and own[low - 1].any():
        low -= 1
    while high < own.shape[0] and own[high].any():
        high += 1
    return first + low, first + high


@compiled_if_needed
def _find_groups(at: Rectangles, cells: Bools, groups: Starts) -> None:
    """Find the widest gap between rows of cells of each pixel, and the columns of both groups of cells.

    groups: the end of the rows below the gap and the first row above it, the first and last column (the one
    after it) below, and those above; without a gap as they were.
    """
    for i in range(len(at.rows)):
        own = cells[at.start[i] : at.start[i + 1]].reshape((at.rows[i], at.columns[i]))
        before, widest = -1, 1
        for row in range(own.shape[0]):
            if own[row].any():
                if before >= 0 and row - before > widest:
                    widest = row - before
                    groups[i, 0], groups[i, 1] = before + 1, row
                before = row
        if groups[i, 0] >= 0:
            groups[i, 2], groups[i, 3] = _columns(own[: groups[i, 0]])
            groups[i, 4], groups[i, 5] = _columns(own[groups[i, 1] :])


@compiled_if_needed
def _columns(own: Bools) -> tuple[int, int]:
    """The first column with a cell, and the one after the last."""
    first, end = own.shape[1], 0
    for row in range(own.shape[0]):
        for column in range(own.shape[1]):
            if own[row, column]:
                first, end = min(first, column), max(end, column + 1)
    return first, end
