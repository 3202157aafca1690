"""The energy at fixed jumps as a quadratic form, and solutions of its sparse systems.

With x = (alpha, beta), shape (2n,), the 2-norm energy (docs/mathematics.md, 5) is x'Hx - 2 b'x + constant. H
holds 2, -2 per pair in alpha and 2, -2 (-1)^p per pair in beta, w at strokes, also between alpha_i and
beta_i, and w_beta.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, cg

from ..instance.domain import Bools, Floats, Ints
from ..instance.instance import Instance
from ..instance.terms import parity_sign
from ..smooth.sparse_systems import PULL, Solve, factor_matrix, symmetric_matrix

CLOSE: Final = 1e-2  # relative residual of a step that ranks jumps as the exact one does

_MOST_STEPS: Final = 25  # of conjugate gradients; beyond, a new factorisation is cheaper


@dataclass(frozen=True, eq=False)
class QuadraticForm:
    """A quadratic x'Hx - 2 b'x: matrix H, sparse (2n, 2n), positive semidefinite, and vector b (2n,)."""

    matrix: Any
    vector: Floats

    def slope(self, x: Floats) -> Floats:
        """Half the gradient, Hx - b, shape (2n,)."""
        slope: Floats = self.matrix @ x - self.vector
        return slope

    def change(self, slope: Floats, step: Floats) -> float:
        """Change of the value for a step from the point of that slope."""
        return float(step @ (2 * slope + self.matrix @ step))


def energy_at(instance: Instance, p: Ints, known: Bools | None = None) -> QuadraticForm:
    """The 2-norm energy as a function of the angles, over the pairs of known jump (None: all)."""
    n, at, strokes = instance.domain.size, instance.stroke_index, instance.stroke_terms
    pairs = instance.pair_terms
    if known is not None:
        pairs, p = pairs.select(known), p[known]
    i, j = pairs.first, pairs.second
    of_pair = pairs.weighted(np.full(len(p), 2.0))
    degree = np.bincount(i, of_pair, n) + np.bincount(j, of_pair, n)
    weight, turn = instance.point_weight, of_pair * pairs.offset(p)
    couplings = np.concatenate([-of_pair, -of_pair * parity_sign(p), weight[at]])
    diagonal = np.concatenate([degree + weight, degree + weight + instance.skew_coefficient])
    row, column = np.concatenate([i, i + n, at]), np.concatenate([j, j + n, at + n])
    matrix = symmetric_matrix(row, column, couplings, diagonal)
    goal = strokes.at_points(strokes.weight * strokes.goal, n)
    pulled = np.bincount(j, turn, n) - np.bincount(i, turn, n)
    return QuadraticForm(matrix, np.concatenate([pulled + goal, goal]))


class LinearSolver:
    """Solver of systems that differ little: one factorisation preconditions the following ones."""

    def __init__(self) -> None:
        self._inverse: Solve | None = None

    def step(self, matrix: Any, right: Floats, tolerance: float, free: Bools | None = None) -> Floats:
        """The s with Hs = right on the free unknowns, 0 on others, to a residual of `tolerance`."""
        if free is not None and not free.all():
            only = sparse.diags_array(free.astype(np.float64))
            right, matrix = only @ right, only @ matrix @ only + sparse.diags_array(1.0 - free)
        if self._inverse is not None:
            step, done = self.attempt(matrix, right, tolerance)
            if done:
                return step
        self._inverse = factor_matrix(matrix)
        return self.attempt(matrix, right, tolerance)[0]

    def attempt(self, matrix: Any, right: Floats, tolerance: float) -> tuple[Floats, bool]:
        """Try the step with few conjugate gradients; return whether the present factorisation sufficed."""
        inverse = LinearOperator(matrix.shape, matvec=self._inverse, dtype=np.float64)
        pulled = LinearOperator(matrix.shape, matvec=lambda v: matrix @ v + PULL * v, dtype=np.float64)
        step, failed = cg(pulled, right, rtol=tolerance, maxiter=_MOST_STEPS, M=inverse)
        return step, not failed
