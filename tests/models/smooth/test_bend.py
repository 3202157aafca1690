"""The bend field and its start: exact on constant crosses, near the truth on surfaces."""

import itertools
from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from angles import HALF
from crossfield.models.smooth import polyvector, two_levels
from crossfield.models.smooth.bend import HARMONIC, HOLD, TREMBLE, tremble
from crossfield.models.smooth.polyvector import HOLDS
from exhaustive import sketch
from loops import for_each
from moves import lines


def noisy(instance, degrees, seed):
    noise = np.random.default_rng(seed).normal(0, np.radians(degrees), len(instance.theta))
    return replace(instance, theta=instance.theta + noise)


def neighbours(field):
    """By pixel and side: differences (du, dv) of the lines of a pixel, to the right or upwards."""
    grid, differences = field.instance.grid, {}
    for i, j, p, upward in zip(grid.first, grid.second, field.p, grid.upward, strict=True):
        sides, sign = ("up", "down") if upward else ("right", "left"), 1 - 2 * (p & 1)
        of_j = field.alpha[j] - HALF * p, sign * field.beta[j]  # in the labels of i
        of_i = field.alpha[i] + HALF * p, sign * field.beta[i]  # in the labels of j
        a, b = of_j[0] - field.alpha[i], of_j[1] - field.beta[i]
        differences[i, sides[0]] = a + b, a - b
        a, b = field.alpha[j] - of_i[0], field.beta[j] - of_i[1]
        differences[j, sides[1]] = a + b, a - b
    return differences


def bend_energy(field, hold=HOLD):
    """The energy of docs/mathematics.md, 10, pixel by pixel."""
    instance, at = field.instance, neighbours(field)
    total = 0.0
    for pixel, (u, v) in enumerate(zip(*lines(field), strict=True)):
        for beside in ("left", "right"):
            for above in ("down", "up"):
                if (pixel, beside) in at and (pixel, above) in at:
                    (ux, vx), (uy, vy) = at[pixel, beside], at[pixel, above]
                    total += (np.cos(v) * ux + np.sin(v) * uy) ** 2 / 4
                    total += (np.cos(u) * vx + np.sin(u) * vy) ** 2 / 4
    pairs = [du**2 + dv**2 for (_, side), (du, dv) in at.items() if side in {"right", "up"}]
    strokes = instance.stroke_coefficient * np.sum(instance.w * field.stroke_deviation**2)
    return (
        total + 2 * HARMONIC * sum(pairs) + hold * strokes + instance.skew_coefficient * np.sum(field.beta**2)
    )


@for_each("degrees", [(0, 90), (100, 40), (179, 60)])
def test_constant_crosses_stay(degrees):
    theta = np.full((6, 7), np.nan)
    theta[:, 1], theta[:, 5] = np.radians(degrees)
    instance = replace(sketch(np.ones((6, 7), bool), theta), skew_coefficient=0)
    angles = [np.full(42, np.radians(angle)) for angle in degrees]
    field = cf.bend_field(cf.CrossField.from_lines(instance, *angles))
    assert field.cross_error(*angles) == pytest.approx(np.zeros(42), abs=1e-9)
    assert bend_energy(field) < 1e-12


@for_each("name", ["singular", "bottle"])
def test_the_energy_falls_and_the_singularities_stay(name):
    """The energy recomputed pixel by pixel: that of the start is above, and bending again never raises it.

    The greedy field of light strokes lies far from strokes that are then held harder.
    """
    start, hold = cf.greedy_field(replace(cf.sample(name, 16), stroke_coefficient=1)), 1.5
    field = cf.bend_field(start, harmonic=HARMONIC, hold=hold)
    assert bend_energy(field, hold) < 0.8 * bend_energy(start, hold)
    assert field.singularities.index.tolist() == start.singularities.index.tolist()
    again = cf.bend_field(field, harmonic=HARMONIC, hold=hold)
    assert bend_energy(again, hold) <= bend_energy(field, hold) * (1 + 1e-9)


def test_labels_do_not_matter():
    instance = cf.sample("singular", 16)
    start = cf.greedy_field(instance)
    field = cf.bend_field(start)
    boxed = cf.bend_field(cf.CrossField.from_lines(instance.with_gauge("box"), *lines(start)))
    assert (boxed.p != field.p).any()
    assert field.cross_error(*lines(boxed)) == pytest.approx(0, abs=1e-6)


@for_each("surface", [("tilted_cylinder", 0.1, 1.2), ("torus_patch", 1.8, 4.5), ("wave_sheet", 0.3, 2.5)])
def test_the_field_is_near_the_true_curvature_lines(surface):
    """Mean degrees with exact strokes, and with 3 degrees of noise on each stroke pixel."""
    name, clean, rough = surface
    true = cf.analytic(name, 48)
    for degrees, most in ((0, clean), (3, rough)):
        field = cf.bend_field(cf.polyvector_field(noisy(true.instance, degrees, seed=1), hold=max(HOLDS)))
        assert np.degrees(field.cross_error(true.u_angle, true.v_angle).mean()) <= most


def test_fields_are_as_smooth_as_the_strokes_tremble():
    """Clean strokes get the least plain smoothness, those with 8 degrees of noise the most."""
    clean = cf.analytic("wave_sheet", 48).instance
    for degrees, harmonic, other in ((0, 0.01, HARMONIC), (8, HARMONIC, 0.01)):
        start = cf.polyvector_field(noisy(clean, degrees, seed=1), hold=max(HOLDS))
        field = cf.bend_field(start)
        near, far = (cf.bend_field(start, harmonic=weight).alpha for weight in (harmonic, other))
        assert np.abs(field.alpha - near).max() < 1e-4
        assert np.abs(field.alpha - far).max() > 1e-3
    starts = [cf.polyvector_field(noisy(clean, 3, seed), hold=max(HOLDS)) for seed in range(4)]
    trembles = [tremble(cf.bend_field(start, harmonic=HARMONIC)) for start in starts]
    assert np.mean(trembles) == pytest.approx(TREMBLE, rel=0.15)


def test_more_rounds_lower_the_energy_and_none_returns_the_start():
    start = cf.polyvector_field(cf.sample("mouse", 16), hold=max(HOLDS))

    def bent(rounds):
        asked = itertools.count()
        return cf.bend_field(start, harmonic=HARMONIC, stop=lambda: next(asked) >= rounds)

    assert bent(0) is start
    energies = [bend_energy(bent(rounds)) for rounds in (1, 2, 3)]
    assert energies == sorted(energies, reverse=True)


@pytest.mark.parametrize("name", ["mouse", "bottle"])
def test_two_levels_find_the_fields_that_factors_find(name, monkeypatch):
    instance = cf.sample(name, 64)
    fields = []
    for few in (0, instance.grid.size):
        monkeypatch.setattr(polyvector, "FEW", few)
        monkeypatch.setattr(two_levels, "FEW", few)
        start = cf.polyvector_field(instance, hold=100.0)
        fields.append((start, cf.bend_field(start)))
    (start, bend), (exact_start, exact_bend) = fields
    assert np.array_equal(start.p, exact_start.p)
    assert start.cross_error(exact_start.u_angle, exact_start.v_angle) == pytest.approx(0, abs=1e-6)
    assert bend.energy(2).total == pytest.approx(exact_bend.energy(2).total, rel=2e-3)
