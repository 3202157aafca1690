"""The greedy baseline and the power field: exact cases, symmetries, bounds,
and brute force over the jumps.
"""

from dataclasses import replace

import numpy as np
import pytest
from crossfield.models.instance.angles import HALF, QUARTER
from crossfield.models.instance.instance import Instance
from crossfield.models.instance.symmetries import mirrored, transposed, turned
from crossfield.models.samples.samples import sample
from crossfield.models.search.box_qp import fit_in_box
from crossfield.models.search.greedy import greedy_field
from crossfield.models.search.nearest_stroke import nearest_strokes
from crossfield.models.search.search import search
from crossfield.models.search.starts import first_field
from crossfield.models.smooth.bend import bend_field
from crossfield.models.smooth.polyvector import polyvector_field, power_field
from exhaustive import assert_feasible, exact, random_instance, sketch
from hypothesis import given, settings
from hypothesis import strategies as st
from loops import for_each

pytestmark = pytest.mark.numeric

SEEDS = st.integers(0, 2**32 - 1)


def bent_field(instance):
    return bend_field(polyvector_field(instance))


SOLVERS = pytest.mark.parametrize(
    "solve", [greedy_field, first_field, power_field, polyvector_field, bent_field]
)


def some_curves(size=16, seed=3):
    """Arcs of random circles: a sketch without ties."""
    rng = np.random.default_rng(seed)
    theta = np.full((size, size), np.nan)
    for _ in range(5):
        centre, radius, start = rng.uniform(0, size, 2), size * rng.uniform(0.2, 0.8), rng.uniform(0, 6)
        way = np.linspace(start, start + 2, 6 * size)
        row = np.floor(centre[0] - radius * np.sin(way)).astype(int)
        column = np.floor(centre[1] + radius * np.cos(way)).astype(int)
        on = (row >= 0) & (column >= 0) & (row < size) & (column < size)
        theta[row[on], column[on]] = way[on] + HALF
    return sketch(np.ones((size, size), bool), theta)


@SOLVERS
@for_each("degrees", [0, 20, 45, 90, 120, 135, 179])
def test_parallel_strokes_give_a_constant_field(solve, degrees):
    theta = np.full((6, 7), np.nan)
    theta[[1, 4], 1:5] = np.radians(degrees)
    field = solve(sketch(np.ones((6, 7), bool), theta))
    for norm in (1, 2):
        assert field.energy(norm).total < 1e-5
    assert np.abs(field.beta).max() < 1e-3


@for_each("skew_coefficient", [0, 1e-9, 1e-6])
@for_each("first", [0, 77, 130])
@for_each("between", [15, 30, 44, 50, 60, 90, 100, 130, 155])
def test_two_families_give_a_constant_skewed_field(first, between, skew_coefficient):
    theta = np.full((7, 7), np.nan)
    theta[2, :] = np.radians(first)
    theta[3:, 4] = np.radians(first + between)
    field = first_field(sketch(np.ones((7, 7), bool), theta, skew_coefficient))
    # Both norms vanish with skew_coefficient; the constant field of these lines is the bound for the 2-norm.
    assert field.energy(2).total < 1e-12 + 49 * skew_coefficient * QUARTER**2
    assert field.energy(1).total < 1e-6 + 200 * skew_coefficient
    assert np.degrees(field.angle_between) == pytest.approx(min(between, 180 - between), abs=0.01)


@pytest.mark.parametrize("index", [0.25, -0.25])
@pytest.mark.parametrize("solve", [greedy_field, first_field, power_field])
def test_a_frame_of_strokes_has_one_singularity(solve, index):
    rows, columns = np.mgrid[0:10, 0:12]
    theta = index * np.arctan2(-(rows - 4.5), columns - 5.5)
    theta[2:-2, 2:-2] = np.nan
    field = solve(sketch(np.ones((10, 12), bool), theta))
    assert field.singularities.index.tolist() == [index]
    assert field.singularities.row[0] == pytest.approx(4, abs=1)
    assert field.singularities.column[0] == pytest.approx(5, abs=1)


def test_large_grids_are_grown_by_local_updates():
    # More than 8192 pixels. Two families are constant; a frame of strokes turns round one singularity.
    rows, columns = np.mgrid[0:91, 0:92]
    theta = np.where((rows == 20) | (rows == 60), np.radians(77), np.nan)
    theta[(columns == 30) & (rows > 60)] = np.radians(127)
    field = greedy_field(sketch(np.ones(theta.shape, bool), theta))
    assert field.energy().total < 91 * 92 * 1e-6 * QUARTER**2
    assert np.degrees(field.angle_between) == pytest.approx(50, abs=0.1)
    around = np.arctan2(-(rows - 45.5), columns - 45.5) / 4
    around[12:-12, 12:-12] = np.nan
    field = greedy_field(sketch(np.ones(theta.shape, bool), around))
    assert field.singularities.index.tolist() == [0.25]


MOVES = {turned: np.rot90, mirrored: np.fliplr, transposed: np.transpose}


def same_cells(instance, moved, move):
    """Whether pixels as near to two strokes, if any, went to the same stroke before and after the move."""
    cells = np.full(instance.mask.shape, -1)
    cells[instance.mask] = nearest_strokes(instance)
    names = np.full(instance.mask.shape, -1)
    names[tuple(instance.stroke_pixels.T)] = np.arange(len(instance.theta))
    order = move(names)[tuple(moved.stroke_pixels.T)]
    return (np.append(order, -1)[nearest_strokes(moved)] == move(cells)[moved.mask]).all()


