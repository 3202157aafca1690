"""The greatest share of a pair where some labels are not allowed, compared with dense costs."""

from dataclasses import replace

import numpy as np
import pytest
from crossfield.models.processes.compilation import crew
from crossfield.models.proof.bound.clusters import zero_clusters
from crossfield.models.proof.bound.dual import Dual
from crossfield.models.proof.bound.lattice import Lattice
from crossfield.models.proof.bound.min_plus import (
    RaggedMatrix,
    fill_product_over_beta,
    least_beta_cost,
    min_plus,
)
from crossfield.models.proof.bound.passes import fill_product, pair_minimum, shares_at
from crossfield.models.search.starts import first_field
from exhaustive import random_instance
from labellings import discrete

pytestmark = pytest.mark.numeric


def with_holes(lattice, rng):
    """The lattice with some rows of labels, and with half of the other labels."""
    rows = rng.random(lattice.alpha_count.sum()) < 0.7
    wide = np.repeat(lattice.beta_count, lattice.alpha_count)
    allowed = np.repeat(rows, wide) & (rng.random(lattice.start[-1]) < 0.5)
    allowed[lattice.start[:-1] + 1] = True  # one of each pixel
    return replace(lattice, allowed=allowed)


def dense_tables(state, pair, lattice):
    """The tables of a pair at all labels of its pixels."""
    i, j = state.pairs[pair]["first"], state.pairs[pair]["second"]
    rows, columns = (np.arange(lattice.count[end]) // lattice.beta_count[end] for end in (i, j))
    tables, clusters = np.zeros((len(rows), len(columns))), state.clusters
    for number in clusters.of_pair[pair][clusters.of_pair[pair] >= 0]:
        table = clusters.tables[clusters.start[number] : clusters.start[number + 1]]
        tables += table.reshape(lattice.alpha_count[i], -1)[np.ix_(rows, columns)]
    return tables


@pytest.mark.parametrize("seed", range(12))
def test_shares_and_minima_of_pairs_are_those_over_the_allowed_labels(seed):
    rng = np.random.default_rng(seed)
    instance = random_instance(seed, ((2, 2), (2, 3))[seed % 2])
    steps = (6, 2)[seed % 4 == 3]  # with 2, fewer rows than are computed at once
    lattice = with_holes(Lattice.whole(first_field(instance), steps), rng)
    allowed = np.split(lattice.allowed, lattice.start[1:-1])
    with crew(1) as hands:
        state = Dual(lattice, hands).state
    state = state._replace(clusters=zero_clusters(lattice, np.arange(seed % 3 > 0)))
    for values in (state.shares_first, state.shares_second, state.clusters.tables):
        values[:] = rng.normal(0, 0.5, len(values))
    for pair, (i, j, bare) in enumerate(discrete(lattice)[1]):
        cost = bare + dense_tables(state, pair, lattice)
        for mine, other, costs in ((i, j, cost), (j, i, cost.T)):
            out = np.full(lattice.count[mine], np.nan)
            fill_product(pair, mine, state, out)
            most = (costs - shares_at(pair, other, state))[:, allowed[other]].min(axis=1)
            np.testing.assert_allclose(out[allowed[mine]], most[allowed[mine]], rtol=0, atol=1e-12)
        rest = cost - shares_at(pair, i, state)[:, None] - shares_at(pair, j, state)
        least = rest[np.ix_(allowed[i], allowed[j])].min()
        assert pair_minimum(pair, state) == pytest.approx(least, abs=1e-12)


@pytest.mark.parametrize("shape", [(1, 1, 1), (3, 9, 4), (9, 3, 4), (4, 4, 1), (5, 6, 7), (8, 11, 13)])
def test_min_plus_products_are_the_least_sums(shape):
    rows, terms, columns = shape
    rng = np.random.default_rng(0)
    left, right = rng.normal(size=(rows, terms)), rng.normal(size=(terms, columns))
    left[rng.random(left.shape) < 0.4] = np.inf
    least = (left[:, :, None] + right).min(axis=1)
    np.testing.assert_array_equal(min_plus(left, right), least)


@pytest.mark.parametrize("power", [1, 2])
@pytest.mark.parametrize("seed", range(20))
def test_products_over_beta_are_the_least_over_all_labels(power, seed):
    rng = np.random.default_rng(seed)
    h, sign = float(rng.uniform(0.001, 0.4)), float(rng.choice([-1, 1]))
    mine, other = (float(rng.normal()), h), (sign * float(rng.normal()), sign * h)
    costs = rng.choice([0.1, 10.0]) * rng.normal(size=(7, rng.integers(2, 40)))
    costs[rng.random(costs.shape) < rng.choice([0.0, 0.5])] = np.inf
    costs[3] = np.inf
    begin, end = rng.integers(0, costs.shape[1], (2, 7))
    used = (np.arange(costs.shape[1]) >= begin[:, None]) & (np.arange(costs.shape[1]) < end[:, None])
    costs[~used] = np.nan
    out = np.full((7, rng.integers(2, 40)), np.inf)
    fill_product_over_beta(RaggedMatrix(costs, (begin, np.maximum(begin, end))), mine, other, power, out)
    costs[~used] = np.inf
    x, y = (
        first + step * np.arange(n) for (first, step), n in ((mine, out.shape[1]), (other, costs.shape[1]))
    )
    cost = 2 * np.abs(x - y[:, None]) ** power
    np.testing.assert_allclose(out, (costs[:, :, None] + cost).min(axis=1), rtol=1e-12, atol=1e-12)
    counts = (out.shape[1], costs.shape[1])
    assert least_beta_cost(mine, other, counts, power) <= cost.min() * (1 + 1e-12) + 1e-15
