"""Clusters: tables on the alphas of 2 x 2 pixels, which raise the 2-norm bound where a field has a vortex.

They tighten the relaxation, as in Sontag et al., Tightening LP relaxations for MAP using message passing (UAI
2008); the tables are the dual variables of a quad's consistency with its pairs.

The local polytope mixes fields with the vortex in other places, because its pairs need not agree round a
quad. Let lambda_e(k_i, k_j) be tables on the alphas of the four pairs e of a quad. For any tables

    sum over pairs of c_e = sum over pairs of (c_e + lambda_e) + sum over quads of - (sum of lambda_e).

Rounding by one threshold gives all alphas one joint distribution (docs/proofs.md, 4). So
in the bound, a pair costs c_e + lambda_e, and a quad adds the least of - sum lambda_e over the labels of its
four alphas. The cost of a pair, for jumps of one parity, is still a term in alpha plus a term in beta.

An update of a quad sets lambda_e to - f_e + m_e / 4. Here f_e is the least of c_e - shares over betas and
jumps without this lambda_e, and m_e the least of the sum of the four f with these two alphas. Afterwards all
pairs and the quad attain their least values at the same alphas, and the bound has not fallen.

The quads that become clusters are those of most slack. Rounding the best field gives each pixel one of some
labels. In the mean over them, the reparametrised costs of pixels and pairs exceed the least values that the
bound takes there. These slacks sum to the gap of the level. At a vortex, a few pixels hold most of it.
"""

from __future__ import annotations

from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...instance.domain import Floats, Ints
from ...instance.grid import Grid
from ...processes.compilation import compiled, compiled_inside, inlined
from .lattice import Lattice, block_starts
from .min_plus import (
    RaggedMatrix,
    beta_lines,
    fill_product_over_beta,
    least_beta_cost,
    min_plus,
)
from .passes import alpha_costs, fill_reparametrised, least_of_rows, row_ends, shares_at
from .state import Clusters, Indices, RowEnds, State

IndexTable = NDArray[np.int64]  # of two axes

_ENDS: Final = np.array([[0, 1], [1, 2], [3, 2], [0, 3]])
"""The first and the second pixel of each pair of a quad, among its pixels a, b, c, d."""

_THRESHOLDS: Final = (0.25, 0.75)  # of the rounding


def zero_clusters(lattice: Lattice, quads: Indices) -> Clusters:
    """Clusters with zero tables on some quads of the grid. quads (q,): their numbers, ascending."""
    grid = lattice.instance.grid
    pairs = grid.quads[quads].astype(np.int64)
    begin = block_starts(table_sizes(lattice, pairs))
    of_pair = np.full((len(grid.first), 2), -1, np.int64)
    for number, pair in enumerate(pairs.ravel().tolist()):
        of_pair[pair, int(of_pair[pair, 0] >= 0)] = number
    return Clusters(pairs, begin, of_pair, np.zeros(begin[-1]))


def table_sizes(lattice: Lattice, quads: Indices) -> Indices:
    """The numbers of each table of clusters on a lattice. quads (q, 4): as in `Clusters`."""
    grid, pairs = lattice.instance.grid, quads.ravel()
    rows, columns = lattice.alpha_count[grid.first[pairs]], lattice.alpha_count[grid.second[pairs]]
    return rows.astype(np.int64) * columns


def table_work(lattice: Lattice, quads: Indices) -> float:
    """The number of additions of (min,+) products of the clusters' tables, up to a factor."""
    return float((table_sizes(lattice, quads) ** 1.5).sum())


def copy_tables(old: Clusters, new: Clusters) -> Clusters:
    """The new clusters, with the tables of the old ones, which are among them."""
    places = np.searchsorted(new.quads[:, 0], old.quads[:, 0])
    for number, place in enumerate(places):
        was = old.tables[old.start[4 * number] : old.start[4 * number + 4]]
        new.tables[new.start[4 * place] : new.start[4 * place + 4]] = was
    return new


