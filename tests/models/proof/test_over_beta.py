"""Products over beta, compared with the least over all labels."""

import numpy as np
import pytest
from crossfield.models.proof.over_beta import Given, least_cost, over_beta


@pytest.mark.parametrize("power", [1, 2])
@pytest.mark.parametrize("seed", range(20))
def test_products_over_beta_are_the_least_over_all_labels(power, seed):
    rng = np.random.default_rng(seed)
    h, sign = float(rng.uniform(0.001, 0.4)), float(rng.choice([-1, 1]))
    mine, other = (float(rng.normal()), h), (sign * float(rng.normal()), sign * h)
    given = rng.choice([0.1, 10.0]) * rng.normal(size=(7, rng.integers(2, 40)))
    given[rng.random(given.shape) < rng.choice([0.0, 0.5])] = np.inf
    given[3] = np.inf
    begin, end = rng.integers(0, given.shape[1], (2, 7))
    used = (np.arange(given.shape[1]) >= begin[:, None]) & (np.arange(given.shape[1]) < end[:, None])
    given[~used] = np.nan
    out = np.full((7, rng.integers(2, 40)), np.inf)
    over_beta(Given(given, (begin, np.maximum(begin, end))), mine, other, power, out)
    given[~used] = np.inf
    x, y = (
        first + step * np.arange(n) for (first, step), n in ((mine, out.shape[1]), (other, given.shape[1]))
    )
    cost = 2 * np.abs(x - y[:, None]) ** power
    np.testing.assert_allclose(out, (given[:, :, None] + cost).min(axis=1), rtol=1e-12, atol=1e-12)
    counts = (out.shape[1], given.shape[1])
    assert least_cost(mine, other, counts, power) <= cost.min() * (1 + 1e-12) + 1e-15
