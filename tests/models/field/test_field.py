"""Cross fields: energies, labels, jumps and singularities against hand calculations and symmetries."""

import numpy as np
import pytest
from crossfield.models.errors import InstanceError
from crossfield.models.field.field import DEGENERATE, CrossField, field_in_windows
from crossfield.models.field.jumps import best_jumps, free_jumps
from crossfield.models.instance.angles import HALF, QUARTER
from crossfield.models.instance.instance import Instance
from crossfield.models.instance.symmetries import mirrored, transposed, turned
from exhaustive import assert_feasible, random_field, random_instance
from hypothesis import given
from hypothesis import strategies as st
from loops import for_each
from moves import lines

pytestmark = pytest.mark.numeric

SEEDS = st.integers(0, 2**32 - 1)
MOVES = {
    turned: (np.rot90, lambda alpha, beta: (alpha + HALF, beta), 1),
    mirrored: (np.fliplr, lambda alpha, beta: (np.pi - alpha, -beta), -1),
    transposed: (np.transpose, lambda alpha, beta: (-HALF - alpha, -beta), -1),
}


def pixels(mask, theta, gauge="strokes", skew_coefficient=1e-6):
    """An instance whose pixels [row, column] in theta (a dict, degrees) are strokes of weight 1."""
    places = sorted(theta)
    angles = np.radians([theta[place] for place in places])
    return Instance.on_pixels(
        "hand",
        np.array(mask, bool),
        places,
        angles,
        np.ones(len(places)),
        gauge=gauge,
        skew_coefficient=skew_coefficient,
    )


def test_the_energy_of_two_pixels_is_that_by_hand():
    instance = pixels([[1, 1]], {(0, 0): 0})
    field = CrossField(instance, [0.1, 0.4], [0.2, -0.1], [0])
    # A = -0.3, B = 0.3, R = 0.1 + 0.2 - 0.
    square, absolute = field.energy(), field.energy(1)
    assert square.smooth == pytest.approx(2 * (0.09 + 0.09))
    assert square.strokes == pytest.approx(0.09)
    assert square.beta == pytest.approx(1e-6 * (0.04 + 0.01))
    assert square.total == pytest.approx(0.36 + 0.09 + 5e-8)
    assert absolute.smooth == pytest.approx(2 * (0.3 + 0.3))
    assert absolute.strokes == pytest.approx(0.3)
    assert absolute.beta == pytest.approx(1e-6 * 0.3)


def test_odd_jump_changes_the_sign_of_the_first_beta():
    field = CrossField(pixels([[1, 1]], {(0, 0): 0}), [0.1, 1.5], [0.2, -0.1], [1])
    assert field.residual_a == pytest.approx([0.1 - 1.5 + HALF])
    assert field.residual_b == pytest.approx([-0.2 + 0.1])


def test_weights_scale_the_stroke_and_the_skew_term():
    instance = Instance.on_pixels(
        "hand", [[True]], [[0, 0]], [1.0], [0.5], stroke_coefficient=3.0, skew_coefficient=2.0
    )
    energy = CrossField(instance, [0.7], [0.1], []).energy()
    assert (energy.smooth, energy.strokes, energy.beta) == pytest.approx((0, 3 * 0.5 * 0.04, 2 * 0.01))


@pytest.mark.parametrize("b", [-0.7, 0.0, 0.3])
def test_two_labels_of_one_cross_differ_by_the_jump_one(b):
    instance = pixels([[1, 1]], {(0, 0): 0}, gauge="box")
    field = CrossField(instance, [0, HALF], [b, -b], [1])
    assert field.energy().smooth == pytest.approx(0, abs=1e-15)
    assert field.cross_error(*(np.full(2, line[0]) for line in lines(field))) == pytest.approx(0, abs=1e-7)
    if b:
        assert field.with_best_jumps().p.tolist() == [1]


def test_skew_turns_both_lines_towards_each_other():
    alpha, beta = np.radians([30, 30, 30]), np.radians([0, 10, -20])
    field = CrossField(pixels([[1, 1, 1]], {(0, 0): 0}), alpha, beta, [0, 0])
    assert np.degrees(np.arctan2(field.u[:, 1], field.u[:, 0])) == pytest.approx([30, 40, 10])
    assert np.degrees(np.arctan2(field.v[:, 1], field.v[:, 0])) == pytest.approx([120, 110, 140])
    assert np.degrees(field.angle_between) == pytest.approx([90, 70, 50])


