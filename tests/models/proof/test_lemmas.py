"""The lemmas of the bound in exact rational numbers, and for the costs as they are computed."""

import random
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from crossfield.models.field.field import CrossField
from crossfield.models.instance.angles import HALF, QUARTER
from crossfield.models.proof.check_certificate import has_forced_jump, is_convex, last_step
from crossfield.models.proof.last_step import energy_terms, minimise_on_boxes
from crossfield.models.proof.lattice import Lattice
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


@pytest.mark.slow
def test_a_forced_jump_is_best_and_the_tilted_quadratic_below_the_energy_all_over_the_boxes():
    cases = np.zeros(2, int)
    for seed in range(150):
        rng = np.random.default_rng(seed)
        instance = random_instance(seed, shape=(2, 3))
        size = instance.grid.size
        smooth = CrossField(
            instance,
            instance.alpha_lower + QUARTER + rng.uniform(-0.9, 0.9),
            np.full(size, rng.uniform(-QUARTER, QUARTER)),
            np.zeros(len(instance.grid.first), int),
        ).with_best_jumps()
        wide = rng.uniform(0.01, 0.5)
        ends = [rng.uniform(0, wide, size) for _ in range(4)]
        beta_low = np.maximum(smooth.beta - ends[2], -QUARTER)
        beta_high = np.minimum(smooth.beta + ends[3], QUARTER)
        low, high = (smooth.alpha - ends[0], beta_low), (smooth.alpha + ends[1], beta_high)
        terms = energy_terms(instance, 2)
        boxes = np.stack([low[0], high[0], low[1], high[1]], axis=1)
        step = last_step(terms, boxes, smooth.alpha, smooth.p.astype(int))
        pairs, convex = has_forced_jump(terms, step.p, boxes), is_convex(terms, step)
        enough = np.inf if seed % 2 else 0.0
        least = minimise_on_boxes(instance, terms, step, enough).bound if convex else -np.inf
        for corner in range(20):
            t, s = rng.uniform(0, 1, (2, size)) if corner else rng.integers(0, 2, (2, size))
            alpha = low[0] + t * (high[0] - low[0])
            beta = low[1] + s * (high[1] - low[1])
            field = CrossField(instance, alpha, beta, step.p.astype(np.int32))
            mine = field.residual_a**2 + field.residual_b**2
            best = mine.copy()
            for turn in range(-3, 4):
                other = CrossField(instance, alpha, beta, step.p.astype(np.int32) + turn)
                best = np.minimum(best, other.residual_a**2 + other.residual_b**2)
            assert np.allclose(best[pairs], mine[pairs], atol=1e-12), seed
            if convex:
                energy = 2 * best.sum() + misfit(instance, alpha, beta).sum()
                assert least <= energy + 1e-12, seed
                at = instance.stroke_index
                ends = np.abs([low[0][at] - step.theta[at], high[0][at] - step.theta[at]])
                cases += [1, ends.max() > QUARTER]
    assert (cases > 50).all(), cases
