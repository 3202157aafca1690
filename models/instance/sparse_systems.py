"""Solution of sparse systems: factors and conjugate gradients."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, cg, splu

from ..processes.blas_threads import one_thread
from .domain import Bools, Floats

Solve = Callable[[np.ndarray[Any, Any]], np.ndarray[Any, Any]]

PULL: Final = 1e-9  # pull to the present values, where strokes or w_beta are missing and a system is singular

_SINGULAR: Final = 1e-13  # share of a diagonal that is added where rounding has made a matrix singular
_ROUNDING: Final = 1e-9  # residual, absolute, below which a local solution would follow rounding
_COLUMNS: Final = 16  # that are solved for at once: eight times as fast as thousands
_MOST_STEPS: Final = 1000  # of conjugate gradients without a factorisation; 20 to 100 are usual


def factor_matrix(matrix: Any, *, pull: float = PULL) -> Solve:
    """The solver of a positive semidefinite Hermitian system H, made definite as H + pull."""
    pulled = (matrix + pull * sparse.eye_array(matrix.shape[0])).tocsc()
    try:
        with one_thread():
            # A definite matrix needs no pivots, so the ordering by minimum degree keeps the factors sparse.
            # In these, dense blocks of several columns would mostly hold zeros.
            factors = splu(
                pulled,
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                relax=1,
                panel_size=1,
                options={"SymmetricMode": True},
            )
    except RuntimeError:  # singular in double precision: weights differ by 15 orders of magnitude
        return factor_matrix(matrix + sparse.diags_array(_SINGULAR * pulled.diagonal()), pull=pull)

    def solve(right: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        with one_thread():
            if right.ndim == 1:
                return np.asarray(factors.solve(right))
            solution = np.empty(right.shape, np.result_type(pulled.dtype, right.dtype), order="F")
            for at in range(0, right.shape[1], _COLUMNS):
                solution[:, at : at + _COLUMNS] = factors.solve(
                    np.asfortranarray(right[:, at : at + _COLUMNS])
                )
        return solution

    return solve


def solve_banded(matrix: Any, right: Floats, raised: Floats) -> Floats:
    """The x with (H + diag(raised) + PULL) x = right, for a definite H with all entries near its diagonal."""
    from scipy.linalg import solveh_banded

    below = np.repeat(np.arange(len(right)), np.diff(matrix.indptr)) - matrix.indices
    lower, width = below >= 0, below.max() + 1
    band = np.zeros((len(right), width))
    band.ravel()[(matrix.indices * width + below)[lower]] = matrix.data[lower]
    band[:, 0] += raised + PULL
    with one_thread():
        solution: Floats = solveh_banded(band.T, right, lower=True, overwrite_ab=True, check_finite=False)
    return solution


def solve_by_gradients(
    matrix: Any,
    right: np.ndarray[Any, Any],
    residual: float,
    *,
    steps: int = _MOST_STEPS,
    inverse: Solve | None = None,
) -> tuple[np.ndarray[Any, Any], bool]:
    """Solve (H + PULL) x = right by conjugate gradients, H Hermitian and semidefinite.

    residual: relative, at which to end. inverse: preconditioner; None divides by the diagonal, and ends at a
    residual of 1e-9, too. Returns x, and whether that many steps were too few.
    """
    least = _ROUNDING if inverse is None else 0.0
    if inverse is None:
        scale = 1 / (matrix.diagonal().real + PULL)
        inverse = scale.__mul__
    pulled = LinearOperator(matrix.shape, lambda v: matrix @ v + PULL * v, dtype=matrix.dtype)
    near = LinearOperator(matrix.shape, inverse, dtype=matrix.dtype)
    with one_thread():
        x, late = cg(pulled, right, rtol=residual, atol=least, maxiter=steps, M=near)
    return x, late != 0


class SimilarSystems:
    """Solves similar symmetric systems one after another, by the factors of an earlier one if few steps do.

    steps: of conjugate gradients, preconditioned by these factors, after which the present one is factored.
    """

    def __init__(self, *, steps: int = 25) -> None:
        self._steps = steps
        self._factors: Solve | None = None

    def solve(self, matrix: Any, right: Floats, residual: float, free: Bools | None = None) -> Floats:
        """The x with (H + PULL) x = right on the free unknowns, 0 on others, to a relative residual."""
        if free is not None and not free.all():
            only = sparse.diags_array(free.astype(np.float64))
            right, matrix = only @ right, only @ matrix @ only + sparse.diags_array(1.0 - free)
        for _ in range(2):
            if self._factors is not None:
                x, late = solve_by_gradients(
                    matrix, right, residual, steps=self._steps, inverse=self._factors
                )
                if not late:
                    break
            self._factors = factor_matrix(matrix)
        return x
