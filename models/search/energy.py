"""The energy at fixed jumps as a quadratic form, and solutions of its sparse systems.

With x = (alpha, beta), shape (2n,), the 2-norm energy (docs/mathematics.md, 5) is x'Hx - 2 b'x + constant. H
holds 2, -2 per pair in alpha and 2, -2 (-1)^p per pair in beta, w at strokes, also between alpha_i and
beta_i, and w_beta.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, cg

from ..instance.domain import Bools, Floats
from ..instance.sparse_systems import PULL, Solve, factor_matrix

CLOSE: Final = 1e-2  # relative residual of a step that ranks jumps as the exact one does

_MOST_STEPS: Final = 25  # of conjugate gradients; beyond, a new factorisation is cheaper


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
