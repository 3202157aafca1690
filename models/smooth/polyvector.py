"""The PolyVector field and the power field: crosses from one linear system, without labels or jumps.

Diamanti, Vaxman, Panozzo, Sorkine-Hornung: Designing N-PolyVector Fields with Complex Polynomials (Computer
Graphics Forum 33, 2014). A cross is the pair of roots exp(2 i u), exp(2 i v) of z^2 + X1 z + X0. The power
field smooths exp(4 i theta), with right angles everywhere (Knoppel et al., ACM Trans. Graph. 32, 2013).
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ..arguments import check_count, check_positive
from ..field.field import CrossField, field_in_windows
from ..field.jumps import free_jumps, label_of
from ..instance.angles import HALF
from ..instance.domain import Floats
from ..instance.instance import Instance
from ..instance.least_squares import Residuals, two_entry_matrix
from ..instance.sparse_systems import Solve, factor_matrix, solve_by_gradients
from ..processes.blas_threads import one_thread
from .two_levels import FEW, approximate_inverse

_Complex = NDArray[np.complex128]

HOLDS: Final = (0.1, 1.0, 100.0)  # factors of the stroke weights worth trying: loose, as in the energy, hard
_HARDEST: Final = 1e4  # weight of a stroke, far above the 2 of a pair; `PULL` still counts in 16 digits
_ITERATIONS: Final = 100  # of inverse iteration: the next eigenvalues are close, and their vectors good, too
_EXACT: Final = 1e-12  # relative residual of the polynomials of more pixels than `FEW`
_STEPS: Final = 200  # of conjugate gradients; 20 to 40 are usual
_PULL: Final = 1e-2  # weight of the directions of a step, far below the 2 of a pair
_DECIMALS: Final = 9  # of line angles in quarter turns: rounding errors must not decide jumps


@one_thread()
def polyvector_field(instance: Instance, *, hold: float = 1.0, tolerance: float | None = None) -> CrossField:
    """Field of the smoothest polynomials whose roots are the lines, with the best jumps.

    The two lines of a cross may have any angle. The coefficients X0, X1 of s^2 + X1 s + X0 minimise a sum of

    - 2 (abs(X0_i - X0_j)^2 + abs(X1_i - X1_j)^2) over pairs,
    - hold w abs(s^2 + X1 s + X0)^2 over strokes, where s = exp(2 i theta) should be a root,
    - w_beta abs(X1)^2 over pixels, which prefers right angles where nothing else counts.

    Near a right-angled cross along the stroke this is 16 times the energy of docs/mathematics.md, 5, with
    hold w for the weights w. Parts without a stroke get alpha = beta = 0. Where crosses are orthogonal, X1 is
    0, which gives the power field for these weights. Labels are moved into the windows of the instance
    (docs/mathematics.md, 10).

    Parameters
    ----------
    instance
        The instance.
    hold
        Factor of the stroke weights, above 0. A small factor gives the lowest energy on most drawings, whose
        strokes contradict each other. A large one gives the lowest energy on clean curves that cross.
    tolerance
        Relative residual of the polynomials, which are then solved without a factorisation in a third of the
        time. None: solve exactly.

    Raises
    ------
    InputError
        For a factor or tolerance that is not above 0.

    """
    check_positive("hold", hold)
    if tolerance is not None:
        check_positive("tolerance", tolerance)
    coefficients = _polynomials(instance, hold, tolerance)
    u, v = (HALF * np.round(line / HALF, _DECIMALS) for line in roots(*coefficients))
    alpha, beta = label_of(u, v)
    beta *= not instance.orthogonal  # the roots of z^2 + X0 are at right angles up to rounding
    start = field_in_windows(instance, alpha, beta, free_jumps(instance, alpha, beta)[0])
    return start.with_best_jumps()


def _polynomials(instance: Instance, hold: float, tolerance: float | None) -> tuple[_Complex, _Complex]:
    """The coefficients X0, X1 (n,) of each pixel."""
    size, strokes = instance.grid.size, instance.stroke_terms
    weight = np.minimum(hold * strokes.weight, _HARDEST)
    root = np.exp(2j * instance.theta)

    def sums(values: _Complex) -> _Complex:
        return strokes.at_points(values.real, size) + 1j * strokes.at_points(values.imag, size)

    alike = _smoothness(instance) + sparse.diags_array(strokes.at_points(weight, size))
    once = sums(weight * root) * (not instance.orthogonal)
    matrix = _couple_coefficients(alike, once, instance.skew_coefficient)
    right = np.concatenate([-sums(weight * root**2), -once])
    x, is_late = np.zeros_like(right), True
    if tolerance is not None:
        x, is_late = solve_by_gradients(matrix, right, tolerance)[0], False
    elif size > FEW:
        links = (np.concatenate([ends, ends + size]) for ends in (instance.grid.first, instance.grid.second))
        inverse = approximate_inverse(matrix, instance.grid, *links)
        x, is_late = solve_by_gradients(matrix, right, _EXACT, steps=_STEPS, inverse=inverse)
    if is_late:
        x = factor_matrix(matrix)(right)
    return x[:size], x[size:]


def _smoothness(instance: Instance, power: int = 0) -> Any:
    """The matrix (n, n) of the sum of 2 |z_i exp(i power kappa) - z_j|^2 over pairs, times their weights.

    Real where all frames are alike or power is 0; otherwise Hermitian.
    """
    pairs, n = instance.pair_terms, instance.domain.size
    m = len(pairs.first)
    turn = 1.0 if pairs.kappa is None or power == 0 else np.exp(1j * power * pairs.kappa)
    rows = two_entry_matrix(pairs.first, pairs.second, n, turn)
    return Residuals(rows, np.zeros(m), pairs.weighted(np.full(m, 2.0))).normal_matrix


def _couple_coefficients(alike: Any, cross: _Complex, skew: float) -> Any:
    """The Hermitian matrix (2n, 2n) of both coefficients: `alike` for each, diagonals that couple them."""
    size = len(cross)
    at = np.nonzero(cross)[0]
    tie = sparse.csr_array((cross[at], (at, at)), shape=(size, size))
    return sparse.block_array(
        [[alike, tie], [tie.conj().T, alike + skew * sparse.eye_array(size)]], format="csr"
    )


def roots(x0: _Complex, x1: _Complex) -> tuple[Floats, Floats]:
    """The angles u, v (n,) in radians of the roots of z^2 + X1 z + X0; as for z^2 = 1 where both are 0."""
    x0 = np.where((x0 == 0) & (x1 == 0), -1.0, x0)
    apart = np.sqrt(x1**2 - 4 * x0)
    return np.angle(apart - x1) / 2, np.angle(-apart - x1) / 2


@one_thread()
def power_field(instance: Instance, *, steps: int = 0) -> CrossField:
    """Field of orthogonal crosses from the harmonic extension of exp(4 i theta), with the best jumps.

    The complex numbers z minimise the sum of 2 abs(z_i exp(4 i kappa) - z_j)^2 over pairs and of
    w abs(z - exp(4 i theta))^2 over strokes. Parts of a mesh without strokes get the eigenvector of the least
    eigenvalue of that sum. Then alpha = arg(z) / 4 and beta = 0. Labels are moved into the windows of the
    instance (docs/mathematics.md, 10).

    Parameters
    ----------
    instance
        The instance.
    steps
        Number of further solves, in each of which all z, scaled to one length, pull at z like weak strokes.
        Far from strokes z fades away, and its directions improve by this: on five closed meshes of 8,000 to
        20,000 faces, 30 steps lowered the energy by 8 to 15 %.

    Raises
    ------
    InputError
        For a negative number of steps.

    """
    check_count("steps", steps)
    strokes, size = instance.stroke_terms, instance.domain.size
    along, across = (
        strokes.at_points(strokes.weight * f(4 * instance.theta), size) for f in (np.cos, np.sin)
    )
    goal = along + 1j * across
    matrix = _smoothness(instance, power=4) + sparse.diags_array(instance.point_weight)
    solve = factor_matrix(matrix)
    is_complex = np.iscomplexobj(matrix)

    def smooth(values: _Complex) -> _Complex:
        return solve(values) if is_complex else solve(values.view(float).reshape(-1, 2)) @ np.array([1, 1j])

    z = smooth(goal)
    free = (np.abs(z) == 0) & is_complex
    z = np.where(free, _least_eigenvector(matrix, solve), z) if free.any() else z
    for _ in range(steps):
        z = smooth(goal + _PULL * z / np.maximum(np.abs(z), np.finfo(float).tiny))
    alpha, beta = np.angle(z) / 4, np.zeros(size)
    start = field_in_windows(instance, alpha, beta, free_jumps(instance, alpha, beta)[0])
    return start.with_best_jumps()


def _least_eigenvector(matrix: Any, solve: Solve) -> _Complex:
    """The eigenvector of least eigenvalue of each part of a Hermitian matrix, by inverse iteration, (n,)."""
    parts, part = connected_components(abs(matrix), directed=False)
    random = np.random.default_rng(0).normal(size=(2, len(part)))
    z: _Complex = random[0] + 1j * random[1]
    for _ in range(_ITERATIONS):
        z, most = solve(z), np.zeros(parts)
        np.maximum.at(most, part, np.abs(z))
        z = z / most[part]
    return z
