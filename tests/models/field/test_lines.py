"""Fields from two lines per pixel: the same crosses for all turns and orders, in every gauge."""

import crossfield as cf
import numpy as np
import pytest
from angles import HALF, line_difference
from exhaustive import assert_feasible, random_instance
from hypothesis import given, settings
from hypothesis import strategies as st


@given(seed=st.integers(0, 2**32 - 1), gauge=st.sampled_from(["strokes", "box"]))
@settings(max_examples=20)
def test_turns_and_the_order_of_the_lines_do_not_matter(seed, gauge):
    rng = np.random.default_rng(seed)
    instance = random_instance(seed, gauge=gauge)
    u, v = rng.uniform(-4, 4, (2, instance.grid.size))
    field = cf.CrossField.from_lines(instance, u, v)
    assert_feasible(field)
    assert (field.p == field.with_best_jumps().p).all()
    assert field.cross_error(u, v) == pytest.approx(np.zeros(len(u)), abs=1e-9)
    swap = rng.random(len(u)) < 0.5
    turns = np.pi * rng.integers(-9, 10, (2, len(u)))
    other = cf.CrossField.from_lines(
        instance, np.where(swap, v, u) + turns[0], np.where(swap, u, v) + turns[1]
    )
    assert other.cross_error(field.u_angle, field.v_angle) == pytest.approx(np.zeros(len(u)), abs=1e-9)
    assert other.energy().total == pytest.approx(field.energy().total, abs=1e-9)
    if gauge == "strokes":  # u is the line nearer to the stroke
        at = instance.stroke_index
        off = [line_difference(line[at], instance.theta) for line in (field.u_angle, field.v_angle)]
        assert (off[0] <= off[1] + 1e-9).all()
        assert np.abs(field.residual_r) == pytest.approx(off[0], abs=1e-9)


def test_a_label_on_the_edge_of_the_box_carries_the_stroke():
    for theta in (0.0, HALF):
        instance = cf.Instance.on_pixels("edge", [[True, True]], [[0, 1]], [theta], [1.0], gauge="box")
        field = cf.CrossField.from_lines(instance, [0.0, 0.0], [HALF, HALF])
        assert field.energy().total == pytest.approx(0)


def test_lines_that_are_one_make_a_cross_of_one_line():
    instance = cf.Instance.on_pixels("one", [[True, True]], [[0, 0]], [0.3], [1.0])
    field = cf.CrossField.from_lines(instance, [0.3, 1.0], [0.3 + np.pi, 1.0])
    assert field.degenerate.all()
    assert field.angle_between == pytest.approx([0, 0], abs=1e-9)
    assert np.abs(field.residual_r) == pytest.approx([0], abs=1e-9)
