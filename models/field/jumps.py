"""Labels (alpha, beta) of crosses, jumps between them, and steps: (alpha + k pi/2, (-1)^k beta)."""

from __future__ import annotations

import numpy as np

from ..instance.angles import HALF, QUARTER, wrap
from ..instance.domain import Domain, Floats, Ints
from ..instance.instance import Instance
from ..instance.terms import PairTerms, parity_sign


def label_of(u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Labels (alpha, beta) of the crosses with line angles u, v in radians: alpha + beta is u modulo pi.

    |beta| <= pi/4; it is pi/4 where both lines coincide. Shapes are broadcast.
    """
    u = wrap(u, 0.0, np.pi)
    v = wrap(v, u, np.pi)
    return (u + v) / 2 - QUARTER, (u - v) / 2 + QUARTER


def best_jumps(instance: Instance, alpha: Floats, beta: Floats, *, absolute: bool = False) -> Ints:
    """The jump of least energy in [p_min, p_max] of each pair, (m,); ties go to the smaller jump.

    absolute: whether pairs count with absolute values instead of squares.
    """
    size = np.abs if absolute else np.square
    return _find_best_jumps(instance.pair_terms, alpha, beta, (instance.p_min, instance.p_max), size)[0]


def free_jumps(instance: Instance, alpha: Floats, beta: Floats) -> tuple[Ints, Floats]:
    """The best jump of each pair without a range, and its energy; ties go to the smaller jump; (m,)."""
    return _find_best_jumps(instance.pair_terms, alpha, beta)


def _find_best_jumps(
    pairs: PairTerms,
    alpha: Floats,
    beta: Floats,
    within: tuple[Ints, Ints] | None = None,
    size: np.ufunc = np.square,
) -> tuple[Ints, Floats]:
    near = pairs.jump_below(alpha)
    around = np.arange(-1, 3, dtype=np.int32)[:, None]
    # The best even and the best odd jump are near and near + 1, unless -2A/pi is a whole number.
    candidates = near + around if within is None else np.clip(np.clip(near, *within) + around, *within)
    # Rounding must not decide between equal costs.
    cost = np.round(pairs.costs(alpha, beta, candidates, size), 12)
    at = (np.argmin(cost, axis=0), np.arange(len(near)))
    return candidates[at], cost[at]


def step_labels(
    domain: Domain, alpha: Floats, beta: Floats, p: Ints, steps: Ints
) -> tuple[Floats, Floats, Ints]:
    """Angles (n,) and jumps (m,) of the crosses after `steps` (n,) of labels; residuals only change sign."""
    jumps = p - steps[domain.first] + steps[domain.second]
    return alpha + HALF * steps, parity_sign(steps) * beta, jumps
