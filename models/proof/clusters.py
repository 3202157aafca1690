"""Clusters: tables on the alphas of 2 x 2 pixels, which raise the bound where a field has a vortex.

The local polytope mixes fields with the vortex in other places, because its pairs need not agree round a
quad. Let lambda_e(k_i, k_j) be tables on the alphas of the four pairs e of a quad. For any tables

    sum over pairs of c_e = sum over pairs of (c_e + lambda_e) + sum over quads of - (sum of lambda_e).

Rounding by one threshold gives all alphas one joint distribution (models/proof/check_certificate.py, 2). So
in the bound, a pair costs c_e + lambda_e, and a quad adds the least of - sum lambda_e over the labels of its
four alphas. The cost of a pair, for jumps of one parity, is still a term in alpha plus a term in beta.

An update of a quad sets lambda_e to - f_e + m_e / 4. Here f_e is the least of c_e - shares over betas and
jumps without this lambda_e, and m_e the least of the sum of the four f with these two alphas. Afterwards all
pairs and the quad attain their least values at the same alphas, and the bound has not fallen.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from ..instance.grid import Floats, Grid
from ..processes.compiled import compiled
from .lattice import Lattice, starts
from .products import alpha_costs, beta_costs, min_plus, over_beta, share_of
from .state import Clusters, Indices, State

Rows = tuple[Indices, Indices, Indices, Indices]
"""The alphas that have an allowed label, at the pixels a, b, c, d of a quad: its pairs are ab, bc, dc, ad."""

_ENDS: Final = ((0, 1), (1, 2), (3, 2), (0, 3))
"""The first and second pixel of each pair, among a, b, c, d."""


def clusters_on(lattice: Lattice, quads: Indices) -> Clusters:
    """Clusters with zero tables on some quads of the grid. quads (q,): their numbers, ascending."""
    grid = lattice.instance.grid
    pairs = grid.quads[quads].astype(np.int64)
    rows, columns = lattice.alpha_count[grid.first[pairs]], lattice.alpha_count[grid.second[pairs]]
    begin = starts((rows.astype(np.int64) * columns).ravel())
    of_pair = np.full((len(grid.first), 2), -1, np.int64)
    for number, pair in enumerate(pairs.ravel().tolist()):
        of_pair[pair, int(of_pair[pair, 0] >= 0)] = number
    return Clusters(pairs, begin, of_pair, np.zeros(begin[-1]))


def extended(old: Clusters, new: Clusters) -> Clusters:
    """The new clusters, with the tables of the old ones, which are among them."""
    places = np.searchsorted(new.quads[:, 0], old.quads[:, 0])
    for number, place in enumerate(places):
        was = old.tables[old.start[4 * number] : old.start[4 * number + 4]]
        new.tables[new.start[4 * place] : new.start[4 * place + 4]] = was
    return new


def prolonged_clusters(old: Lattice, clusters: Clusters, new: Lattice) -> Clusters:
    """The clusters on a finer lattice with the same centres: tables are interpolated between labels."""
    grid = old.instance.grid
    numbers = np.flatnonzero(np.isin(grid.quads[:, 0], clusters.quads[:, 0]))
    found = clusters_on(new, numbers)
    for number, pair in enumerate(found.quads.ravel()):
        ends = (grid.first[pair], grid.second[pair])
        was = clusters.tables[clusters.start[number] : clusters.start[number + 1]]
        (low, up), (left, right) = (_between(old, new, i) for i in ends)
        table = was.reshape([old.alpha_count[i] for i in ends])
        up = up[:, None]
        rows = (1 - up) * table[low] + up * table[low + 1]
        values = (1 - right) * rows[:, left] + right * rows[:, left + 1]
        found.tables[found.start[number] : found.start[number + 1]] = values.ravel()
    return found


def _between(old: Lattice, new: Lattice, i: int) -> tuple[Indices, Floats]:
    """For each alpha of pixel i, the old alpha below it and the fraction from there to the next, 0 to 1."""
    step = new.alpha_first[i] + np.arange(new.alpha_count[i]) + new.offset[i]
    place = step * (new.h / old.h) - old.offset[i] - old.alpha_first[i]
    place = np.clip(place, 0.0, old.alpha_count[i] - 1.0)
    low = np.minimum(place.astype(np.int64), old.alpha_count[i] - 2)
    return low, place - low


def cluster_fronts(grid: Grid, clusters: Clusters) -> list[Indices]:
    """The clusters in two parts, like the colours of a checkerboard: no two of one part share a pair."""
    corner = grid.first[clusters.quads[:, 0]]
    colour = (grid.rows[corner] + grid.columns[corner]) % 2
    return [np.flatnonzero(colour == each) for each in (0, 1)]


@compiled
def update_clusters(numbers: Indices, state: State) -> None:
    """Update some clusters, one after the other; their least values are then 0."""
    for number in numbers:
        rows = _rows(number, state)
        f = (
            _reduced(number, 0, rows, state),
            _reduced(number, 1, rows, state),
            _reduced(number, 2, rows, state),
            _reduced(number, 3, rows, state),
        )
        upper, lower = min_plus(f[0], f[1]), min_plus(f[3], f[2])
        _store(number, 0, rows, 0.25 * min_plus(lower, f[1].T.copy()) - 0.75 * f[0], state)
        _store(number, 1, rows, 0.25 * min_plus(f[0].T.copy(), lower) - 0.75 * f[1], state)
        _store(number, 2, rows, 0.25 * min_plus(f[3].T.copy(), upper) - 0.75 * f[2], state)
        _store(number, 3, rows, 0.25 * min_plus(upper, f[2].T.copy()) - 0.75 * f[3], state)


@compiled
def least_of_clusters(begin: int, end: int, state: State, least: Floats) -> None:
    """Fill in the least of - sum lambda of some clusters over the allowed alphas."""
    for number in range(begin, end):
        rows = _rows(number, state)
        upper = min_plus(_negative(number, 0, rows, state), _negative(number, 1, rows, state))
        lower = min_plus(_negative(number, 3, rows, state), _negative(number, 2, rows, state))
        least[number] = (upper + lower).min()


@compiled
def _rows(number: int, state: State) -> Rows:
    quad = state.clusters.quads[number]
    return (
        _allowed(state.first[quad[0]], state),
        _allowed(state.second[quad[0]], state),
        _allowed(state.second[quad[1]], state),
        _allowed(state.first[quad[2]], state),
    )


@compiled
def _allowed(i: int, state: State) -> Indices:
    """The alphas of a pixel that have an allowed label."""
    unary = state.unary[state.start[i] : state.start[i + 1]].reshape(
        (state.alpha_count[i], state.beta_count[i])
    )
    found = np.empty(unary.shape[0], np.int64)
    count = 0
    for row in range(unary.shape[0]):
        if unary[row].min() < np.inf:
            found[count] = row
            count += 1
    return found[:count]


@compiled
def _reduced(number: int, column: int, rows: Rows, state: State) -> Floats:
    """The least of a pair's cost - shares over betas and jumps, without this cluster's table; by alphas."""
    pair = state.clusters.quads[number, column]
    i, j = state.first[pair], state.second[pair]
    mine, others = rows[_ENDS[column][0]], rows[_ENDS[column][1]]
    own, other = _given(pair, i, mine, state), _given(pair, j, others, state)
    in_alpha = np.empty((state.alpha_count[i], state.alpha_count[j]))
    in_beta = np.empty((other.shape[1], own.shape[1]))
    half = np.empty((len(others), own.shape[1]))
    best = np.full((len(mine), len(others)), np.inf)
    for turn in range(2):
        odd = (state.odd[pair] + turn) % 2 == 1
        cheapest = alpha_costs(pair, i, state, odd, in_alpha)
        cheapest += beta_costs(state.beta[i], state.beta[j], state, odd, in_beta)
        if cheapest + own.min() + other.min() >= best.max():
            continue
        over_beta(other, in_beta, half)
        found = min_plus(own, half.T.copy())
        for x in range(len(mine)):
            for y in range(len(others)):
                best[x, y] = min(best[x, y], found[x, y] + in_alpha[mine[x], others[y]])
    if state.norm == 2:
        best -= state.h * state.h
    return best + _negative(number, column, rows, state)


@compiled
def _given(pair: int, i: int, rows: Indices, state: State) -> Floats:
    """Minus the shares of a pair at some alphas of its end i; inf at labels that are not allowed."""
    columns = state.beta_count[i]
    share, begin = share_of(pair, i, state), state.start[i]
    given = np.empty((len(rows), columns))
    for x in range(len(rows)):
        for y in range(columns):
            at = rows[x] * columns + y
            given[x, y] = -share[at] if state.unary[begin + at] < np.inf else np.inf
    return given


@compiled
def _negative(number: int, column: int, rows: Rows, state: State) -> Floats:
    """Minus a table of a cluster, at the allowed alphas."""
    mine, others = rows[_ENDS[column][0]], rows[_ENDS[column][1]]
    begin = state.clusters.start[4 * number + column]
    wide = state.alpha_count[state.second[state.clusters.quads[number, column]]]
    found = np.empty((len(mine), len(others)))
    for x in range(len(mine)):
        for y in range(len(others)):
            found[x, y] = -state.clusters.tables[begin + mine[x] * wide + others[y]]
    return found


@compiled
def _store(
    number: int,
    column: int,
    rows: Rows,
    values: Floats,
    state: State,
) -> None:
    """Set a table of a cluster at the allowed alphas."""
    mine, others = rows[_ENDS[column][0]], rows[_ENDS[column][1]]
    begin = state.clusters.start[4 * number + column]
    wide = state.alpha_count[state.second[state.clusters.quads[number, column]]]
    for x in range(len(mine)):
        for y in range(len(others)):
            state.clusters.tables[begin + mine[x] * wide + others[y]] = values[x, y]