def interpolate_clusters(old: Lattice, clusters: Clusters, new: Lattice) -> Clusters:
    """The clusters on a finer lattice with the same centres: tables are interpolated between labels."""
    grid = old.instance.grid
    numbers = np.flatnonzero(np.isin(grid.quads[:, 0], clusters.quads[:, 0]))
    fine = zero_clusters(new, numbers)
    for number, pair in enumerate(fine.quads.ravel()):
        ends = (grid.first[pair], grid.second[pair])
        coarse = clusters.tables[clusters.start[number] : clusters.start[number + 1]]
        (low, up), (left, right) = (_between(old, new, i) for i in ends)
        table = coarse.reshape([old.alpha_count[i] for i in ends])
        up = up[:, None]
        rows = (1 - up) * table[low] + up * table[low + 1]
        values = (1 - right) * rows[:, left] + right * rows[:, left + 1]
        fine.tables[fine.start[number] : fine.start[number + 1]] = values.ravel()
    return fine


def _between(old: Lattice, new: Lattice, i: int) -> tuple[Indices, Floats]:
    """For each alpha of pixel i, the old alpha below it and the fraction from there to the next, 0 to 1."""
    step = new.alpha_first[i] + np.arange(new.alpha_count[i]) + new.offset[i]
    place = step * (new.h / old.h) - old.offset[i] - old.alpha_first[i]
    place = np.clip(place, 0.0, old.alpha_count[i] - 1.0)
    low = np.minimum(place.astype(np.int64), old.alpha_count[i] - 2)
    return low, place - low


def independent_clusters(grid: Grid, clusters: Clusters) -> list[Indices]:
    """The clusters in two parts, like the colours of a checkerboard: no two of one part share a pair.

    Those with the largest tables come first, so that threads that share a part end together.
    """
    corner = grid.first[clusters.quads[:, 0]]
    colour = (grid.rows[corner] + grid.columns[corner]) % 2
    order = np.argsort(-np.diff(clusters.start[::4]), kind="stable")
    return [order[colour[order] == part] for part in (0, 1)]


def quad_slacks(lattice: Lattice, state: State, angles: tuple[Floats, Floats]) -> Floats:
    """The slack of the four pixels of pixel quad, and half of the slack of pixel of their pairs; shape (q,).

    Pairs count as after a pass, when their least value is 0. Without a label near the field, a slack is 0.
    angles: alpha and beta of a field, as from `nearest_labels`.
    """
    grid = lattice.instance.grid
    corners = _corners(lattice, *angles)
    theta = np.empty(lattice.start[-1])
    fill_reparametrised(0, len(lattice.count), state, theta)
    begin = lattice.start[:-1]
    least = np.minimum.reduceat(theta, begin)
    at_pixel = np.mean([theta[begin + corner.label] for corner in corners], axis=0) - least
    at_pair = np.mean([_pair_slacks(lattice, state, corner) for corner in corners], axis=0) / 2
    for ends in (grid.first, grid.second):
        np.add.at(at_pixel, ends, at_pair)
    bottom, _, top, _ = grid.quads.T
    pixels = (grid.first[bottom], grid.second[bottom], grid.first[top], grid.second[top])
    slacks: Floats = np.sum([at_pixel[pixel] for pixel in pixels], axis=0)
    return np.where(np.isfinite(slacks), slacks, 0.0)


class _Corner:
    """A label of each pixel.

    label (n,): its number. row (n,): that of its alpha. alpha, beta (n,): its angles.
    """

    def __init__(self, lattice: Lattice, k: Ints, l: Ints) -> None:  # noqa: E741 - the letter of the equation
        self.row: Ints = np.clip(k - lattice.alpha_first, 0, lattice.alpha_count - 1)
        column = np.clip(l - lattice.beta_first, 0, lattice.beta_count - 1)
        self.label: Ints = self.row * lattice.beta_count + column
        self.alpha = lattice.alpha + lattice.h * (self.row + lattice.alpha_first + lattice.offset)
        self.beta = lattice.beta + lattice.h * (column + lattice.beta_first + lattice.offset)


def _corners(lattice: Lattice, alpha: Floats, beta: Floats) -> list[_Corner]:
    """The labels to which a few thresholds round a field."""
    k = (alpha - lattice.alpha) / lattice.h - lattice.offset
    l = (beta - lattice.beta) / lattice.h - lattice.offset  # noqa: E741 - the letter of the equation
    return [
        _Corner(lattice, np.floor(k + s).astype(np.int32), np.floor(l + t).astype(np.int32))
        for s, t in product(_THRESHOLDS, repeat=2)
    ]


