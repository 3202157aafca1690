"""The search: its formulas against dense least squares, its answers against all jumps,
and what it promises.
"""

from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from angles import QUARTER
from children import interrupted
from crossfield.models.search.coarse_grid import copy_to_fine_grid, halve_resolution
from crossfield.models.search.landscape import STEPS, Landscape, Patch
from crossfield.models.search.starts import first_field
from exhaustive import exact, least_energy, random_instance, sketch
from hypothesis import given, settings
from hypothesis import strategies as st

SEEDS = st.integers(0, 2**32 - 1)


def angles(field):
    return np.concatenate([field.alpha, field.beta])


def landscape(field, free=None):
    size = field.instance.grid.size
    patch = Patch.of(field.instance, np.ones(size, bool) if free is None else free)
    return Landscape(patch, angles(field), field.p)


def gentle(seed, spread=0):
    """An instance whose strokes are so close in direction that no bound matters for small jumps.

    The weights of its pairs lie up to that many powers of ten from 1.
    """
    rng = np.random.default_rng(seed)
    theta = np.where(rng.random((4, 5)) < 0.4, 1.0 + 0.2 * rng.random((4, 5)), np.nan)
    theta[0, 0] = 1.0
    instance = sketch(np.ones((4, 5), bool), theta, skew_coefficient=0.1)
    return replace(instance, pair_weights=10 ** rng.uniform(-spread, spread, len(instance.grid.first)))


@given(seed=SEEDS, spread=st.sampled_from([0, 1, 2]))
@settings(max_examples=8)
def test_gains_are_those_of_dense_least_squares(seed, spread):
    field = first_field(gentle(seed, spread))
    land = landscape(field)
    gains = land.gains()
    rng = np.random.default_rng(seed)
    for pair in rng.integers(len(field.p), size=4):
        for row, step in enumerate(STEPS):
            p = field.p.copy()
            p[pair] += step
            assert land.energy + gains[row, pair] == pytest.approx(
                least_energy(field.instance, p[None])[0], rel=1e-6
            )


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 5))])
def test_search_finds_the_optimum_over_all_jumps(seed):
    instance = random_instance(seed, shape=(2, 3), strokes=6)
    field = cf.search(instance, rounds=2, jobs=1).field
    least = exact(instance)
    assert field.energy().total >= least - 1e-9
    if np.abs(field.beta).max() < QUARTER - 1e-3:
        assert field.energy().total == pytest.approx(least, rel=1e-6, abs=1e-9)


def test_a_start_in_the_other_gauge_is_taken():
    start = cf.greedy_field(cf.sample("skew", 6))
    other = start.instance.with_gauge("box")
    assert cf.search(other, rounds=0, jobs=1, start=start).field.instance is other


def test_a_search_that_ends_at_once_is_no_worse_than_its_start():
    best = cf.search(cf.sample("mouse", 12), rounds=0, jobs=1).field
    ways = [cf.search(best.instance, jobs=1, start=start, stop=lambda: True) for start in (None, best)]
    alone, ended = (way.field.energy().total for way in ways)
    assert ended <= best.energy().total + 1e-9 < alone


@pytest.mark.slow
def test_a_small_grid_is_searched_from_several_starts():
    """From the lowest start alone, three rounds lead to an energy of 6.914."""
    field = cf.search(cf.random_instance(9, size=12), rounds=3, seed=1, jobs=1).field
    assert field.energy().total < 6.82


@pytest.mark.slow
def test_same_seed_gives_the_same_bits_in_one_process_and_in_two():
    instance = cf.sample("mouse", 6)
    fields = [cf.search(instance, rounds=2, seed=7, jobs=jobs).field for jobs in (1, 2)]
    for name in ("alpha", "beta", "p"):
        assert len({getattr(field, name).tobytes() for field in fields}) == 1


@pytest.mark.slow
def test_a_large_grid_is_searched_by_patches():
    instance = cf.sample("mouse", 40)
    messages = []
    result = cf.search(instance, rounds=2, progress=messages.append)
    assert result.field.energy().total < first_field(instance).energy().total
    assert (result.rounds, result.ended) == (2, "rounds")
    assert [line.split(" after ")[1] for line in messages] == ["1 rounds", "2 rounds"]


def test_a_search_begins_far_below_the_improved_greedy_field():
    instance = cf.sample("mouse", 56)
    first = cf.search(instance, rounds=0, jobs=1).field.energy().total
    assert first < 0.9 * cf.improved_field(cf.greedy_field(instance)).energy().total


def test_searches_and_proofs_begin_at_most_at_the_field_of_the_polyvector():
    instance = cf.sample("mouse", 16)
    polyvector = cf.improved_field(cf.polyvector_field(instance)).energy().total
    assert cf.search(instance, rounds=0, jobs=1).field.energy().total <= polyvector + 1e-9
    assert cf.prove(instance, work=10, jobs=1).energy <= polyvector + 1e-9


CHILD = """
import crossfield as cf
if True:
    instance = cf.sample("mouse", 16)
    found = cf.search(instance, jobs=2, progress=lambda line: print(line.split()[-2], flush=True))
    print(found.ended, found.field.energy().total)
"""


@pytest.mark.slow
def test_ctrl_c_gives_the_best_field_so_far():
    ended, energy = interrupted(CHILD)
    assert ended == "interrupted"
    assert float(energy) <= first_field(cf.sample("mouse", 16)).energy().total + 1e-9


def prolong_field(coarse, instance):
    return cf.improved_field(copy_to_fine_grid(coarse, instance).fit_in_bounds())


def test_a_constant_field_stays_constant_on_finer_grids():
    theta = np.full((9, 7), np.nan)
    theta[2], theta[6], theta[3:6, 3] = 0.3, 0.3, 1.6
    fine = sketch(np.ones(theta.shape, bool), theta)
    coarse = halve_resolution(fine)
    assert coarse.mask.shape == (5, 4)
    field = prolong_field(first_field(coarse), fine)
    assert field.energy().total < fine.grid.size * fine.skew_coefficient
    assert not len(field.singularities.index)


def test_smooth_energy_is_the_same_on_both_grids():
    # A quarter turn of the frame round the middle, with the exact field in between on both grids.
    rows, columns = np.mgrid[0:32, 0:32]
    around = np.arctan2(-(rows - 15.5), columns - 15.5) / 4
    theta = np.where((rows - 15.5) ** 2 + (columns - 15.5) ** 2 > 14**2, around, np.nan)
    fine = sketch(np.ones(theta.shape, bool), theta)
    field, above = first_field(fine), first_field(halve_resolution(fine))
    assert field.singularities.index.tolist() == above.singularities.index.tolist() == [0.25]
    assert prolong_field(above, fine).singularities.index.tolist() == [0.25]
    assert prolong_field(above, fine).energy().total == pytest.approx(field.energy().total, rel=0.01)
