"""How far the lines are from the strokes, and how many crosses are narrow, by another way."""

import crossfield as cf
import numpy as np
import pytest


def line_angles(field):
    return field.alpha + field.beta, field.alpha + np.pi / 2 - field.beta


def apart(first, second):
    """The angle between lines in degrees, from unit vectors."""
    return np.degrees(np.arccos(np.clip(np.abs(np.cos(first - second)), 0, 1)))


def any_field(seed):
    instance, random = cf.sample("mouse", 12), np.random.default_rng(seed)
    alpha = random.uniform(instance.alpha_lower, instance.alpha_upper)
    beta = random.uniform(-np.pi / 4, np.pi / 4, instance.grid.size)
    return cf.CrossField(instance, alpha, beta, np.zeros(len(instance.grid.first)))


@pytest.mark.parametrize("seed", range(3))
def test_the_shape_is_what_vectors_say(seed):
    field = any_field(seed)
    at, theta = field.instance.stroke_index, field.instance.theta
    off = np.minimum(*(apart(line[at], theta) for line in line_angles(field)))
    assert np.degrees(field.stroke_deviation) == pytest.approx(off, abs=1e-6)
    shape = field.shape
    assert np.degrees(shape.mean_deviation) == pytest.approx(off.mean(), abs=1e-6)
    assert np.sum(off <= np.degrees(shape.most_deviation) + 1e-6) >= 0.9 * len(off) - 1
    assert shape.far_strokes == np.mean(off > 10)
    assert 0 < shape.narrow_pixels == np.mean(apart(*line_angles(field)) < 45) < 1


def test_lines_are_a_right_angle_less_twice_the_skew_apart():
    field = any_field(0)
    assert field.angle_between == pytest.approx(np.pi / 2 - 2 * np.abs(field.beta), abs=1e-12)
    assert field.shape.narrow_pixels == np.mean(np.abs(field.beta) > np.pi / 8)


def test_a_stroke_may_be_followed_by_either_line_and_45_degrees_are_not_narrow():
    instance = cf.sample("mouse", 12)
    alpha, jumps = instance.alpha_lower + np.pi / 4, np.zeros(len(instance.grid.first))
    for skew, turned in ((0.0, 0.0), (np.pi / 8, 0.0), (-np.pi / 8, np.pi / 2)):
        field = cf.CrossField(instance, alpha + turned - skew, np.full(instance.grid.size, skew), jumps)
        other = cf.CrossField(instance, alpha + turned + skew, np.full(instance.grid.size, skew), jumps)
        assert min(field.shape.mean_deviation, other.shape.mean_deviation) == pytest.approx(0, abs=1e-12)
        assert field.shape.narrow_pixels == 0