def _pair_slacks(lattice: Lattice, state: State, corner: _Corner) -> Floats:
    """The costs of pairs with their tables, less their shares, at a corner of both ends."""
    i, j = lattice.instance.grid.first, lattice.instance.grid.second
    cost = lattice.instance.pair_terms.least_costs(corner.alpha, corner.beta) - lattice.h**2
    cost -= state.shares_first[state.pairs["start_first"][:-1] + corner.label[i]]
    cost -= state.shares_second[state.pairs["start_second"][:-1] + corner.label[j]]
    clusters = state.clusters
    for numbers in clusters.of_pair.T:
        at = np.flatnonzero(numbers >= 0)
        wide = lattice.alpha_count[j[at]]
        place = clusters.start[numbers[at]] + corner.row[i[at]] * wide + corner.row[j[at]]
        cost[at] += clusters.tables[place]
    return cost


# Tables are named by one number, 4 * cluster + column: Numba would compile a function once for each literal
# column.


@compiled
def visit_clusters(numbers: Indices, state: State, step: float, least: Floats) -> None:
    """Update some clusters by a step, one after the other. Or, at a step of 0, fill in their least values.

    step: 1 for the tables at which the least value of a cluster is greatest, which is then 0; more to go
    beyond them. The least value is that of - sum lambda over the allowed alphas.
    """
    for number in numbers:
        rows = _allowed_alphas(number, state)
        table = 4 * number
        f0, f1 = _table_costs(table, rows, state, step), _table_costs(table + 1, rows, state, step)
        f2, f3 = _table_costs(table + 2, rows, state, step), _table_costs(table + 3, rows, state, step)
        upper, lower = min_plus(f0, f1), min_plus(f3, f2)
        if step > 0:
            _store_table(table, rows, state, step, f0, min_plus(lower, _transposed(f1)))
            _store_table(table + 1, rows, state, step, f1, min_plus(_transposed(f0), lower))
            _store_table(table + 2, rows, state, step, f2, min_plus(_transposed(f3), upper))
            _store_table(table + 3, rows, state, step, f3, min_plus(upper, _transposed(f2)))
        else:
            least[number] = np.inf
            for x in range(upper.shape[0]):
                for z in range(upper.shape[1]):
                    least[number] = min(least[number], upper[x, z] + lower[x, z])


@inlined
def _allowed_alphas(number: int, state: State) -> IndexTable:
    """The number of alphas with an allowed label at the pixels a, b, c, d of a quad, then these alphas."""
    bottom, top = state.clusters.quads[number, 0], state.clusters.quads[number, 2]
    most = 0
    for place in range(4):
        pair = bottom if place < 2 else top
        i = state.pairs[pair].first if place in (0, 3) else state.pairs[pair].second
        most = max(most, state.pixels[i].alpha_count)
    alphas = np.empty((4, most + 1), np.int64)
    for place in range(4):
        pair = bottom if place < 2 else top
        i = state.pairs[pair].first if place in (0, 3) else state.pairs[pair].second
        begin, end = row_ends(i, state)
        count = 0
        for row in range(begin.size):
            if begin[row] < end[row]:
                count += 1
                alphas[place, count] = row
        alphas[place, 0] = count
    return alphas


