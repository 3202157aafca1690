"""Residuals as variables: their limits in an optimum, the data of cycles, and the way back to angles."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from ..instance.angles import HALF, QUARTER, SLACK, wrap
from ..instance.cycles import integrate
from ..instance.domain import Floats
from ..instance.instance import Instance

_ROUNDING: Final = 1e-8  # radians added to a limit: more than its error, and than SCIP takes for 0
_ZERO: Final = 2e-9  # radians of a right side that SCIP reads as 0: rounding of angles or of coordinates
_BLOCK: Final = 256  # right sides that are solved at once, which bounds memory


def limit_residuals(instance: Instance) -> tuple[Floats, Floats]:
    """Limits of |A| of all pairs (m,) and of |R| of all strokes (s,) that every optimum of the 2-norm keeps.

    If one jump changes by one and all angles follow, the energy changes by c (pi/2)^2 (1 - r) - pi c |A|,
    where c is the conductance 2 omega of the pair and r its effective resistance times c, in the network of
    all pairs and of strokes as pairs with the ground. No optimum gains by that, so |A| <= pi/4 (1 - r);
    strokes likewise. Fields that one such change improves are cut off.
    """
    from ..instance.least_squares import RightAngles  # it loads SciPy, which other files do not need

    terms = RightAngles.of(instance)
    rows, count = terms.matrix, len(terms.weight)
    resistance = np.zeros(count)
    for start in range(0, count, _BLOCK):
        sides = rows[start : start + _BLOCK].toarray().T
        resistance[start : start + _BLOCK] = (sides * terms.solve_system(sides)).sum(axis=0)
    limits = np.minimum(QUARTER * (1 - terms.weight * resistance) + _ROUNDING, QUARTER)
    pairs = len(instance.domain.first)
    return limits[:pairs], limits[pairs:]


def residual_data(instance: Instance, limited: bool, *, cycles: bool) -> dict[str, Any]:
    """The arrays that symbols denote: limits of residuals, and what they need of cycles if there are any."""
    sizes = len(instance.domain.first), len(instance.theta)
    d_max, q_max = limit_residuals(instance) if limited else [np.full(size, QUARTER) for size in sizes]
    limits = {"d_max": d_max, "q_max": q_max}
    return limits | (_cycle_data(instance, d_max, q_max) if cycles else {})


def _cycle_data(instance: Instance, d_max: Floats, q_max: Floats) -> dict[str, Any]:
    """Signs of steps, holonomies, and ranges of the quarter turns along each cycle."""
    cycles, kappa, theta = instance.cycles, instance.domain.kappa, instance.target
    is_open = cycles.ends[:, 0] >= 0
    start, end = cycles.ends[is_open].T
    holonomy = np.zeros(len(is_open)) if kappa is None else cycles.sums(kappa)
    holonomy[is_open] += theta[start] - theta[end]
    holonomy[np.abs(holonomy) < _ZERO] = 0.0  # programs differ about so small right sides
    reach = np.zeros(len(is_open))
    np.add.at(reach, np.repeat(np.arange(len(reach)), np.diff(cycles.start)), d_max[cycles.pair])
    reach[is_open] += q_max[start] + q_max[end]
    k_min, k_max = np.ceil((-reach - holonomy) / HALF - SLACK), np.floor((reach - holonomy) / HALF + SLACK)
    if (prescribed := instance.prescribed_rings) is not None:  # a closed part has the last ring by the others
        _, cycle, ring = np.intersect1d(cycles.rings, prescribed.number, return_indices=True)
        k_min[cycle] = k_max[cycle] = prescribed.turns[ring]
    return {
        "sign": cycles.sign.astype(np.float64),
        "is_open": is_open.astype(np.int32),
        "holonomy": holonomy,
        "k_min": k_min,
        "k_max": k_max,
    }


def angles_and_jumps(instance: Instance, d: Floats, q: Floats) -> tuple[Floats, Floats]:
    """Angles alpha (n,) within their windows and jumps (m,) of the residuals of pairs (m,) and strokes (s,).

    The angles follow from the strokes along the forest of `cycles`; a part without stroke begins at 0.
    """
    domain = instance.domain
    at_roots = np.zeros(domain.size)
    at_roots[instance.stroke_index] = instance.target + q
    alpha = integrate(instance.cycles, domain, instance.pair_terms.offset(0) - d, at_roots)
    alpha = wrap(alpha, instance.alpha_lower, HALF)
    return alpha, np.round((d - instance.pair_terms.residual_a(alpha, 0)) / HALF)
