"""The lemmas of the bound in exact rational numbers, and for the costs as they are computed."""

import random
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from crossfield.models.field.field import CrossField
from crossfield.models.instance.angles import HALF, QUARTER
from crossfield.models.proof.bound.lattice import Lattice
from exhaustive import random_instance

pytestmark = pytest.mark.numeric


def fraction(rng, lower, upper, parts=9973):
    return lower + (upper - lower) * Fraction(rng.randrange(parts + 1), parts)


def up(x, threshold):
    """The neighbour of x among the whole numbers: above if its fraction is more than the threshold."""
    return x // 1 + (x % 1 > threshold)


def mean(values, ends):
    """The mean over thresholds in [0, 1] of a function that is constant between those ends."""
    ends = sorted({Fraction(0), Fraction(1), *ends})
    return sum((b - a) * values((a + b) / 2) for a, b in pairwise(ends))


def test_a_pair_rounded_by_common_thresholds_costs_at_most_h_squared_more():
    rng = random.Random(1)
    for _ in range(400):
        h, turn = fraction(rng, Fraction(1, 100), 1), fraction(rng, -3, 3)
        x, y, shift, other = (fraction(rng, -4, 4) for _ in range(4))  # in steps; centres shifted at will

        def rounded(sign, x=x, y=y, shift=shift, h=h, turn=turn):
            def squared(t, x=x, y=y):
                mine = up(x, t) if sign > 0 else up(x, 1 - t)
                return (h * (sign * mine - up(y, t) + shift) + turn) ** 2

            ends = [x % 1, 1 - x % 1, y % 1]
            return mean(squared, ends), (h * (sign * x - y + shift) + turn) ** 2

        for parity in (1, -1):
            above_a, exact_a = rounded(1)
            above_b, exact_b = rounded(parity, shift=other, turn=Fraction(0))
            assert 2 * (above_a + above_b) - h * h <= 2 * (exact_a + exact_b)


def test_a_stroke_rounded_in_both_angles_loses_no_more_than_is_taken_off():
    rng = random.Random(2)
    for _ in range(2000):
        k, m, r = rng.randrange(-4, 4), rng.randrange(-4, 4), fraction(rng, -2, 2)
        f, g = fraction(rng, 0, 1), fraction(rng, 0, 1)
        corners = [(k + a + m + b, (f if a else 1 - f) * (g if b else 1 - g)) for a in (0, 1) for b in (0, 1)]
        exact = (r + k + f + m + g) ** 2
        for lost in (lambda _: Fraction(1, 2), lambda s: abs(s) if abs(s) <= 1 else Fraction(1, 2)):
            assert sum(weight * ((r + s) ** 2 - lost(s)) for s, weight in corners) <= exact


def misfit(instance, alpha, beta):
    """The stroke and skew terms of crosses (n,), the nearer line of each."""
    turns = np.arange(-4, 5)[:, None] * np.pi
    at = instance.stroke_index
    lines = np.concatenate([alpha[at] + beta[at] + turns, alpha[at] + HALF - beta[at] + turns])
    cost = instance.skew_coefficient * beta**2
    cost[at] += instance.stroke_coefficient * instance.w * np.min((lines - instance.target) ** 2, axis=0)
    return cost


def scattered(instance, rng):
    """A field with random crosses."""
    size = instance.grid.size
    alpha = instance.alpha_lower + rng.uniform(0, HALF, size)
    beta = rng.uniform(-QUARTER, QUARTER, size)
    return CrossField(instance, alpha, beta, np.zeros(len(instance.grid.first), int)).with_best_jumps()


def test_computed_costs_of_the_four_labels_round_a_cross_average_to_no_more_than_its_own():
    for seed in range(200):
        rng = np.random.default_rng(seed)
        instance = random_instance(seed)
        lattice = Lattice.whole(scattered(instance, rng), int(rng.choice([4, 8, 16])))
        cost, h = lattice.unary_costs(), lattice.h
        row = rng.uniform(0, lattice.alpha_count - 1)
        column = rng.uniform(0, lattice.beta_count - 1)
        at = [
            lattice.h * (x + f + lattice.offset)
            for x, f in ((row, lattice.alpha_first), (column, lattice.beta_first))
        ]
        k, m = row.astype(int), column.astype(int)
        average = 0
        for a in (0, 1):
            for b in (0, 1):
                weight = np.abs(1 - a - (row - k)) * np.abs(1 - b - (column - m))
                average = average + weight * cost[lattice.start[:-1] + (k + a) * lattice.beta_count + m + b]
        exact = misfit(instance, lattice.alpha + at[0], lattice.beta + at[1])
        assert (average <= exact + 1e-12).all(), (seed, h)
