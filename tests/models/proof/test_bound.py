"""The bound of a lattice against all labellings of small ones, after passes, with threads and pruning."""

from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.instance.instance import Instance
from crossfield.models.processes.compilation import crew
from crossfield.models.proof.bound.dual import Dual
from crossfield.models.proof.bound.lattice import Lattice
from crossfield.models.search.starts import first_field
from exhaustive import random_instance
from labellings import discrete, least_labelling

pytestmark = pytest.mark.numeric

MASKS = ("11/11", "1111", "1", "111/010", "101/111", "10/11", "1/1/1", "11/01")


def small(seed):
    """An instance of at most five pixels, some in two parts or without any stroke near."""
    rng = np.random.default_rng(seed)
    rows = MASKS[seed % len(MASKS)].split("/")
    mask = np.array([[c == "1" for c in row] for row in rows])
    at = np.argwhere(mask)[np.sort(rng.permutation(mask.sum())[: rng.integers(1, 1 + mask.sum())])]
    return Instance.on_pixels(
        "small", mask, at, rng.uniform(0, np.pi, len(at)), 1 - rng.random(len(at)),
        skew_coefficient=float(rng.choice([0, 1e-6, 1])),
        stroke_coefficient=float(rng.choice([0.1, 1, 1000])),
    )  # fmt: skip


def test_no_bound_exceeds_the_least_labelling_and_trees_reach_it():
    with crew(1) as hands:
        for seed in range(200):
            instance = small(seed)
            field = first_field(instance)
            lattice = Lattice.whole(field, 4)
            exact = least_labelling(*discrete(lattice))
            energy = field.energy().total
            scale = 1e-9 * (1 + energy)
            assert exact <= energy + scale, seed
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


def test_any_shares_give_a_bound():
    with crew(1) as hands:
        for seed in range(40):
            instance = small(seed)
            lattice = Lattice.whole(first_field(instance), 4)
            dual, rng = Dual(lattice, hands), np.random.default_rng(seed)
            state = dual.state
            for shares in (state.shares_first, state.shares_second):
                shares[:] = rng.normal(0, 3, len(shares))
            assert dual.bound() <= least_labelling(*discrete(lattice))


def with_clusters(lattice, hands):
    """A dual with clusters on all quads, after two passes."""
    dual = Dual(lattice, hands)
    dual.ascend(1)
    dual.add_clusters(len(lattice.instance.grid.quads), first_field(lattice.instance))
    return dual


def test_any_tables_of_clusters_give_a_bound():
    with crew(1) as hands:
        for seed in range(40):
            rng = np.random.default_rng(seed)
            instance = random_instance(seed, ((2, 2), (2, 3), (3, 2))[seed % 3])
            lattice = Lattice.whole(first_field(instance), 4)
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
