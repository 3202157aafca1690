"""The best angles for given jumps in any norm, and their multipliers.

With x = (alpha, beta), shape (2n,), the energy at jumps p (docs/mathematics.md, 5) is sum k phi(Mx + c): two
rows for each pair, A and B with k = 2, one for each stroke, R with k = w_strokes w, and one for each pixel,
beta with k = w_beta. In the 1-norm phi is the absolute value, and the best angles solve a linear program. In
the mixed norm phi is the square in rows of strokes and pixels, in the 2-norm in all rows, and they solve a
quadratic program.

For any number l, phi(r) >= l r - psi(l): with psi = 0 and -1 <= l <= 1 for the absolute value, and with
psi = l^2 / 4 for the square. So the energy is at least the sum of k (l (Mx + c) - psi), which is linear. Its
least value in a box is a lower bound there, for l from any source. At the multipliers of the program it is
the least energy in the box.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from scipy import sparse
from scipy.sparse import linalg

from ..errors import CrossfieldError
from ..field.field import AbsoluteNorm, CrossField, Norm
from ..field.jumps import best_jumps
from ..instance.domain import Bools, Floats, Ints
from ..instance.instance import Instance
from ..instance.least_squares import Residuals, residuals_at
from ..processes.blas_threads import one_thread
from ..processes.deadline import IsOver, never
from .box_qp import angle_bounds, field_at

if TYPE_CHECKING:
    import clarabel

_BETTER: Final = 1e-9  # relative: rounding is no improvement
_TOLERANCE: Final = 1e-11
_TOUCHING: Final = 1e-7  # radians from a side of the box within which Clarabel means the side
_DECIMALS: Final = 12


def solve_angle_program(
    instance: Instance,
    p: Ints,
    norm: Norm,
    lower: Floats,
    upper: Floats,
    *,
    tilt: Floats | None = None,
    lines: Ints | None = None,
    target: Floats | None = None,
    weight: Floats | None = None,
) -> tuple[Floats, Floats]:
    """Angles x (2n,) that minimise the energy minus tilt x in a box, and multipliers (r,) of its residuals.

    Clarabel computes them; multipliers are 0 where weights are 0.

    p: jumps, shape (m,). lower, upper: the box of x = (alpha, beta) in radians, shapes (2n,). tilt: shape
    (2n,), None for zeros. lines, target: as of `residuals_at`. weight (r,): of the residuals, None for theirs
    in the energy. Raises CrossfieldError when Clarabel finds no solution; one always exists.
    """
    terms = residuals_at(instance, p, lines=lines, target=target)
    if weight is not None:
        terms = replace(terms, weight=weight)
    squared = (norm == 2) | ((np.arange(len(terms.weight)) >= 2 * len(p)) & (norm == "mixed"))
    tilt = np.zeros(len(lower)) if tilt is None else tilt
    x, multipliers = _solve_program(terms, squared, lower, upper, tilt)
    multipliers = np.where(squared, multipliers, np.clip(multipliers, -1.0, 1.0))
    multipliers[terms.weight == 0] = 0.0
    return x, multipliers


def _solve_program(
    terms: Residuals, squared: Bools, lower: Floats, upper: Floats, tilt: Floats
) -> tuple[Floats, Floats]:
    """The angles and the multipliers that solve the program, with a size t >= |r| for each absolute value.

    squared (r,): where phi is the square.
    """
    import clarabel

    n, weighted = len(lower), terms.weight > 0
    rows, squares = np.flatnonzero(weighted & ~squared), np.flatnonzero(weighted & squared)
    m, inside = len(rows), sparse.eye_array(n)
    matrix, constant, weight = terms.matrix[rows], terms.constant[rows], terms.weight[rows]
    square, goal, force = terms.matrix[squares], terms.constant[squares], 2 * terms.weight[squares]
    curved = sparse.block_diag([square.T @ sparse.diags_array(force) @ square, sparse.csr_array((m, m))])
    size, none = sparse.eye_array(m), sparse.csr_array((n, m))
    program = clarabel.DefaultSolver(
        sparse.csc_matrix(sparse.triu(curved)),
        np.append(square.T @ (force * goal) - tilt, weight),
        sparse.csc_matrix(
            sparse.block_array([[matrix, -size], [-matrix, -size], [inside, none], [-inside, none]])
        ),
        np.concatenate([-constant, constant, upper, -lower]),
        [clarabel.NonnegativeConeT(2 * (m + n))],
        _clarabel_settings(),
    )
    solution = program.solve()
    if not np.isfinite([*solution.x, *solution.z]).all():
        raise CrossfieldError(f"Clarabel found no angles for given jumps: {solution.status}")
    # Extreme weights may end it early. The numbers are then worse, but any of them are valid.
    angles = np.clip(np.array(solution.x)[:n], lower, upper)
    if not m:
        angles = _polish(curved, square.T @ (force * goal) - tilt, angles, lower, upper)
    above, below = np.split(np.array(solution.z)[: 2 * m], 2)
    multipliers = 2 * terms.at(angles)
    multipliers[rows] = (above - below) / weight
    return angles, multipliers


def _polish(curved: Any, linear: Floats, angles: Floats, lower: Floats, upper: Floats) -> Floats:
    """A step of Newton's method for the angles off the sides of the box, which gives them their last digits.

    A bound from multipliers loses the slope that is left at them times the side of the box.
    """
    free = np.flatnonzero(np.minimum(angles - lower, upper - angles) > _TOUCHING)
    slope = curved @ angles + linear
    try:
        step = linalg.splu(sparse.csc_matrix(curved)[free][:, free]).solve(-slope[free])
    except (RuntimeError, ValueError):  # singular, or nothing is free
        return angles
    polished = angles.copy()
    polished[free] = np.clip(angles[free] + step, lower[free], upper[free])
    change = polished - angles
    is_lower = change @ (slope + curved @ change / 2) <= 0
    return polished if is_lower else angles


def _clarabel_settings() -> clarabel.DefaultSettings:
    """One thread, and more digits than usual, for they are the proof's."""
    import clarabel

    settings = clarabel.DefaultSettings()
    settings.verbose, settings.max_threads = False, 1
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = _TOLERANCE
    return settings


@one_thread()
def fit_absolute(field: CrossField, norm: AbsoluteNorm) -> tuple[CrossField, Floats]:
    """Return the field of least energy for the jumps of `field`, and the multipliers of its strokes, (s,)."""
    instance, m, within = field.instance, len(field.p), angle_bounds(field.instance)
    fitted, multipliers = solve_angle_program(instance, field.p, norm, *within)
    # Rounding makes equal angles equal, which the solver returns with its error.
    rounded = np.clip(np.round(fitted, _DECIMALS), *within)
    fields = [field_at(instance, x, field.p) for x in (rounded, fitted)]
    best = min(*fields, field, key=lambda candidate: candidate.energy(norm).total)
    return best, multipliers[2 * m : 2 * m + len(instance.theta)]


@one_thread()
def alternate_absolute(field: CrossField, norm: AbsoluteNorm, is_over: IsOver = never) -> CrossField:
    """The field after alternating best jumps and best angles, which lower its energy in that norm."""
    best, least = field, field.energy(norm).total
    while not is_over():
        jumps = best_jumps(field.instance, best.alpha, best.beta, absolute=True)
        fitted, _ = fit_absolute(CrossField(field.instance, best.alpha, best.beta, jumps), norm)
        energy = fitted.energy(norm).total
        if energy >= least * (1 - _BETTER):
            break
        best, least = fitted, energy
    return best
