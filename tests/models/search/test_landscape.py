"""Walks over jumps on odd instances: whatever updates lose, energies are those of their definition,
and every walk ends.
"""

from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.field.field import CrossField
from crossfield.models.instance.least_squares import residuals_at
from crossfield.models.processes.deadline import Deadline
from crossfield.models.search.box_qp import minimise_in_box, stroke_bounds
from crossfield.models.search.improvement import pixel_curves
from crossfield.models.search.landscape import _HOLD, STEPS, Landscape, Patch
from crossfield.models.search.search import _Hunt
from crossfield.models.search.starts import first_field
from crossfield.models.search.walk import StrokePerturbations, explore
from hypothesis import given, settings
from hypothesis import strategies as st
from odd_instances import odd_instance
from threadpoolctl import threadpool_limits

pytestmark = pytest.mark.numeric

SEEDS = st.integers(0, 2**32 - 1)


@pytest.fixture(autouse=True, scope="module")
def one_thread():
    """Small systems: on a busy machine threads would wait for each other."""
    with threadpool_limits(1):
        yield


def definition(instance, x, p):
    return CrossField(instance, *np.split(x, 2), p).energy().total


def assert_as_defined(land):
    """The energy of a landscape is the energy of its angles and jumps plus all penalties."""
    energy = definition(land.patch.instance, land.angles, land.p)
    held = sum(_HOLD * (land._x[place] - bound) ** 2 for place, bound in land._held.items())
    soft = float(land._soft @ land._x**2)
    assert land.energy >= 0
    assert land.energy == pytest.approx(energy + held + soft, rel=1e-9, abs=1e-9)


def walked(instance, seed, perturbations, steps):
    """Perturb, then make the best change of one jump for some steps; check every point on the way."""
    field = first_field(instance)
    patch = Patch.of(instance, np.ones(instance.grid.size, bool))
    if not len(patch.pairs):
        return
    land = Landscape(patch, np.concatenate([field.alpha, field.beta]), field.p)
    draw, rng = StrokePerturbations(patch, pixel_curves(instance)).draw, np.random.default_rng(seed)
    for _ in range(perturbations):
        land.change(*draw(rng, land.offsets))
        assert_as_defined(land)
        for _ in range(steps):
            gains = land.gains()
            assert (land.energy + gains >= -1e-7 * (1 + land.energy)).all()
            row, pair = np.unravel_index(np.argmin(gains), gains.shape)
            land.change(np.array([pair]), STEPS[[row]])
            assert_as_defined(land)
        for _ in range(steps if len(patch.strokes) else 0):
            gains = land.turn_gains()
            assert (land.energy + gains >= -1e-7 * (1 + land.energy)).all()
            land.turn(int(np.argmin(gains)))
            assert_as_defined(land)


def explored(instance, seed, perturbations):
    """Results of the patches of a round, checked, and a round of the search."""
    tasks = _Hunt(instance, seed, [first_field(instance)]).tasks(Deadline(np.inf))
    lower, upper = stroke_bounds(instance)
    for task in tasks:
        better, complete = explore(replace(task, perturbations=perturbations))
        assert complete
        if better is not None:
            assert 0 <= better.energy < definition(instance, task.x, task.p)
            assert better.energy == pytest.approx(
                definition(instance, better.x, better.p), rel=1e-9, abs=1e-9
            )
            assert (better.x >= lower).all()
            assert (better.x <= upper).all()


@given(seed=SEEDS)
@settings(deadline=None, max_examples=25)
def test_energies_on_odd_instances_are_those_of_their_definition(seed):
    instance = odd_instance(seed, np.random.default_rng(seed).integers(1, 13, 2))
    walked(instance, seed, perturbations=3, steps=4)
    explored(instance, seed, perturbations=2)


@pytest.mark.parametrize(
    "name, size, seed", [("wave_sheet", 5, 0), ("bottle", 8, 0), ("cylinder_bend", 7, 1)]
)
def test_a_walk_that_leaves_and_enters_a_soft_state_keeps_its_energy(name, size, seed):
    walked(cf.sample(name, size), seed, perturbations=60, steps=6)


def unbounded(instance, x, p):
    """The least energy of all angles without bounds, by a solve of the whole system."""
    infinite = np.full(len(x), np.inf)
    return definition(instance, minimise_in_box(residuals_at(instance, p), x, -infinite, infinite), p)


def test_the_gain_of_a_turn_is_the_change_of_the_least_energy():
    instance = cf.sample("saddle", 8)
    field = first_field(instance)
    patch = Patch.of(instance, np.ones(instance.grid.size, bool))
    land = Landscape(patch, np.concatenate([field.alpha, field.beta]), field.p)
    home, gains = land.save_state(), land.turn_gains()
    before = unbounded(instance, land.angles, land.p)
    assert home.energy == pytest.approx(before, rel=1e-6)  # no bound holds an angle
    changes = []
    for stroke in range(len(gains)):
        land.turn(stroke)
        changes.append(unbounded(instance, land.angles, land.p) - before)
        land.restore(home)
    assert len(gains) == len(instance.theta)
    assert gains == pytest.approx(np.array(changes), rel=1e-6)
