"""The PolyVector field: exact on constant directions, at any angle."""

import crossfield as cf
import numpy as np
import pytest
from angles import line_difference
from exhaustive import sketch
from instance_kinds import grid
from loops import for_each
from moves import lines

HOLDS = (0.1, 1.0, 100.0)


@for_each("degrees", [10, 35, 60, 90])
def test_two_families_at_any_angle_are_exact(degrees):
    theta = np.full((8, 8), np.nan)
    theta[:, 1], theta[:, 5] = np.radians(100), np.radians(100 - degrees)
    field = cf.polyvector_field(sketch(np.ones((8, 8), bool), theta, skew_coefficient=0))
    assert field.energy().total < 1e-9
    assert field.cross_error(
        np.full(64, np.radians(100)), np.full(64, np.radians(100 - degrees))
    ) == pytest.approx(np.zeros(64), abs=1e-4)


def test_a_hard_hold_keeps_the_strokes():
    instance = cf.sample("mouse", 24)
    off = []
    for hold in HOLDS:
        u, v = lines(cf.polyvector_field(instance, hold=hold))
        at = instance.stroke_index
        off.append(
            np.minimum(line_difference(u[at], instance.theta), line_difference(v[at], instance.theta)).mean()
        )
    assert off[0] > off[1] > off[2]
    assert off[2] < np.radians(0.5)


def test_one_pixel_under_the_heaviest_strokes_is_solved():
    """Its system has one equation for two unknowns, which a heavy weight must not drown the pull of."""
    for theta in np.linspace(0, 3.1, 40):
        one = grid("/", theta, stroke_coefficient=1e6, skew_coefficient=0.0)
        for hold in HOLDS:
            field = cf.polyvector_field(one, hold=hold)
            assert field.stroke_deviation.max() < 1e-6
