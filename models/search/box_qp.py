"""The best angles for given jumps: the box-constrained quadratic program `qp-fixed`, without a solver.

A projected Newton method (Bertsekas, SIAM J. Control Optim. 20, 1982). Variables near a bound that the slope
pushes outwards make a plain gradient step. The others make a Newton step, which for a quadratic form leads to
its minimum over them. Both are clipped, and halved until the energy falls enough. Once the right bounds are
found, one step leads to the minimum.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from ..field.field import CrossField, field_in_windows
from ..instance.angles import QUARTER
from ..instance.domain import Floats, Ints
from ..instance.instance import Instance
from ..instance.least_squares import Residuals, residuals_at
from ..instance.sparse_systems import PULL, SimilarSystems
from ..processes.blas_threads import one_thread
from ..processes.deadline import IsOver, never

CLOSE: Final = 1e-2  # relative residual of a step that ranks jumps as the exact one does

_SLOPE: Final = 1e-12  # relative to the largest entry of b; rounding leaves about 1e-15
_NEAR: Final = 1e-3  # radians from a bound within which it may hold a variable
_NEWTON: Final = 1e-2  # relative residual of a Newton step: a smaller one is wasted while bounds change
_MOST_STEPS: Final = 500  # 5 to 50 are usual; contact along a curve recedes by some pixels per step
_MOST_HALVINGS: Final = 40
_DECREASE: Final = 0.1  # least share of the decrease that the slope promises


def fit_in_box(field: CrossField, is_over: IsOver = never) -> CrossField:
    """The field of least 2-norm energy with the jumps of `field` in its bounds: the optimum of `qp-fixed`.

    Where the energy does not determine angles (parts without strokes), they stay near the given ones.
    """
    energy, x = residuals_at(field.instance, field.p), np.concatenate([field.alpha, field.beta])
    x = minimise_in_box(energy, x, *angle_bounds(field.instance), is_over=is_over)
    return field_at(field.instance, x, field.p)


def field_at(instance: Instance, x: Floats, p: Ints) -> CrossField:
    """The field with the angles x = (alpha, beta), shape (2n,), and jumps p."""
    alpha, beta = np.split(x, 2)
    return CrossField(instance, alpha, beta, p)


def angle_bounds(instance: Instance) -> tuple[Floats, Floats]:
    """Least and greatest (alpha, beta) of a field, shapes (2n,)."""
    quarter = np.full(instance.domain.size, 0.0 if instance.orthogonal else QUARTER)
    lower = np.concatenate([instance.alpha_lower, -quarter])
    return lower, np.concatenate([instance.alpha_upper, quarter])


def stroke_bounds(instance: Instance) -> tuple[Floats, Floats]:
    """As `angle_bounds`, with alpha bounded only at strokes."""
    lower, upper = angle_bounds(instance)
    free = np.ones(instance.domain.size, dtype=bool)
    free[instance.stroke_index] = False
    lower[: len(free)][free], upper[: len(free)][free] = -np.inf, np.inf
    return lower, upper


@one_thread()
def minimise_in_box(
    energy: Residuals,
    x: Floats,
    lower: Floats,
    upper: Floats,
    *,
    solver: SimilarSystems | None = None,
    tolerance: float = _SLOPE,
    is_over: IsOver = never,
) -> Floats:
    """The point of least energy with lower <= x <= upper, shapes (2n,), searched from x.

    Bounds may be infinite. The search also ends when rounding decides, after 500 steps, or when time is over.
    tolerance: the largest remaining slope that no bound balances, relative to 1 + the largest entry of b.
    solver: one that was used for a similar system, which saves a factorisation.
    """
    solver = SimilarSystems() if solver is None else solver
    enough = tolerance * (1 + np.abs(energy.right_side).max())
    stiffness = energy.normal_matrix.diagonal() + PULL
    x = np.clip(x, lower, upper)
    for _ in range(_MOST_STEPS):
        if is_over():
            break
        slope = energy.slope(x)
        plain = np.clip(x - slope / stiffness, lower, upper) - x
        if np.abs(plain * stiffness).max() <= enough:
            break
        near = min(_NEAR, np.abs(plain).max())
        held = np.where(slope > 0, x <= lower + near, x >= upper - near)
        step = np.where(held, plain, solver.solve(energy.normal_matrix, -slope, _NEWTON, ~held))
        ends = (np.clip(x + 0.5**k * step, lower, upper) for k in range(_MOST_HALVINGS))
        end = next((end for end in ends if _falls_enough(energy, slope, end - x)), None)
        if end is None:
            break
        x = end
    return x


def _falls_enough(energy: Residuals, slope: Floats, step: Floats) -> bool:
    """Whether a nonzero step lowers the energy by a fair share of the decrease that the slope promises."""
    promised = float(slope @ step)
    return promised < 0 and energy.change(slope, step) <= 2 * _DECREASE * promised


@dataclass(eq=False)
class FreeField:
    """A field under construction: angles that may be any real numbers, jumps without ranges.

    Windows and ranges of an instance make the label of a cross unique, but hinder growth and search.
    """

    instance: Instance
    alpha: Floats
    beta: Floats
    p: Ints

    @classmethod
    def of(cls, field: CrossField) -> FreeField:
        """The same angles and jumps, free to change."""
        return cls(field.instance, field.alpha, field.beta, field.p)

    @property
    def x(self) -> Floats:
        """Both angles, (alpha, beta), shape (2n,)."""
        return np.concatenate([self.alpha, self.beta])

    @x.setter
    def x(self, value: Floats) -> None:
        self.alpha, self.beta = np.split(value, 2)

    @property
    def field(self) -> CrossField:
        """The same angles and jumps as a field."""
        return CrossField(self.instance, self.alpha, self.beta, self.p)

    @property
    def energy(self) -> float:
        """The 2-norm energy."""
        return self.field.energy().total

    def fit_in_bounds(self, is_over: IsOver = never) -> CrossField:
        """The field of least 2-norm energy for these jumps, within the bounds of alpha, beta and p."""
        return fit_in_box(field_in_windows(self.instance, self.alpha, self.beta, self.p), is_over)
