"""An approximate inverse of large systems on pixels, which costs less than the factors of all unknowns.

Smoothed aggregation with one coarse level, which is factored: Vanek, Mandel, Brezina: Algebraic Multigrid by
Smoothed Aggregation for Second and Fourth Order Elliptic Problems (Computing 56, 1996).
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ..instance.domain import Ints
from ..instance.grid import Grid
from ..instance.sparse_systems import PULL, Solve, factor_matrix

FEW: Final = 4096  # pixels up to which systems are factored
_SIDE: Final = 3  # pixels of an aggregate: smoothed ones meet only their eight neighbours
_DAMPING: Final = 0.7  # of Jacobi's method


def approximate_inverse(matrix: Any, grid: Grid, first: Ints, second: Ints) -> Solve:
    """An approximate inverse of a positive semidefinite Hermitian matrix (2n, 2n), itself Hermitian.

    Up to `FEW` pixels it is the inverse, by factors: as quick, and the same for a turned sketch. On more,
    a step of damped Jacobi comes before and after the coarse solution. Pixel i has the unknowns i and n + i,
    which Jacobi's method solves together. A coarse unknown stands for linked ones within 3 x 3 pixels.

    first, second: (k,), linked unknowns of neighbouring pixels, which differ little in smooth solutions.
    """
    if grid.size <= FEW:
        return factor_matrix(matrix)
    matrix = (matrix + PULL * sparse.eye_array(matrix.shape[0])).tocsr()
    row, column = (np.tile(places // _SIDE, 2) for places in (grid.rows, grid.columns))
    inside = (row[first] == row[second]) & (column[first] == column[second])
    links = sparse.csr_array(
        (np.ones(np.count_nonzero(inside)), (first[inside], second[inside])), shape=matrix.shape
    )
    count, aggregate = connected_components(links, directed=False)
    every = np.arange(len(aggregate))
    whole = sparse.csr_array(
        (np.ones(len(every), matrix.dtype), (every, aggregate)), shape=(len(every), count)
    )
    relax = _DAMPING * _invert_blocks(matrix, grid.size)
    grow = (whole - relax @ (matrix @ whole)).tocsr()
    shrink = grow.conj().T.tocsr()
    solve_coarse = factor_matrix(shrink @ (matrix @ grow))

    def solve(right: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        x: np.ndarray[Any, Any] = relax @ right
        x += grow @ solve_coarse(shrink @ (right - matrix @ x))
        x += relax @ (right - matrix @ x)
        return x

    return solve


def _invert_blocks(matrix: Any, size: int) -> Any:
    """The matrix of the inverses of the blocks of the unknowns i and size + i."""
    diagonal, beside = matrix.diagonal().real, matrix.diagonal(size)
    above, below = np.split(diagonal, 2)
    determinant = above * below - np.abs(beside) ** 2
    tied = np.nonzero(beside)[0]
    tie = sparse.csr_array(((-beside / determinant)[tied], (tied, tied)), shape=(size, size))
    return sparse.block_array(
        [
            [sparse.diags_array(below / determinant), tie],
            [tie.conj().T, sparse.diags_array(above / determinant)],
        ],
        format="csr",
    )
