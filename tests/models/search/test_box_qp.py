"""The best angles for given jumps: conditions of optimality, and angles that the energy leaves open."""

from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from angles import HALF, QUARTER
from cases import make_field
from crossfield.models.search.box_qp import fit_in_box
from crossfield.models.search.reproducible_angles import reproducible_field
from exhaustive import random_instance
from hypothesis import given, settings
from hypothesis import strategies as st
from loops import for_each

SEEDS = st.integers(0, 2**32 - 1)


def gradient(field):
    """The gradient of the energy in (alpha, beta) by the chain rule through the residuals, shape (2, n)."""
    instance, grid = field.instance, field.instance.grid
    a, b = 4 * field.residual_a, 4 * field.residual_b
    r = np.zeros(grid.size)
    r[instance.stroke_index] = 2 * instance.stroke_coefficient * instance.w * field.residual_r
    sign = (-1.0) ** field.p
    of_alpha, of_beta = r.copy(), r + 2 * instance.skew_coefficient * field.beta
    np.add.at(of_alpha, grid.first, a)
    np.add.at(of_alpha, grid.second, -a)
    np.add.at(of_beta, grid.first, sign * b)
    np.add.at(of_beta, grid.second, -b)
    return np.stack([of_alpha, of_beta])


def assert_optimal(field):
    """The conditions of Karush, Kuhn and Tucker, which suffice for a convex problem;
    the number of active bounds comes back.
    """
    instance, quarter = field.instance, np.full(len(field.beta), QUARTER)
    x = np.stack([field.alpha, field.beta])
    lower, upper = np.stack([instance.alpha_lower, -quarter]), np.stack([instance.alpha_upper, quarter])
    assert (x >= lower).all()
    assert (x <= upper).all()
    slope = gradient(field)
    moves = np.where(slope > 0, x > lower, x < upper)
    scale = 1 + HALF * 4 * np.abs(field.p).max(initial=0) + np.pi * instance.stroke_coefficient
    assert np.abs(slope[moves]).max(initial=0) < 1e-9 * scale
    return int(np.sum(~moves))


@given(
    seed=SEEDS,
    gauge=st.sampled_from(["strokes", "box"]),
    skew_coefficient=st.sampled_from([0, 1e-6, 1e-3, 1]),
    stroke_coefficient=st.sampled_from([0, 1e-6, 1, 100]),
)
@settings(deadline=None, max_examples=20)
def test_random_jumps_are_fitted_to_the_optimum(seed, gauge, skew_coefficient, stroke_coefficient):
    instance = random_instance(seed, strokes=20, gauge=gauge)
    weights = {"skew_coefficient": skew_coefficient, "stroke_coefficient": stroke_coefficient}
    field = make_field(replace(instance, **weights), seed)
    best = fit_in_box(field)
    assert_optimal(best)
    assert (best.p == field.p).all()
    assert best.energy().total <= field.energy().total


@pytest.mark.parametrize("gauge", ["strokes", "box"])
def test_thousands_of_active_bounds_are_found(gauge):
    instance = random_instance(3, (50, 60), 1500, gauge)
    assert assert_optimal(fit_in_box(make_field(instance, 0))) > 400


def test_angles_stay_where_the_energy_does_not_say():
    mask = np.ones((3, 9), bool)
    mask[:, 4] = False
    instance = cf.Instance.on_pixels("parts", mask, [[0, 0]], [0.7], [1.0], skew_coefficient=0)
    rng = np.random.default_rng(0)
    start = cf.CrossField(instance, *rng.uniform(0.3, 0.5, (2, 24)), np.zeros(len(instance.p_min)))
    field = fit_in_box(start)
    apart = instance.grid.columns > 4
    for before, after in ((start.alpha, field.alpha), (start.beta, field.beta)):
        # The nearest constant is the mean.
        assert after[apart] == pytest.approx(np.full(12, before[apart].mean()), abs=1e-6)
    assert field.energy().total == pytest.approx(0, abs=1e-18)


@for_each("gauge", ["strokes", "box"])
@for_each("seed", range(3))
def test_pinned_angles_depend_on_the_jumps_alone(seed, gauge):
    instance = random_instance(seed, (4, 5), 10, gauge)
    field, other = (make_field(instance, number) for number in (seed, seed + 100))
    pinned, same = (
        reproducible_field(field),
        reproducible_field(cf.CrossField(instance, other.alpha, other.beta, field.p)),
    )
    assert pinned.alpha.tobytes() == same.alpha.tobytes()
    assert pinned.beta.tobytes() == same.beta.tobytes()
    assert_optimal(pinned)
    assert pinned.energy().total <= fit_in_box(field).energy().total * (1 + 1e-12)
    again = reproducible_field(pinned)
    assert again.alpha.tobytes() == pinned.alpha.tobytes()
    assert again.beta.tobytes() == pinned.beta.tobytes()


@for_each("stroke_coefficient", [0, 1])
@for_each("skew_coefficient", [0, 1e-6])
def test_pinned_angles_are_optimal_where_the_energy_does_not_say_all(skew_coefficient, stroke_coefficient):
    instance = replace(
        random_instance(7, (5, 5), 12, "box"),
        skew_coefficient=skew_coefficient,
        stroke_coefficient=stroke_coefficient,
    )
    assert_optimal(reproducible_field(make_field(instance, 7)))


def test_pinned_angles_of_a_part_without_strokes_stay():
    mask = np.array([[True, True, False, True, True]])
    instance = cf.Instance.on_pixels("parts", mask, np.array([[0, 0]]), np.array([0.3]), np.ones(1))
    alpha = np.array([0.3, 0.3, 0.7, 0.7])
    field = reproducible_field(cf.CrossField(instance, alpha, np.zeros(4), np.zeros(2, int)))
    assert field.alpha.tolist() == alpha.tolist()