def test_degenerate_where_lines_are_closer_than_five_degrees():
    edge = QUARTER - DEGENERATE
    beta = [edge - 1e-9, edge + 1e-9, -QUARTER, 0]
    field = CrossField(pixels([[1, 1, 1, 1]], {(0, 0): 0}), np.zeros(4), beta, [0, 0, 0])
    assert field.degenerate.tolist() == [False, True, True, False]
    assert np.degrees(field.angle_between) == pytest.approx([5, 5, 0, 90], abs=1e-6)


def test_cross_error_takes_the_better_assignment():
    field = CrossField(pixels([[1, 1, 1]], {(0, 0): 0}), [0, 0, 0], [0, 0, 0], [0, 0])
    u, v = np.radians([[0, 90, 182], [90, 0, 94]])
    assert np.degrees(field.cross_error(u, v)) == pytest.approx([0, 0, 3], abs=1e-6)
    assert np.degrees(field.cross_error(v, u)) == pytest.approx([0, 0, 3], abs=1e-6)
    # 45 degrees off on both lines is the worst there is for orthogonal crosses.
    assert np.degrees(field.cross_error(np.full(3, QUARTER), np.full(3, 3 * QUARTER))) == pytest.approx(
        [45] * 3
    )


@pytest.mark.parametrize("index", [0.25, -0.25])
def test_four_pixels_may_have_a_quarter_singularity(index):
    # The middle of the quad is the origin; the crosses turn by index * 360 degrees on the way round.
    way_round = np.radians([135, 45, 225, 315])
    alpha = np.mod(index * way_round, HALF)
    instance = pixels([[1, 1], [1, 1]], {(0, 0): np.degrees(alpha[0])}, gauge="box")
    field = CrossField(instance, alpha, np.zeros(4), [0, 0, 0, 0]).with_best_jumps()
    singularities = field.singularities
    assert (singularities.row.tolist(), singularities.column.tolist(), singularities.index.tolist()) == (
        [0],
        [0],
        [index],
    )
    assert np.abs(field.residual_a) == pytest.approx([np.pi / 8] * 4)


def test_singularity_is_found_at_its_quad():
    rows, columns = np.mgrid[0:5, 0:6]
    way_round = np.arctan2(-(rows - 2.5), columns - 1.5).ravel()
    alpha = np.mod(-way_round / 4, HALF)
    instance = pixels(np.ones((5, 6)), {(0, 0): 0}, gauge="box")
    field = CrossField(instance, alpha, np.zeros(30), np.zeros(len(instance.grid.first))).with_best_jumps()
    singularities = field.singularities
    assert (singularities.row.tolist(), singularities.column.tolist(), singularities.index.tolist()) == (
        [2],
        [1],
        [-0.25],
    )


@for_each(
    "alpha,beta,p,message",
    [
        ([0], [0, 0], [0], "alpha has shape (1,), but hand needs (2,)"),
        ([0, 0], [[0, 0]], [0], "beta has shape (1, 2)"),
        ([0, 0], [0, 0], [0, 0], "p has shape (2,), but hand needs (1,)"),
        ([0, np.nan], [0, 0], [0], "alpha holds a value that is not finite"),
        ([0, 0], [np.inf, 0], [0], "beta holds a value that is not finite"),
        ([0, 0], [0, 0], [0.5], "p holds something other than whole numbers"),
        ([0, 0], [0, 0], [2**32], "p holds something other than whole numbers"),
        ([0, 0], [0, 0], [np.nan], "p holds something other than whole numbers"),
    ],
)
def test_wrong_arrays_are_named(alpha, beta, p, message):
    with pytest.raises(InstanceError) as caught:
        CrossField(pixels([[1, 1]], {(0, 0): 0}), alpha, beta, p)
    assert message in str(caught.value)


@given(SEEDS)
def test_pixel_energies_sum_up_to_the_smooth_energy(seed):
    field = random_field(random_instance(seed), seed)
    assert field.pixel_energy.sum() == pytest.approx(field.energy().smooth)


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
    assert free_jumps(instance, field.alpha, field.beta)[1] == pytest.approx(2 * mine, abs=1e-9)


