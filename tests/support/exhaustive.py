"""Small instances, and their least energy over all jumps by dense least squares:
a second opinion on greedy fields and searches.
"""

import crossfield as cf
import numpy as np
from angles import HALF, QUARTER
from crossfield.models.field.jumps import best_jumps
from crossfield.models.instance.terms import parity_sign
from crossfield.models.search.box_qp import fit_in_box


def sketch(mask, theta, skew_coefficient=1e-6, gauge="strokes", w=None):
    """An instance with strokes where the picture theta (radians) is a number."""
    theta = np.where(mask, theta, np.nan)
    at = np.argwhere(np.isfinite(theta))
    weight = np.ones(len(at)) if w is None else w
    return cf.Instance.on_pixels(
        "sketch", mask, at, theta[tuple(at.T)], weight, skew_coefficient=skew_coefficient, gauge=gauge
    )


def random_instance(seed, shape=None, strokes=6, gauge="strokes"):
    rng = np.random.default_rng(seed)
    mask = rng.random(rng.integers(1, 7, 2)) < 0.7 if shape is None else np.ones(shape, bool)
    mask[rng.integers(mask.shape[0]), rng.integers(mask.shape[1])] = True
    at = np.argwhere(mask)
    at = at[np.sort(rng.permutation(len(at))[: 1 + rng.integers(strokes)])]
    return cf.Instance.on_pixels(
        "random",
        mask,
        at,
        rng.uniform(0, np.pi, len(at)),
        1 - rng.random(len(at)),
        skew_coefficient=1e-3,
        gauge=gauge,
    )


def random_field(instance, seed, beyond=-1e-3):
    """Crosses anywhere inside their windows, with the best jumps; beyond: share of those at either end."""
    rng = np.random.default_rng(seed)
    at_alpha, at_beta = np.clip(rng.uniform(-beyond, 1 + beyond, (2, instance.domain.size)), 0, 1)
    alpha = np.clip(instance.alpha_lower + HALF * at_alpha, instance.alpha_lower, instance.alpha_upper)
    beta = (HALF * at_beta - QUARTER) * (not instance.orthogonal)
    return cf.CrossField(instance, alpha, beta, best_jumps(instance, alpha, beta))


def assert_feasible(field):
    instance = field.instance
    assert ((field.alpha >= instance.alpha_lower) & (field.alpha <= instance.alpha_upper)).all()
    assert (np.abs(field.beta) <= QUARTER).all()
    assert ((field.p >= instance.p_min) & (field.p <= instance.p_max)).all()


def exact(instance):
    """The least energy over all jumps in the bounds, with the bounds of alpha and beta left out:
    a lower bound.
    """
    return min(least_energy(instance, part).min() for part in every_jump(instance))


def optimum(instance):
    """The field of least energy for the best jumps of `exact`: the optimum where no window binds.

    Of jumps with the same energy it takes the first, whatever the last digits of the processor.
    """
    parts = list(every_jump(instance))
    energies = np.concatenate([least_energy(instance, part) for part in parts])
    best = np.concatenate(parts)[np.argmax(energies <= energies.min() + 1e-9)]
    angles = np.zeros(instance.grid.size)
    return fit_in_box(cf.CrossField(instance, angles, angles, best))


def every_jump(instance):
    """All jumps in the bounds, shape (k, m), those of one parity together."""
    ranges = [np.arange(low, high + 1) for low, high in zip(instance.p_min, instance.p_max, strict=True)]
    jumps = (
        np.stack([axis.ravel() for axis in np.meshgrid(*ranges, indexing="ij")], axis=1)
        if ranges
        else np.zeros((1, 0), int)
    )
    group = (jumps & 1) @ (1 << np.arange(len(ranges)))
    order = np.argsort(group, kind="stable")
    return np.split(jumps[order], np.nonzero(np.diff(group[order]))[0] + 1)


def least_energy(instance, jumps):
    """The least energy for each row of jumps, all of one parity, by dense least squares on the residuals;
    no windows.
    """
    rows, goal, weight = terms(instance, jumps[0])
    root = np.sqrt(weight)
    right = np.tile(goal, (len(jumps), 1))
    right[:, : jumps.shape[1]] = -HALF * jumps
    right *= root
    basis = np.linalg.qr(rows * root[:, None])[0]
    return np.sum((right - (right @ basis) @ basis.T) ** 2, axis=1)


def terms(instance, p):
    """All residuals as rows x - goal of the angles x = (alpha, beta), and their weights."""
    grid, n, strokes = instance.grid, instance.grid.size, instance.stroke_terms
    unit, none = np.eye(n), np.zeros((n, n))
    a = np.hstack([unit[grid.first] - unit[grid.second], none[grid.first]])
    b = np.hstack([none[grid.first], parity_sign(p)[:, None] * unit[grid.first] - unit[grid.second]])
    r = np.hstack([unit[strokes.point], unit[strokes.point]])
    rows = np.vstack([a, b, r, np.hstack([none, unit])])
    goal = np.concatenate([-HALF * np.asarray(p), np.zeros(len(b)), strokes.goal, np.zeros(n)])
    skew = np.full(n, instance.skew_coefficient)
    of_pair = 2.0 * (np.ones(len(a)) if instance.pair_weights is None else instance.pair_weights)
    return rows, goal, np.concatenate([of_pair, of_pair, strokes.weight, skew])


def windows(instance):
    """Least and greatest angles (alpha, beta)."""
    beta = np.full(instance.grid.size, QUARTER)
    lower, upper = np.concatenate([instance.alpha_lower, -beta]), np.concatenate([instance.alpha_upper, beta])
    return lower, np.maximum(upper, lower + 1e-15)