@pytest.mark.parametrize("move", MOVES)
def test_greedy_energy_is_that_of_the_moved_sketch(move):
    compared = 0
    for seed in range(60):
        instance = random_instance(seed, strokes=4)
        moved = move(instance)
        if same_cells(instance, moved, MOVES[move]):
            compared += instance.grid.size > 9
            assert greedy_field(moved).energy().total == pytest.approx(
                greedy_field(instance).energy().total, rel=1e-6, abs=1e-9
            )
    assert compared > 5


@pytest.mark.parametrize("move", MOVES)
def test_power_energy_is_that_of_the_moved_sketch(move):
    for seed in range(4):
        instance = some_curves(12, seed)
        moved = move(instance)
        assert power_field(moved).energy().total == pytest.approx(
            power_field(instance).energy().total, rel=1e-6
        )


def test_turns_of_a_sketch_with_ties_have_close_energies():
    instance = some_curves()
    energies = [
        greedy_field(moved).energy().total for moved in (instance, turned(instance), mirrored(instance))
    ]
    assert max(energies) < 1.2 * min(energies)


@SOLVERS
@given(
    seed=SEEDS,
    gauge=st.sampled_from(["strokes", "box"]),
    skew_coefficient=st.sampled_from([0, 1e-6, 1e-3, 1]),
    stroke_coefficient=st.sampled_from([0, 1e-6, 1, 100, 1e6]),
)
@settings(deadline=None, max_examples=50)
def test_fields_are_inside_all_bounds(solve, seed, gauge, skew_coefficient, stroke_coefficient):
    instance = random_instance(seed, gauge=gauge)
    field = solve(replace(instance, skew_coefficient=skew_coefficient, stroke_coefficient=stroke_coefficient))
    assert_feasible(field)
    assert 0 <= field.energy().total < np.inf


@SOLVERS
def test_parts_without_strokes_are_constant_and_cost_nothing(solve):
    mask = np.ones((5, 9), bool)
    mask[:, 4] = False
    theta = np.full(mask.shape, np.nan)
    theta[:, 1] = 0.3
    theta[2, :2] = 1.2
    field = solve(sketch(mask, theta))
    apart = field.image(field.alpha)[:, 5:]
    assert np.ptp(apart) == pytest.approx(0, abs=1e-9)
    assert field.image(field.pixel_energy)[:, 5:] == pytest.approx(np.zeros((5, 4)), abs=1e-15)


def test_parts_do_not_know_of_each_other():
    mask = np.ones((4, 9), bool)
    mask[:, 4] = False
    left, right = np.full(mask.shape, np.nan), np.full(mask.shape, np.nan)
    left[0], left[:, 0] = 0.3, 1.1
    right[1], right[:, 6] = 2.3, 0.2
    left[:, 4:], right[:, :4] = np.nan, np.nan
    both = greedy_field(sketch(mask, np.where(np.isfinite(left), left, right))).energy().total
    apart = [greedy_field(sketch(mask, theta)).energy().total for theta in (left, right)]
    assert both == pytest.approx(sum(apart), rel=1e-3)


@pytest.mark.parametrize("gauge", ["strokes", "box"])
def test_answer_is_the_optimum_for_its_jumps(gauge):
    field = greedy_field(some_curves().with_gauge(gauge))
    assert fit_in_box(field).energy().total == pytest.approx(field.energy().total, rel=1e-12)


def test_mostly_equal_to_the_optimum_over_all_jumps():
    # A ring of eight pixels, with as many pairs.
    ring = np.ones((3, 3), bool)
    ring[1, 1] = False
    ratio = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        theta = np.full((3, 3), np.nan)
        theta.flat[rng.permutation([0, 1, 2, 3, 5, 6, 7, 8])[:3]] = rng.uniform(0, np.pi, 3)
        instance = sketch(ring, theta, skew_coefficient=1e-3)
        ratio.append(greedy_field(instance).energy().total / exact(instance))
    ratio = np.array(ratio)
    assert (ratio > 1 - 1e-6).all()
    assert (ratio < 1 + 1e-3).sum() >= 10, ratio


def test_cells_go_round_the_hole_of_a_mask():
    # The wall of '.' separates the right column from the nearer stroke on the left.
    picture = ["#.#", "#.#", "###"]
    mask = np.array([[pixel == "#" for pixel in row] for row in picture])
    theta = np.full(mask.shape, np.nan)
    theta[0, 0], theta[2, 2] = 0.1, 0.2
    instance = sketch(mask, theta)
    cells = np.full(mask.shape, -1)
    cells[mask] = nearest_strokes(instance)
    assert cells[:, 2].tolist() == [1, 1, 1]
    assert cells[:2, 0].tolist() == [0, 0]


def test_cells_do_not_leap_over_a_corner():
    mask = np.eye(2, dtype=bool)
    instance = sketch(mask, np.array([[0.3, np.nan], [np.nan, np.nan]]))
    assert nearest_strokes(instance).tolist() == [0, -1]


@pytest.mark.parametrize("skew_coefficient", [0.0, 1e-6, 1e6])
def test_the_greatest_weights_are_solved(skew_coefficient):
    for instance in (sample("mouse", 8), Instance.on_pixels("one", [[True]], [[0, 0]], [2.0], [1.0])):
        heavy = replace(instance, stroke_coefficient=1e6, skew_coefficient=skew_coefficient)
        for field in (greedy_field(heavy), power_field(heavy), search(heavy, rounds=1).field):
            assert np.isfinite(field.energy().total)
        assert np.abs(greedy_field(heavy).residual_r).max() < 1e-3
