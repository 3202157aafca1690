"""The best angles for given jumps, equal on every processor.

Solvers of linear systems round differently on each kind of processor: soft directions of the energy make
angles differ by up to 1e-10. Here the solution is refined with slopes that are right to twice the digits of
a double, and then rounded to twelve decimals. Fields with the same jumps get the same angles, from any
initial angles.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ..field.field import CrossField
from ..instance.domain import Floats
from ..instance.grid import Grid
from ..instance.least_squares import Residuals, residuals_at
from ..instance.sparse_systems import SimilarSystems
from ..orthogonal.energy import OrthogonalEnergy
from ..processes.blas_threads import one_thread
from .box_qp import angle_bounds, field_at, fit_in_box
from .nearest_stroke import nearest_strokes

_DECIMALS: Final = 12  # as in directions of strokes
_AT_BOUND: Final = 1e-11  # radians from a bound within which an angle is at the bound
_SMALLEST: Final = 1e-19  # radians: a smaller step changes no rounded angle
_MOST_STEPS: Final = 60  # 4 to 8 are usual
_LINEAR: Final = 1e-8  # relative residual of a step
_SPLITTER: Final = 2.0**27 + 1


@one_thread()
def reproducible_field(field: CrossField) -> CrossField:
    """Field of least 2-norm energy with the jumps of `field`, angles rounded to twelve decimals.

    Within the bounds that `fit_in_box` keeps. Parts of the mask without strokes keep the angles from there,
    also rounded.
    """
    instance, start = field.instance, fit_in_box(field)
    lower, upper = angle_bounds(instance)
    energy, solver = residuals_at(instance, field.p), SimilarSystems()
    unreached = np.zeros(len(lower), dtype=bool)
    if isinstance(instance.domain, Grid):
        unreached = np.tile(nearest_strokes(instance) < 0, 2)
    else:  # a part without strokes may turn as a whole
        unreached[OrthogonalEnergy.of(instance).pins] = True
    x, rest = np.concatenate([start.alpha, start.beta]), np.zeros(len(lower))
    for _ in range(_MOST_STEPS):
        slope = _slope(energy, x, rest)
        held = unreached | ((x <= lower) & (slope > 0)) | ((x >= upper) & (slope < 0))
        step = solver.solve(energy.normal_matrix, -slope, _LINEAR, ~held)
        moved = np.clip(x + (rest + step), lower, upper)
        inside = (moved > lower) & (moved < upper)
        x, rest = moved, np.where(inside, (rest + step) - (moved - x), 0.0)
        if np.abs(step).max() <= _SMALLEST:
            break
    x = np.round(x + rest, _DECIMALS) + 0.0  # no -0.0
    x = np.where(x - lower < _AT_BOUND, lower, np.where(upper - x < _AT_BOUND, upper, x))
    return field_at(instance, x, field.p)


def _slope(energy: Residuals, x: Floats, rest: Floats) -> Floats:
    """Half the gradient at x + rest, shapes (2n,), each entry rounded once."""
    matrix = energy.normal_matrix
    product, error = _two_product(matrix.data, x[matrix.indices])
    terms = np.stack([product, error, matrix.data * rest[matrix.indices]], axis=1).ravel().tolist()
    ends, vector = (3 * matrix.indptr).tolist(), energy.right_side.tolist()
    rows = zip(ends[:-1], ends[1:], vector, strict=True)
    return np.array([math.fsum([*terms[begin:end], -goal]) for begin, end, goal in rows])


def _two_product(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Products and their rounding errors, whose sums are exact (Dekker, Numer. Math. 18, 1971)."""
    product = a * b
    a_high, b_high = (_SPLITTER * factor - (_SPLITTER * factor - factor) for factor in (a, b))
    a_low, b_low = a - a_high, b - b_high
    error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    return product, error
