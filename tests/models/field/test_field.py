"""Cross fields: degenerate and narrow crosses, refusals, labels and jumps, against vectors and symmetries."""

import crossfield as cf
import numpy as np
import pytest
from angles import HALF, QUARTER
from crossfield.models.field.field import field_in_windows
from exhaustive import random_field, random_instance
from hypothesis import given, settings
from hypothesis import strategies as st
from instance_kinds import grid

SEEDS = st.integers(0, 2**32 - 1)


def test_degenerate_where_lines_are_closer_than_five_degrees():
    edge = np.radians(42.5)
    beta = [edge - 1e-9, edge + 1e-9, -QUARTER, 0]
    field = cf.CrossField(grid("/###", 0.0), np.zeros(4), beta, [0, 0, 0])
    assert field.degenerate.tolist() == [False, True, True, False]
    assert np.degrees(field.angle_between) == pytest.approx([5, 5, 0, 90], abs=1e-6)


def test_the_shape_of_a_field_is_what_vectors_say():
    rng = np.random.default_rng(1)
    stroke = np.pi * rng.random(18)
    field = random_field(grid(("/#" * 3 + " ") * 6, stroke), 1)
    at, (u, v) = field.instance.stroke_index, (field.u_angle, field.v_angle)

    def apart(one, other):
        return np.degrees(np.arccos(np.clip(np.abs(np.cos(one - other)), 0, 1)))

    off, facts = np.minimum(apart(u[at], stroke), apart(v[at], stroke)), field.facts()
    assert np.degrees(field.stroke_deviation) == pytest.approx(off, abs=1e-6)
    assert facts["stroke_deviation_mean_degrees"] == pytest.approx(off.mean(), abs=1e-6)
    assert np.sum(off <= facts["stroke_deviation_90_percent_degrees"] + 1e-6) >= 0.9 * len(off) - 1
    assert 0 < facts["strokes_beyond_10_degrees"] == np.mean(off > 10) < 1
    assert 0 < facts["lines_under_45_degrees"] == np.mean(apart(u, v) < 45) < 1


@pytest.mark.parametrize("skew", [22.5, -22.5])
def test_45_degrees_are_not_narrow(skew):
    field = cf.CrossField(grid("/#", 0.0), [0.2, 0.2], np.radians([skew, skew]), [0])
    assert field.facts()["lines_under_45_degrees"] == 0


@settings(max_examples=20)
@given(SEEDS, st.sampled_from(["strokes", "box"]))
def test_best_jumps_beat_every_jump_in_the_bounds(seed, gauge):
    instance = random_instance(seed, gauge=gauge)
    field, grid = random_field(instance, seed), instance.grid
    every = np.arange(-8, 9)[:, None]
    a = field.alpha[grid.first] - field.alpha[grid.second] + HALF * every
    b = np.where(every % 2 == 0, 1, -1) * field.beta[grid.first] - field.beta[grid.second]
    cost = np.where((every >= instance.p_min) & (every <= instance.p_max), a * a + b * b, np.inf)
    mine = field.residual_a**2 + field.residual_b**2
    assert mine == pytest.approx(cost.min(axis=0), abs=1e-9)
    # The bounds cut off nothing that would be better.
    assert mine == pytest.approx((a * a + b * b).min(axis=0), abs=1e-9)
    assert field.pixel_energy.sum() == pytest.approx(2 * mine.sum(), abs=1e-9)


@settings(max_examples=20)
@given(SEEDS, st.sampled_from([1, 2]))
def test_energies_do_not_depend_on_the_labels(seed, norm):
    field = random_field(random_instance(seed), seed)
    grid = field.instance.grid
    step = np.random.default_rng(seed).integers(-5, 6, grid.size)
    alpha, beta = field.alpha + HALF * step, np.where(step % 2 == 0, 1, -1) * field.beta
    p = field.p - step[grid.first] + step[grid.second]
    other = cf.CrossField(field.instance, alpha, beta, p)
    assert other.energy(norm).smooth == pytest.approx(field.energy(norm).smooth, abs=1e-9)
    assert other.cross_error(field.u_angle, field.v_angle) == pytest.approx(0, abs=1e-9)
    assert (other.singularities.index == field.singularities.index).all()
    back = field_in_windows(field.instance, alpha, beta, p)
    assert back.energy().total == pytest.approx(field.energy().total, abs=1e-9)
    assert back.alpha == pytest.approx(field.alpha, abs=1e-9)
    assert back.beta == pytest.approx(field.beta, abs=1e-9)
