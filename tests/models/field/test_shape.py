"""How far the lines are from the strokes, and how many crosses are narrow, by another way."""

import crossfield as cf
import numpy as np
import pytest
from exhaustive import random_field
from moves import lines


def apart(first, second):
    """The angle between lines in degrees, from unit vectors."""
    return np.degrees(np.arccos(np.clip(np.abs(np.cos(first - second)), 0, 1)))


@pytest.mark.parametrize("seed", range(3))
def test_the_shape_is_what_vectors_say(seed):
    field = random_field(cf.sample("mouse", 12), seed)
    at, theta = field.instance.stroke_index, field.instance.theta
    off = np.minimum(*(apart(line[at], theta) for line in lines(field)))
    assert np.degrees(field.stroke_deviation) == pytest.approx(off, abs=1e-6)
    shape = field.shape
    assert np.degrees(shape.mean_deviation) == pytest.approx(off.mean(), abs=1e-6)
    assert np.sum(off <= np.degrees(shape.most_deviation) + 1e-6) >= 0.9 * len(off) - 1
    assert shape.far_strokes == np.mean(off > 10)
    assert 0 < shape.narrow_pixels == np.mean(apart(*lines(field)) < 45) < 1


def test_a_stroke_may_be_followed_by_either_line_and_45_degrees_are_not_narrow():
    instance = cf.sample("mouse", 12)
    alpha, jumps = instance.alpha_lower + np.pi / 4, np.zeros(len(instance.grid.first))
    for skew, turned in ((0.0, 0.0), (np.pi / 8, 0.0), (-np.pi / 8, np.pi / 2)):
        field = cf.CrossField(instance, alpha + turned - skew, np.full(instance.grid.size, skew), jumps)
        other = cf.CrossField(instance, alpha + turned + skew, np.full(instance.grid.size, skew), jumps)
        assert min(field.shape.mean_deviation, other.shape.mean_deviation) == pytest.approx(0, abs=1e-12)
        assert field.shape.narrow_pixels == 0
