"""The search: its formulas against dense least squares, its answers against all jumps,
and what it promises.
"""

import threading
from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from children import interrupted
from crossfield.models.errors import InstanceError
from crossfield.models.instance.angles import QUARTER
from crossfield.models.processes.deadline import Deadline
from crossfield.models.search.coarse_grid import copy_to_fine_grid, halve_resolution
from crossfield.models.search.greedy import greedy_field
from crossfield.models.search.improvement import improved_field, pixel_curves
from crossfield.models.search.landscape import STEPS, Landscape, Patch
from crossfield.models.search.starts import first_field
from crossfield.models.search.walk import PatchTask, StrokePerturbations, explore
from exhaustive import assert_feasible, exact, least_energy, random_instance, sketch
from hypothesis import given, settings
from hypothesis import strategies as st

pytestmark = pytest.mark.numeric

SEEDS = st.integers(0, 2**32 - 1)


def angles(field):
    return np.concatenate([field.alpha, field.beta])


def landscape(field, free=None):
    size = field.instance.grid.size
    patch = Patch.of(field.instance, np.ones(size, bool) if free is None else free)
    return Landscape(patch, angles(field), field.p)


def perturbations_of(patch):
    return StrokePerturbations(patch, pixel_curves(patch.instance))


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
@settings(deadline=None, max_examples=25)
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


def test_bounds_hold_after_changes():
    field = first_field(random_instance(4, shape=(5, 6), strokes=12))
    land = landscape(field)
    perturbations, rng = perturbations_of(land.patch), np.random.default_rng(0)
    for _ in range(30):
        land.change(*perturbations.draw(rng, land.offsets))
        beta = np.split(land.angles, 2)[1]
        assert np.abs(beta).max() < QUARTER + 1e-2


def test_angles_outside_the_patch_stay():
    field = first_field(cf.sample("mouse", 12))
    grid = field.instance.grid
    free = grid.columns < 6
    land = landscape(field, free)
    assert land.energy == pytest.approx(field.energy().total, rel=1e-6)
    perturbations, rng = perturbations_of(land.patch), np.random.default_rng(3)
    for _ in range(5):
        land.change(*perturbations.draw(rng, land.offsets))
    outside = np.concatenate([~free, ~free])
    assert (land.angles[outside] == angles(field)[outside]).all()
    across = ~(free[grid.first] & free[grid.second])
    assert (land.p[across] == field.p[across]).all()


def turns(instance, p):
    bottom, side, top, left = instance.grid.quads.T
    return p[bottom] + p[side] - p[top] - p[left]


def test_a_turn_makes_no_singularity_and_a_shift_moves_at_most_two():
    field = first_field(cf.sample("ring", 14))
    land = landscape(field)
    perturbations, rng = perturbations_of(land.patch), np.random.default_rng(5)
    before = turns(field.instance, field.p)
    moved = set()
    for _ in range(200):
        for change, most in ((perturbations.turn(rng), 0), (perturbations.walk(rng, land.offsets), 2)):
            pairs, steps = change
            assert len(pairs) == len(set(pairs.tolist()))
            p = field.p.copy()
            p[land.patch.pairs[pairs]] += steps
            changed = turns(field.instance, p) - before
            assert (changed != 0).sum() <= most
            moved.add(int(np.abs(changed).sum()))
    assert moved >= {0, 1, 2}


