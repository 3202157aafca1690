"""Parts without strokes, weights of pairs, right angles: every method against smaller or scaled copies."""

from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from exhaustive import assert_feasible, random_field


def strip(width, more_columns=0, **more):
    """22 rows of pixels, strokes in the first columns, and further columns without strokes behind a gap."""
    mask = np.ones((22, width + 1 + more_columns), bool)
    mask[:, width] = False
    rng = np.random.default_rng(0)
    at = np.argwhere(rng.random((22, width)) < 0.1)
    theta = 0.2 * at[:, 0] + rng.normal(0, 0.1, len(at))
    return cf.Instance.on_pixels("strip", mask, at, theta, np.ones(len(at)), stroke_coefficient=2.0, **more)


METHODS = {
    "greedy": cf.greedy_field,
    "power": cf.power_field,
    "polyvector": cf.polyvector_field,
    "bend": lambda instance: cf.bend_field(cf.polyvector_field(instance)),
    "improved": lambda instance: cf.improved_field(cf.power_field(instance)),
    "search": lambda instance: cf.search(instance, rounds=0, jobs=1).field,
}


@pytest.mark.parametrize("orthogonal", [False, True])
@pytest.mark.parametrize("method", METHODS)
def test_a_part_without_strokes_changes_nothing(method, orthogonal):
    part, whole = (METHODS[method](strip(10, columns, orthogonal=orthogonal)) for columns in (0, 20))
    assert whole.energy().total == pytest.approx(part.energy().total, rel=1e-6)
    assert whole.image(whole.pixel_energy)[:, 11:] == pytest.approx(np.zeros((22, 20)), abs=1e-9)


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_patches_lie_where_strokes_are(jobs):
    """The part with strokes is one patch; together with the other one the grid is larger than a patch."""
    instance = strip(3, 20)
    assert instance.grid.size > 400
    start = random_field(instance, 1)
    result = cf.search(instance, rounds=1, jobs=jobs, start=start)
    assert not result.field.image(result.field.pixel_energy, fill=0.0)[:, 4:].any()
    assert result.field.energy().total <= cf.search(strip(3), rounds=0).field.energy().total + 1e-9
    assert_feasible(result.field)


def weighted(instance, factor):
    """The instance with all weights of the energy times a factor."""
    return replace(
        instance,
        pair_weights=np.full(len(instance.grid.first), factor),
        stroke_coefficient=factor * instance.stroke_coefficient,
        skew_coefficient=factor * instance.skew_coefficient,
    )


@pytest.mark.parametrize("size, rounds", [(7, 1), pytest.param(60, 0, marks=pytest.mark.slow)])
def test_a_factor_of_all_weights_is_one_of_the_energy(size, rounds):
    instance = cf.sample("saddle", size)
    plain, scaled = (
        cf.search(each, rounds=rounds, jobs=1).field for each in (instance, weighted(instance, 4.0))
    )
    assert scaled.energy().total == pytest.approx(4 * plain.energy().total, rel=1e-6)


@pytest.mark.parametrize("gauge", ["strokes", "box"])
def test_the_polyvector_field_of_right_angles_is_the_power_field(gauge):
    instance = replace(cf.sample("mouse", 20), orthogonal=True, gauge=gauge)
    polyvector, power = cf.polyvector_field(instance), cf.power_field(instance)
    assert not polyvector.beta.any()
    assert np.array_equal(polyvector.p, power.p)
    assert polyvector.alpha == pytest.approx(power.alpha, abs=1e-7)


@pytest.mark.parametrize("method", ["greedy", "search"])
def test_a_stroke_too_light_for_the_digits_of_a_system_is_no_error(method):
    instance = cf.Instance.on_pixels(
        "light", np.ones((3, 3), bool), [[0, 0]], [0.3], [1e-12], stroke_coefficient=1e-9, orthogonal=True
    )
    assert METHODS[method](instance).energy().total <= 1e-21 * 0.3**2 * (1 + 1e-3)
