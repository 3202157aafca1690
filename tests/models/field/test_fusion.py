"""Fusion of two fields: never above the first, the better half of each, the best of all choices."""

from dataclasses import replace
from itertools import product

import crossfield as cf
import numpy as np
import pytest
from angles import HALF
from crossfield.models.field.fusion import fuse_fields
from crossfield.models.field.jumps import free_jumps
from crossfield.models.instance.instance import MOST_WEIGHT
from exhaustive import random_instance, sketch


def mixed(one, other, taken):
    alpha, beta = np.where(taken, other.alpha, one.alpha), np.where(taken, other.beta, one.beta)
    return cf.CrossField(one.instance, alpha, beta, free_jumps(one.instance, alpha, beta)[0])


def test_it_takes_the_better_half_of_each():
    theta = np.full((8, 14), np.nan)
    theta[2:6, [1, 12]] = 0.3
    good = cf.greedy_field(sketch(np.ones(theta.shape, bool), theta))
    bumps = [np.hypot(good.instance.grid.rows - 4, good.instance.grid.columns - at) < 3 for at in (2, 11)]
    left, right = (cf.CrossField(good.instance, good.alpha + 0.5 * bump, good.beta, good.p) for bump in bumps)
    for one, other in ((left, right), (right, left)):
        assert one.energy().total > 1
        assert fuse_fields(one, other).energy().total == pytest.approx(good.energy().total, abs=1e-9)


@pytest.mark.filterwarnings("error")
def test_prices_beyond_32_bits_are_as_good_as_infinite():
    """Strokes of the greatest weight, half a radian off, compared with an energy of 7."""
    theta = np.full((8, 14), np.nan)
    theta[2:6, [1, 12]] = 0.3
    good = cf.greedy_field(replace(sketch(np.ones(theta.shape, bool), theta), stroke_coefficient=MOST_WEIGHT))
    bump = np.hypot(good.instance.grid.rows - 4, good.instance.grid.columns - 6.5) < 2
    off = np.zeros(len(bump))
    off[good.instance.stroke_index[-2:]] = 0.5
    one, other = (
        cf.CrossField(good.instance, good.alpha + more, good.beta, good.p) for more in (bump / 2, off)
    )
    assert fuse_fields(one, other).energy().total == pytest.approx(0, abs=1e-9)


def test_it_is_the_best_choice_of_all_where_a_cut_can_say_it():
    rng = np.random.default_rng(3)
    for seed in range(5):
        one = cf.greedy_field(random_instance(seed, (3, 3), strokes=5))
        pixels = one.instance.grid.size
        alpha = one.alpha + np.where(rng.random(pixels) < 0.6, rng.normal(0, 0.3, pixels), 0)
        other = cf.CrossField(one.instance, alpha, one.beta, one.p)
        least = min(
            mixed(one, other, choice).energy().total for choice in product([False, True], repeat=pixels)
        )
        energy = fuse_fields(one, other).energy().total
        assert energy <= one.energy().total
        assert energy == pytest.approx(least, rel=1e-5)


def test_fields_that_are_one_stay_as_they_are():
    field = cf.greedy_field(random_instance(1))
    turned = cf.CrossField(field.instance, field.alpha + HALF, -field.beta, field.p)
    assert fuse_fields(field, field) is field
    assert fuse_fields(field, turned) is field
