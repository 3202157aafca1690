"""The greedy baseline and the power field: exact cases, symmetries, bounds,
and brute force over the jumps.
"""

from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from angles import QUARTER
from crossfield.models.search.box_qp import fit_in_box
from crossfield.models.search.nearest_stroke import nearest_strokes
from crossfield.models.search.starts import first_field
from exhaustive import exact, sketch
from loops import for_each


def bent_field(instance):
    return cf.bend_field(cf.polyvector_field(instance))


SOLVERS = pytest.mark.parametrize(
    "solve", [cf.greedy_field, first_field, cf.power_field, cf.polyvector_field, bent_field]
)


@SOLVERS
@for_each("degrees", [0, 20, 45, 120, 179])
def test_parallel_strokes_give_a_constant_field(solve, degrees):
    theta = np.full((6, 7), np.nan)
    theta[[1, 4], 1:5] = np.radians(degrees)
    field = solve(sketch(np.ones((6, 7), bool), theta))
    for norm in (1, 2):
        assert field.energy(norm).total < 1e-5
    assert np.abs(field.beta).max() < 1e-3


@for_each("skew_coefficient", [0, 1e-6])
@for_each("first", [0, 77])
@for_each("between", [15, 44, 50, 90, 155])
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
@pytest.mark.parametrize("solve", [cf.greedy_field, first_field, cf.power_field])
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
    field = cf.greedy_field(sketch(np.ones(theta.shape, bool), theta))
    assert field.energy().total < 91 * 92 * 1e-6 * QUARTER**2
    assert np.degrees(field.angle_between) == pytest.approx(50, abs=0.1)
    around = np.arctan2(-(rows - 45.5), columns - 45.5) / 4
    around[12:-12, 12:-12] = np.nan
    field = cf.greedy_field(sketch(np.ones(theta.shape, bool), around))
    assert field.singularities.index.tolist() == [0.25]


@pytest.mark.parametrize("gauge", ["strokes", "box"])
def test_answer_is_the_optimum_for_its_jumps(gauge):
    field = cf.greedy_field(cf.sample("mouse", 14, gauge=gauge))
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
        ratio.append(cf.greedy_field(instance).energy().total / exact(instance))
    ratio = np.array(ratio)
    assert (ratio > 1 - 1e-6).all()
    assert (ratio < 1 + 1e-3).sum() >= 10, ratio


def test_cells_go_round_holes_and_do_not_leap_over_corners():
    mask = np.array([[pixel == "#" for pixel in row] for row in ("#.##.", "#.##.", "####.", "....#")])
    theta = np.full(mask.shape, np.nan)
    theta[0, 0], theta[2, 3] = 0.1, 0.2
    cells = np.full(mask.shape, -1)
    cells[mask] = nearest_strokes(sketch(mask, theta))
    assert cells[:3, 2:4].tolist() == [[1, 1]] * 3
    assert cells[:2, 0].tolist() == [0, 0]
    assert cells[3, 4] == -1


@pytest.mark.parametrize("skew_coefficient", [0.0, 1e6])
def test_the_greatest_weights_are_solved(skew_coefficient):
    for instance in (cf.sample("mouse", 8), cf.Instance.on_pixels("one", [[True]], [[0, 0]], [2.0], [1.0])):
        heavy = replace(instance, stroke_coefficient=1e6, skew_coefficient=skew_coefficient)
        for field in (cf.greedy_field(heavy), cf.power_field(heavy), cf.search(heavy, rounds=0).field):
            assert np.isfinite(field.energy().total)
        assert np.abs(cf.greedy_field(heavy).residual_r).max() < 1e-3