@pytest.mark.parametrize(
    "seed", [*range(2), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 10))]
)
def test_search_finds_the_optimum_over_all_jumps(seed):
    instance = random_instance(seed, shape=(2, 3), strokes=6)
    field = cf.search(instance, rounds=2).field
    least = exact(instance)
    assert field.energy().total >= least - 1e-9
    if np.abs(field.beta).max() < QUARTER - 1e-3:
        assert field.energy().total == pytest.approx(least, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("name", ["skew", "singular", "bottle"])
def test_search_is_never_above_what_it_starts_from(name):
    instance = cf.sample(name, 10)
    start = cf.power_field(instance)
    result = cf.search(instance, rounds=1, start=start).field
    for other in (greedy_field(instance), first_field(instance), start):
        assert result.energy().total <= other.energy().total + 1e-9
    assert_feasible(result)


def test_a_start_on_another_instance_is_refused_and_one_in_the_other_gauge_is_taken():
    start = greedy_field(cf.sample("skew", 6))
    with pytest.raises(InstanceError, match=r"the field is on another instance .* not on this one"):
        cf.search(cf.sample("skew", 5), rounds=0, jobs=1, start=start)
    other = start.instance.with_gauge("box")
    assert cf.search(other, rounds=0, jobs=1, start=start).field.instance is other


def test_a_small_grid_is_searched_from_several_starts():
    """From the lowest start alone, three rounds lead to an energy of 6.914."""
    field = cf.search(cf.random_instance(9, size=12), rounds=3, jobs=1).field
    assert field.energy().total < 6.82


@pytest.mark.parametrize("gauge", ["strokes", pytest.param("box", marks=pytest.mark.slow)])
def test_same_seed_gives_the_same_bits_in_one_process_and_in_two(gauge):
    instance = cf.sample("mouse", 10).with_gauge(gauge)
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


@pytest.mark.parametrize("name", ["mouse", "wave_sheet"])
def test_a_search_without_time_gives_a_field_within_its_bounds(name):
    instance = cf.sample(name, 24)
    result = cf.search(instance, limits=cf.Limits(1e-9), jobs=1)
    assert (result.rounds, result.ended) == (0, "time")
    assert_feasible(result.field)


class Hourglass:
    """A time limit that is over after a number of calls, and counts them."""

    def __init__(self, grains):
        self.grains, self.count = grains, 0

    def __call__(self):
        self.count += 1
        return self.count > self.grains


WORK = {
    "greedy": lambda is_over: greedy_field(cf.sample("mouse", 16), stop=is_over),
    "improved": lambda is_over: improved_field(greedy_field(cf.sample("mouse", 16)), stop=is_over),
}


@pytest.mark.parametrize("work", WORK)
def test_work_ends_soon_after_its_time_and_gives_a_field(work):
    whole = Hourglass(np.inf)
    WORK[work](whole)
    assert whole.count > 10
    for grains in (0, 3, whole.count // 2):
        time = Hourglass(grains)
        assert np.isfinite(WORK[work](time).energy().total)
        assert time.count - grains <= 8


def test_a_patch_without_time_is_not_whole_and_its_walk_stops():
    field = first_field(cf.sample("mouse", 12))
    free, curve = np.ones(field.instance.grid.size, bool), np.full(field.instance.grid.size, -1)
    task = PatchTask(field.instance, angles(field), field.p, free, curve, 10**9, (0,), Deadline.after(0.0))
    assert explore(task) == (None, False)


def test_an_event_ends_a_search_with_the_best_field_so_far():
    instance, asked = cf.sample("ring", 10), threading.Event()
    result = cf.search(instance, jobs=1, progress=lambda line: asked.set(), stop=asked)
    assert (result.rounds, result.ended) == (1, "interrupted")
    assert result.field.energy().total <= first_field(instance).energy().total + 1e-9


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


@given(seed=SEEDS, gauge=st.sampled_from(["strokes", "box"]))
@settings(deadline=None, max_examples=30)
def test_improved_fields_are_no_worse_and_stay_improved(seed, gauge):
    field = greedy_field(random_instance(seed, gauge=gauge))
    better = improved_field(field)
    assert better.energy().total <= field.energy().total
    assert improved_field(better).energy().total == pytest.approx(better.energy().total, rel=1e-6, abs=1e-12)


def prolong_field(coarse, instance):
    return improved_field(copy_to_fine_grid(coarse, instance).fit_in_bounds())


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


@pytest.mark.slow
@pytest.mark.parametrize("skew_coefficient", [0.0, 1e-6])
def test_parts_without_strokes_and_free_skews_do_no_harm(skew_coefficient):
    mask = np.ones((6, 11), bool)
    mask[:, 5] = False
    theta = np.full(mask.shape, np.nan)
    theta[:, 1], theta[2, 2:5], theta[4, 3] = 0.3, 1.2, 2.5
    field = cf.search(sketch(mask, theta, skew_coefficient=skew_coefficient), rounds=4).field
    assert field.energy().total <= first_field(field.instance).energy().total + 1e-9
    assert field.image(field.pixel_energy)[:, 6:] == pytest.approx(np.zeros((6, 5)), abs=1e-12)