@given(SEEDS, st.sampled_from([1, 2]))
def test_energies_do_not_depend_on_the_labels(seed, norm):
    field = random_field(random_instance(seed), seed)
    grid = field.instance.grid
    step = np.random.default_rng(seed).integers(-5, 6, grid.size)
    alpha, beta = field.alpha + HALF * step, np.where(step % 2 == 0, 1, -1) * field.beta
    p = field.p - step[grid.first] + step[grid.second]
    other = CrossField(field.instance, alpha, beta, p)
    assert other.energy(norm).smooth == pytest.approx(field.energy(norm).smooth, abs=1e-9)
    assert other.cross_error(*lines(field)) == pytest.approx(0, abs=1e-9)
    assert (other.singularities.index == field.singularities.index).all()
    back = field_in_windows(field.instance, alpha, beta, p)
    assert back.energy().total == pytest.approx(field.energy().total, abs=1e-9)
    assert back.alpha == pytest.approx(field.alpha, abs=1e-9)
    assert back.beta == pytest.approx(field.beta, abs=1e-9)


@given(SEEDS)
def test_relabelling_into_the_box_keeps_strokes_that_fit(seed):
    instance = random_instance(seed, gauge="box")
    field, at, grid = random_field(instance, seed), instance.stroke_index, instance.grid
    alpha, beta = field.alpha.copy(), field.beta.copy()
    alpha[at] = np.clip(instance.target, 0, HALF)
    beta[at] = instance.target - alpha[at]
    fits = CrossField(instance, alpha, beta, best_jumps(instance, alpha, beta))
    assert fits.energy().strokes == pytest.approx(0, abs=1e-12)
    step = np.random.default_rng(seed).integers(-5, 6, grid.size)
    back = field_in_windows(
        instance,
        alpha + HALF * step,
        np.where(step % 2 == 0, 1, -1) * beta,
        fits.p - step[grid.first] + step[grid.second],
    )
    assert back.energy().total == pytest.approx(fits.energy().total, abs=1e-9)


@given(SEEDS, st.sampled_from(["strokes", "box"]))
def test_relabelled_is_inside_every_bound(seed, gauge):
    instance = random_instance(seed, gauge=gauge)
    rng = np.random.default_rng(seed)
    size, pairs = instance.grid.size, len(instance.grid.first)
    field = field_in_windows(
        instance, rng.uniform(-9, 9, size), rng.uniform(-2, 2, size), rng.integers(-9, 9, pairs)
    )
    assert_feasible(field)


@pytest.mark.parametrize("moved_instance", MOVES)
@given(seed=SEEDS)
def test_energies_are_those_of_the_moved_field(moved_instance, seed):
    field = random_field(random_instance(seed), seed)
    moved = moved_field(field, moved_instance)
    for norm in (1, 2):
        assert moved.energy(norm).smooth == pytest.approx(field.energy(norm).smooth, abs=1e-9)
        assert moved.energy(norm).beta == pytest.approx(field.energy(norm).beta, abs=1e-9)
        assert moved.energy(norm).strokes == pytest.approx(field.energy(norm).strokes, abs=1e-9)
    # A mirror turns both the walk and the crosses the other way.
    assert sorted(moved.singularities.index) == sorted(field.singularities.index)


def moved_field(field, moved_instance):
    """The field on the moved instance, pixel by pixel and pair by pair."""
    move, angles, sign = MOVES[moved_instance]
    instance = moved_instance(field.instance)
    old = move(field.instance.grid.number)[instance.mask]
    jump = {}
    for i, j, p in zip(field.instance.grid.first, field.instance.grid.second, field.p, strict=True):
        jump[int(i), int(j)], jump[int(j), int(i)] = sign * p, -sign * p
    alpha, beta = (values[old] for values in angles(field.alpha, field.beta))
    grid = instance.grid
    p = np.array(
        [jump[int(old[i]), int(old[j])] for i, j in zip(grid.first, grid.second, strict=True)], dtype=int
    )
    # Lines have no sign: whole half turns bring u of a stroke pixel next to the moved theta.
    half = np.zeros(len(alpha))
    at = instance.stroke_index
    half[at] = 2 * np.round((instance.target - alpha[at]) / np.pi)
    p = p - (half[grid.first] - half[grid.second])
    return CrossField(instance, alpha + HALF * half, beta, p)
