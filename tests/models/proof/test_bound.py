"""The bound of a lattice against all labellings of small ones, after passes, with threads and pruning."""

from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.processes.compilation import crew
from crossfield.models.proof.bound.dual import Dual
from crossfield.models.proof.bound.lattice import Lattice
from crossfield.models.proof.bound.min_plus import RaggedMatrix, fill_product_over_beta, least_beta_cost
from crossfield.models.search.starts import first_field
from exhaustive import random_instance
from labellings import discrete, least_labelling

MASKS = ("11/11", "1111", "1", "111/010", "101/111", "10/11", "1/1/1", "11/01")


def small(seed):
    """An instance of at most five pixels, some in two parts or without any stroke near."""
    rng = np.random.default_rng(seed)
    rows = MASKS[seed % len(MASKS)].split("/")
    mask = np.array([[c == "1" for c in row] for row in rows])
    at = np.argwhere(mask)[np.sort(rng.permutation(mask.sum())[: rng.integers(1, 1 + mask.sum())])]
    return cf.Instance.on_pixels(
        "small", mask, at, rng.uniform(0, np.pi, len(at)), 1 - rng.random(len(at)),
        skew_coefficient=float(rng.choice([0, 1e-6, 1])),
        stroke_coefficient=float(rng.choice([0.1, 1, 1000])),
    )  # fmt: skip


def with_holes(lattice, seed):
    """The lattice with about half of its labels, at least one for each pixel, and some rows without any."""
    rng = np.random.default_rng(seed)
    rows = np.repeat(
        rng.random(lattice.alpha_count.sum()) < 0.7, np.repeat(lattice.beta_count, lattice.alpha_count)
    )
    allowed = rows & (rng.random(lattice.start[-1]) < 0.7)
    allowed[lattice.start[:-1] + 1] = True
    return replace(lattice, allowed=allowed)


def test_no_bound_exceeds_the_least_labelling_and_trees_reach_it():
    with crew(1) as hands:
        for seed in range(64):
            instance = small(seed)
            field = first_field(instance)
            whole = Lattice.whole(field, 4)
            lattice = with_holes(whole, seed) if seed // len(MASKS) % 2 else whole
            exact = least_labelling(*discrete(lattice))
            energy = field.energy().total
            scale = 1e-9 * (1 + max(energy, exact))
            assert exact <= energy + scale or lattice is not whole, seed
            dual, bounds = Dual(lattice, hands), []
            for _ in range(6):
                bounds += [dual.forward(), dual.backward()]
            dual.quantise()
            assert max(bounds) <= exact + scale
            assert (np.diff(bounds) >= -scale).all()
            assert dual.bound() <= exact
            close = 1e-6 * (1 + energy + instance.stroke_coefficient)  # the shares are as large as that
            assert dual.bound() == pytest.approx(bounds[-1], abs=close)
            tree = len(instance.grid.first) < instance.grid.size
            if tree:
                assert dual.bound() == pytest.approx(exact, abs=close), seed


def with_clusters(lattice, hands):
    """A dual with clusters on all quads, after two passes."""
    dual = Dual(lattice, hands)
    dual.ascend(1)
    dual.add_clusters(len(lattice.instance.grid.quads), first_field(lattice.instance))
    return dual


def test_any_tables_of_clusters_give_a_bound():
    with crew(1) as hands:
        for seed in range(12):
            rng = np.random.default_rng(seed)
            instance = random_instance(seed, ((2, 2), (2, 3), (3, 2))[seed % 3])
            lattice = Lattice.whole(first_field(instance), 4)
            lattice = with_holes(lattice, seed) if seed % 2 else lattice
            dual = with_clusters(lattice, hands)
            state = dual.state
            for values in (state.shares_first, state.shares_second, state.clusters.tables):
                values[:] = rng.normal(0, 0.3, len(values))
            assert dual.bound() <= least_labelling(*discrete(lattice))


def vortex():
    """An instance whose best field has a vortex."""
    instance = random_instance(44, (3, 3), strokes=9)
    return replace(instance, stroke_coefficient=30.0, skew_coefficient=1.0)


def test_no_update_of_clusters_lowers_the_bound():
    best = cf.greedy_field(vortex())
    assert len(best.singularities.index) == 1
    with crew(1) as hands:
        dual, bounds = Dual(Lattice.whole(best, 16), hands), []
        lost = dual.ascend(60) - dual.bound()  # for rounding
        passes = dual.bound()
        dual.add_clusters(4, best)
        for _ in range(25):
            dual.update_clusters()
            bounds += [dual.bound() + lost, dual.forward(), dual.backward()]
        assert (np.diff(bounds) >= -1e-9).all()
        assert passes < dual.bound() <= best.energy().total


def test_threads_change_no_bit():
    instance = cf.sample("bottle", 24)
    lattice = Lattice.whole(first_field(instance), 16)
    states = []
    for count in (1, 2, 3):
        with crew(count) as hands:
            dual = Dual(lattice, hands)
            dual.ascend(2)
            dual.add_clusters(5, first_field(instance))
            state = dual.state
            states.append(
                (dual.ascend(2), dual.bound(), state.shares_first.tobytes(), state.clusters.tables.tobytes())
            )
    assert lattice.start[-1] > 30_000  # so that they were used
    assert states[0] == states[1] == states[2]


@pytest.mark.parametrize("power", [1, 2])
def test_products_over_beta_are_the_least_over_all_labels(power):
    """Small lattices seldom have their least at the last labels of a row, where sweeps and envelopes end."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        h, sign = float(rng.uniform(0.001, 0.4)), float(rng.choice([-1, 1]))
        mine, other = (float(rng.normal()), h), (sign * float(rng.normal()), sign * h)
        costs, out = rng.normal(0, rng.choice([0.1, 10]), (7, rng.integers(2, 40))), np.empty((7, 23))
        costs[rng.random(costs.shape) < rng.choice([0.0, 0.5])] = np.inf
        begin, end = np.sort(rng.integers(0, costs.shape[1] + 1, (2, 7)), axis=0)
        y = np.arange(costs.shape[1])
        costs[(y < begin[:, None]) | (y >= end[:, None])] = np.inf
        fill_product_over_beta(RaggedMatrix(costs, (begin, end)), mine, other, power, out)
        x = mine[0] + h * np.arange(out.shape[1])
        cost = 2 * np.abs(x - (other[0] + other[1] * y)[:, None]) ** power
        np.testing.assert_allclose(out, (costs[:, :, None] + cost).min(axis=1), rtol=1e-12, atol=1e-12)
        assert least_beta_cost(mine, other, (len(x), len(y)), power) <= cost.min() * (1 + 1e-12) + 1e-15
