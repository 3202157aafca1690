"""Solution of sparse systems: factors, bands, and conjugate gradients."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from scipy import sparse
from scipy.linalg import solveh_banded
from scipy.sparse.linalg import LinearOperator, cg, splu

from ..processes.blas_threads import one_thread
from .domain import Bools, Floats, Ints

Solve = Callable[[np.ndarray[Any, Any]], np.ndarray[Any, Any]]

PULL: Final = 1e-9  # pull to the present values, where strokes or w_beta are missing and a system is singular

_SINGULAR: Final = 1e-13  # share of a diagonal that is added where rounding has made a matrix singular
_ROUNDING: Final = 1e-9  # residual, absolute, below which a local solution would follow rounding
_DENSE: Final = 8  # columns of a dense block in the factors by nested dissection
_LEAF: Final = 24  # places that are not parted
_MOST_STEPS: Final = 1000  # of conjugate gradients without a factorisation; 20 to 100 are usual


def factor_matrix(matrix: Any, order: Ints | None = None, *, pull: float = PULL) -> Solve:
    """The solver of a positive semidefinite Hermitian system H, made definite as H + pull.

    order: of elimination, which keeps the factors sparse, as from `nested_dissection_order`. None finds one
    by minimum degree, which is better for systems where only neighbours meet.
    """
    pulled = (matrix + pull * sparse.eye_array(matrix.shape[0])).tocsc()
    try:
        with one_thread():
            # A definite matrix needs no pivots, so the ordering keeps the factors sparse. In the sparse
            # factors by minimum degree, dense blocks of several columns would mostly hold zeros.
            factors = splu(
                pulled if order is None else pulled[order][:, order],
                permc_spec="MMD_AT_PLUS_A" if order is None else "NATURAL",
                diag_pivot_thresh=0.0,
                relax=1 if order is None else _DENSE,
                panel_size=1 if order is None else _DENSE,
                options={"SymmetricMode": True},
            )
    except RuntimeError:  # singular in double precision: weights differ by 15 orders of magnitude
        stiffer = sparse.diags_array(_SINGULAR * pulled.diagonal())
        return factor_matrix(matrix + stiffer, order, pull=pull)

    def solve(right: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        with one_thread():
            if order is None:
                unordered: np.ndarray[Any, Any] = factors.solve(right)
                return unordered
            solution = np.empty_like(right)
            solution[order] = factors.solve(right[order])
        return solution

    return solve


def nested_dissection_order(row: Ints, column: Ints, reach: int) -> Ints:
    """The order of elimination of unknowns at places of a grid by nested dissection, (n,).

    row, column: of the unknowns, (n,). reach: rows or columns between two unknowns that meet in an equation.
    A strip as wide as that parts the places into halves, whose unknowns are eliminated before its own.
    """
    order: list[Ints] = []
    todo: list[Ints] = [np.arange(len(row), dtype=np.int32)]
    while todo:
        at = todo.pop()
        tall, wide = np.ptp(row[at]), np.ptp(column[at])
        along = (row if tall >= wide else column)[at]
        first = np.partition(along, len(at) // 2)[len(at) // 2]
        if len(at) <= _LEAF or max(tall, wide) <= reach:
            order.append(at)
            continue
        before, after = along < first, along >= first + reach
        # From the last to the first: the strip, then both halves.
        order.append(at[~(before | after)])
        todo += [half for half in (at[before], at[after]) if len(half)]
    return np.concatenate(order[::-1])


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

    Parameters
    ----------
    order
        Of elimination, as of `factor_matrix`.
    steps
        Of conjugate gradients, preconditioned by these factors, after which the present system is factored.
    few
        Unknowns of systems on a grid that are always solved exactly, within a band.

    """

    def __init__(self, order: Ints | None = None, *, steps: int = 25, few: int = 0) -> None:
        self._order, self._steps, self._few = order, steps, few
        self._factors: Solve | None = None

    def solve(self, matrix: Any, right: Floats, residual: float, free: Bools | None = None) -> Floats:
        """The x with (H + PULL) x = right on the free unknowns, 0 on others, to a relative residual."""
        if len(right) <= self._few:
            return _solve_banded(matrix, right)
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
            self._factors = factor_matrix(matrix, self._order)
        return x


def _solve_banded(matrix: Any, right: Floats) -> Floats:
    """The x with (H + PULL) x = right by Cholesky factors within a band: quick for few unknowns."""
    entries = matrix.tocoo()
    row, column = entries.coords
    below = row >= column
    step = (row - column)[below]
    band = np.zeros((step.max() + 1, len(right)))
    band[step, column[below]] = entries.data[below]
    band[0] += PULL
    with one_thread():
        solution: Floats = solveh_banded(band, right, lower=True, check_finite=False)
    return solution
