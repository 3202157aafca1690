"""Jumps between neighbours: the best ones, and steps of the label, which change no cross."""

import numpy as np
import pytest
from crossfield.models.field.field import CrossField
from crossfield.models.field.jumps import best_jumps, free_jumps, step_labels
from crossfield.models.instance.instance import Instance

pytestmark = pytest.mark.numeric


def some_field(seed):
    rng = np.random.default_rng(seed)
    mask, at = np.ones((4, 5), dtype=bool), np.array([[1, 1], [3, 2]])
    instance = Instance(name="some", mask=mask, stroke_pixels=at, theta=[0.3, -1.0], w=[1.0, 0.5])
    n, m = instance.grid.size, len(instance.grid.first)
    return CrossField(instance, rng.uniform(-4, 4, n), rng.uniform(-0.7, 0.7, n), rng.integers(-3, 4, m)), rng


def test_steps_of_the_label_leave_crosses_and_the_sizes_of_all_residuals():
    for seed in range(20):
        field, rng = some_field(seed)
        steps = rng.integers(-3, 4, field.instance.grid.size).astype(np.int32)
        moved = CrossField(
            field.instance, *step_labels(field.instance.grid, field.alpha, field.beta, field.p, steps)
        )
        assert np.allclose(
            moved.cross_error(field.alpha + field.beta, field.alpha + np.pi / 2 - field.beta), 0
        )
        assert np.allclose(moved.residual_a, field.residual_a)
        assert np.allclose(np.abs(moved.residual_b), np.abs(field.residual_b))


def test_best_jumps_are_the_free_ones_where_those_are_in_range():
    for seed in range(20):
        field, _ = some_field(seed)
        free, cost = free_jumps(field.instance, field.alpha, field.beta)
        bound = best_jumps(field.instance, field.alpha, field.beta)
        inside = (free >= field.instance.p_min) & (free <= field.instance.p_max)
        assert inside.any()
        assert bound[inside].tolist() == free[inside].tolist()
        best = CrossField(field.instance, field.alpha, field.beta, free)
        assert np.allclose(2 * (best.residual_a**2 + best.residual_b**2), cost)