@compiled_inside
def _table_costs(table: int, rows: IndexTable, state: State, step: float) -> Floats:
    """Minus a table, by allowed alphas.

    For its update instead: the least of its pair's cost - shares over betas and jumps, without this table.
    """
    negative = _negative_table(table, rows, state)
    if step == 0:
        return negative
    column = table % 4
    pair = state.clusters.quads[table // 4, column]
    i, j = state.pairs[pair].first, state.pairs[pair].second
    rows_i, rows_j = rows[_ENDS[column, 0]], rows[_ENDS[column, 1]]
    shares_i, shares_j = _negative_shares(pair, i, rows_i, state), _negative_shares(pair, j, rows_j, state)
    ragged = RaggedMatrix(shares_j, _chosen_row_ends(j, rows_j, state))
    in_alpha = np.empty((state.pixels[i].alpha_count, state.pixels[j].alpha_count))
    half = np.empty((shares_j.shape[0], shares_i.shape[1]))
    best = np.empty((shares_i.shape[0], shares_j.shape[0]))
    best[:] = np.inf
    least, reached = least_of_rows(shares_i) + least_of_rows(shares_j), np.inf
    for turn in range(2):
        odd = (state.pairs[pair].odd + turn) % 2 == 1
        betas_i, betas_j = beta_lines(pair, i, state, odd)
        cheapest = alpha_costs(pair, i, state, odd, in_alpha)
        cheapest += least_beta_cost(betas_i, betas_j, (shares_i.shape[1], shares_j.shape[1]), state.power)
        if cheapest + least < reached:
            fill_product_over_beta(ragged, betas_i, betas_j, state.power, half)
            reached = _lower_to(best, min_plus(shares_i, _transposed(half)), in_alpha, (rows_i, rows_j))
    _add_matrix(best, negative, -state.h * state.h)
    return best


@inlined
def _lower_to(best: Floats, sums: Floats, in_alpha: Floats, rows: tuple[Indices, Indices]) -> float:
    """Lower the best sums to those of two tables, the second by all alphas; return the greatest."""
    (rows_i, rows_j), greatest = rows, -np.inf
    for x in range(best.shape[0]):
        for y in range(best.shape[1]):
            best[x, y] = min(best[x, y], sums[x, y] + in_alpha[rows_i[x + 1], rows_j[y + 1]])
            greatest = max(greatest, best[x, y])
    return greatest


@inlined
def _chosen_row_ends(i: int, rows: Indices, state: State) -> RowEnds:
    """The ends of some rows of a pixel, as of `row_ends`."""
    begin, end = row_ends(i, state)
    some = np.empty(rows[0], np.int64), np.empty(rows[0], np.int64)
    for x in range(rows[0]):
        some[0][x], some[1][x] = begin[rows[x + 1]], end[rows[x + 1]]
    return some


@inlined
def _add_matrix(matrix: Floats, addend: Floats, constant: float) -> None:
    for x in range(matrix.shape[0]):
        for y in range(matrix.shape[1]):
            matrix[x, y] += addend[x, y] + constant


@compiled_inside
def _negative_shares(pair: int, i: int, rows: Indices, state: State) -> Floats:
    """Minus the shares of a pair at the allowed alphas of its end i; inf at labels that are not allowed."""
    columns = state.pixels[i].beta_count
    share, begin = shares_at(pair, i, state), state.pixels[i].start
    negative = np.empty((rows[0], columns))
    for x in range(rows[0]):
        for y in range(columns):
            at = rows[x + 1] * columns + y
            negative[x, y] = -share[at] if state.unary[begin + at] < np.inf else np.inf
    return negative


@inlined
def _negative_table(table: int, rows: IndexTable, state: State) -> Floats:
    """Minus a table of a cluster, at the allowed alphas."""
    column = table % 4
    rows_i, rows_j = rows[_ENDS[column, 0]], rows[_ENDS[column, 1]]
    begin = state.clusters.start[table]
    wide = state.pixels[state.pairs[state.clusters.quads[table // 4, column]].second].alpha_count
    negative = np.empty((rows_i[0], rows_j[0]))
    for x in range(rows_i[0]):
        for y in range(rows_j[0]):
            negative[x, y] = -state.clusters.tables[begin + rows_i[x + 1] * wide + rows_j[y + 1]]
    return negative


@compiled_inside
def _store_table(  # noqa: PLR0917 - a tuple would be compiled once for each literal in it
    table: int, rows: IndexTable, state: State, step: float, f: Floats, rest: Floats
) -> None:
    """Move a table by a step towards a quarter of the least of all four f, f + rest, less its own f."""
    column = table % 4
    rows_i, rows_j = rows[_ENDS[column, 0]], rows[_ENDS[column, 1]]
    begin = state.clusters.start[table]
    wide = state.pixels[state.pairs[state.clusters.quads[table // 4, column]].second].alpha_count
    for x in range(f.shape[0]):
        for y in range(f.shape[1]):
            at = begin + rows_i[x + 1] * wide + rows_j[y + 1]
            value = 0.25 * (f[x, y] + rest[x, y]) - f[x, y]
            state.clusters.tables[at] += step * (value - state.clusters.tables[at])


@compiled
def _transposed(matrix: Floats) -> Floats:
    """The transposed matrix, as rows one after the other."""
    transposed = np.empty((matrix.shape[1], matrix.shape[0]))
    for x in range(matrix.shape[0]):
        for y in range(matrix.shape[1]):
            transposed[y, x] = matrix[x, y]
    return transposed
