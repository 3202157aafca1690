"""Cross fields: degenerate and narrow crosses, refusals, labels and jumps, against vectors and symmetries."""

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.field.field import field_in_windows
from crossfield.models.instance.angles import HALF, QUARTER
from exhaustive import assert_feasible, random_field, random_instance
from hypothesis import given, settings
from hypothesis import strategies as st
from loops import for_each

SEEDS = st.integers(0, 2**32 - 1)


def pixels(mask, theta, gauge="strokes", skew_coefficient=1e-6):
    """An instance whose pixels [row, column] in theta (a dict, degrees) are strokes of weight 1."""
    places = sorted(theta)
    angles = np.radians([theta[place] for place in places])
    return cf.Instance.on_pixels(
        "hand",
        np.array(mask, bool),
        places,
        angles,
        np.ones(len(places)),
        gauge=gauge,
        skew_coefficient=skew_coefficient,
    )


def test_degenerate_where_lines_are_closer_than_five_degrees():
    edge = np.radians(42.5)
    beta = [edge - 1e-9, edge + 1e-9, -QUARTER, 0]
    field = cf.CrossField(pixels([[1, 1, 1, 1]], {(0, 0): 0}), np.zeros(4), beta, [0, 0, 0])
    assert field.degenerate.tolist() == [False, True, True, False]
    assert np.degrees(field.angle_between) == pytest.approx([5, 5, 0, 90], abs=1e-6)


def test_the_shape_of_a_field_is_what_vectors_say():
    rng = np.random.default_rng(1)
    theta = {(row, column): 180 * rng.random() for row in range(6) for column in range(0, 6, 2)}
    field = random_field(pixels(np.ones((6, 6)), theta), 1)
    stroke = np.radians([theta[place] for place in sorted(theta)])
    at, (u, v) = field.instance.stroke_index, (field.u_angle, field.v_angle)

    def apart(one, other):
        return np.degrees(np.arccos(np.clip(np.abs(np.cos(one - other)), 0, 1)))

    off, shape = np.minimum(apart(u[at], stroke), apart(v[at], stroke)), field.shape
    assert np.degrees(field.stroke_deviation) == pytest.approx(off, abs=1e-6)
    assert np.degrees(shape.mean_deviation) == pytest.approx(off.mean(), abs=1e-6)
    assert np.sum(off <= np.degrees(shape.most_deviation) + 1e-6) >= 0.9 * len(off) - 1
    assert 0 < shape.far_strokes == np.mean(off > 10) < 1
    assert 0 < shape.narrow_pixels == np.mean(apart(u, v) < 45) < 1


@pytest.mark.parametrize("skew", [22.5, -22.5])
def test_45_degrees_are_not_narrow(skew):
    field = cf.CrossField(pixels([[1, 1]], {(0, 0): 0}), [0.2, 0.2], np.radians([skew, skew]), [0])
    assert field.shape.narrow_pixels == 0


@for_each(
    "alpha,beta,p,message",
    [
        ([0], [0, 0], [0], "alpha has shape (1,), but hand needs (2,)"),
        ([0, 0], [[0, 0]], [0], "beta has shape (1, 2)"),
        ([0, 0], [0, 0], [0, 0], "p has shape (2,), but hand needs (1,)"),
        ([0, 0], [np.inf, 0], [0], "beta holds something other than angles"),
        ([0, 0], [0, 0], [0.5], "p holds something other than whole numbers"),
        ([0, 0], [0, 0], [2**32], "p holds something other than whole numbers"),
    ],
)
def test_wrong_arrays_are_named(alpha, beta, p, message):
    with pytest.raises(cf.InstanceError) as caught:
        cf.CrossField(pixels([[1, 1]], {(0, 0): 0}), alpha, beta, p)
    assert message in str(caught.value)


@settings(max_examples=40)
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


@settings(max_examples=40)
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


@settings(max_examples=40)
@given(SEEDS, st.sampled_from(["strokes", "box"]))
def test_relabelled_is_inside_every_bound(seed, gauge):
    instance = random_instance(seed, gauge=gauge)
    rng = np.random.default_rng(seed)
    size, pairs = instance.grid.size, len(instance.grid.first)
    field = field_in_windows(
        instance, rng.uniform(-9, 9, size), rng.uniform(-2, 2, size), rng.integers(-9, 9, pairs)
    )
    assert_feasible(field)
