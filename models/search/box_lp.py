"""The best angles for given jumps in the 1-norm: a linear program, and the bound from its multipliers.

With x = (alpha, beta), shape (2n,), the 1-norm energy at jumps p (docs/mathematics.md, 5) is sum k |Mx +
c|: two rows for each pair, A and B with k = 2, one for each stroke, R with k = w_strokes w, and one for
each pixel, beta with k = w_beta. For numbers -1 <= l <= 1 it is at least the sum of k l (Mx + c), which
is linear. The least value of this sum in a box is a lower bound there, for l from any source. At the
multipliers of the linear program it is the least energy in the box.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ..errors import CrossfieldError
from ..field.field import CrossField
from ..field.jumps import best_jumps, parity_sign
from ..instance.grid import Floats, Ints
from ..instance.instance import HALF, Instance
from ..processes.deadline import Over, never
from ..smooth.systems import one_thread
from .box_qp import bounds, field_at

_BETTER = 1e-9  # relative: rounding is no improvement


@dataclass(frozen=True, eq=False)
class Residuals:
    """The residuals Mx + c of all terms at given jumps, and their weights k, shapes (r, 2n), (r,), (r,)."""

    matrix: sparse.csr_array
    constant: Floats
    weight: Floats

    @classmethod
    def at(cls, instance: Instance, p: Ints) -> Residuals:
        """Residuals at jumps p (m,): A and B of all pairs, R of all strokes, then beta of all pixels."""
        n, first, second = instance.grid.size, instance.grid.first, instance.grid.second
        unit, m, strokes = sparse.eye_array(n, format="csr"), len(first), instance.stroke_terms
        nothing, at = sparse.csr_array((m, n)), unit[strokes.pixel]
        a = sparse.hstack([unit[first] - unit[second], nothing])
        b = sparse.hstack([nothing, sparse.diags_array(parity_sign(p)) @ unit[first] - unit[second]])
        r = sparse.hstack([at, at])
        skew = sparse.hstack([sparse.csr_array((n, n)), unit])
        return cls(
            sparse.vstack([a, b, r, skew], format="csr"),
            np.concatenate([HALF * p, np.zeros(m), -strokes.goal, np.zeros(n)]),
            np.concatenate([np.full(2 * m, 2.0), strokes.weight, np.full(n, instance.skew_coefficient)]),
        )

    def bound(self, multipliers: Floats, lower: Floats, upper: Floats) -> float:
        """A lower bound of the energy with lower <= x <= upper, shapes (2n,), from any multipliers."""
        force = self.weight * np.clip(multipliers, -1.0, 1.0)
        slope = self.matrix.T @ force
        terms = np.concatenate([force * self.constant, np.minimum(slope * lower, slope * upper)])
        size = np.abs(force) @ (np.abs(self.matrix) @ np.maximum(np.abs(lower), np.abs(upper)))
        return math.fsum(terms) - 2.0**-48 * float(size + np.abs(terms).sum())


def linear_fit(instance: Instance, p: Ints, lower: Floats, upper: Floats) -> tuple[Floats, Floats, float]:
    """Angles x of least energy at jumps p with lower <= x <= upper, shapes (2n,), by HiGHS.

    Also returns l of each residual, see `Residuals`, 0 where weights are 0; and a lower bound of the energy.
    Raises CrossfieldError when HiGHS ends without a solution, which a linear program of this kind has.
    """
    from scipy.optimize import linprog

    terms = Residuals.at(instance, p)
    rows = terms.matrix.shape[0]
    both = sparse.eye_array(rows)
    found = linprog(
        np.concatenate([np.zeros(len(lower)), terms.weight, terms.weight]),
        A_eq=sparse.hstack([terms.matrix, -both, both], format="csc"),
        b_eq=-terms.constant,
        bounds=np.stack([np.pad(lower, (0, 2 * rows)), np.append(upper, [np.inf] * (2 * rows))], axis=1),
        method="highs",
    )
    if found.x is None:
        raise CrossfieldError(f"HiGHS found no angles for given jumps: {found.message}")
    multipliers = np.clip(-found.eqlin.marginals / np.maximum(terms.weight, 1e-300), -1.0, 1.0)
    multipliers[terms.weight == 0] = 0.0
    x = np.clip(found.x[: len(lower)], lower, upper)
    return x, multipliers, terms.bound(multipliers, lower, upper)


@one_thread()
def fitted_1norm(field: CrossField) -> tuple[CrossField, Floats]:
    """The field of least 1-norm energy with the jumps of `field`, and its strokes' multipliers, (s,)."""
    instance, m = field.instance, len(field.p)
    x, multipliers, _ = linear_fit(instance, field.p, *bounds(instance))
    strokes = multipliers[2 * m : 2 * m + len(instance.theta)]
    return field_at(instance, x, field.p), strokes


@one_thread()
def settled_1norm(field: CrossField, over: Over = never) -> CrossField:
    """The field after alternating best jumps and best angles in the 1-norm, which lower its energy."""
    best, least = field, field.energy(1).total
    while not over():
        jumps = best_jumps(field.instance, best.alpha, best.beta, norm=1)
        found, _ = fitted_1norm(CrossField(field.instance, best.alpha, best.beta, jumps))
        energy = found.energy(1).total
        if energy >= least * (1 - _BETTER):
            break
        best, least = found, energy
    return best
