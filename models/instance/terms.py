"""The residuals of pairs and of strokes: what an energy and a field's jumps are made of.

Everything that depends on the jump between two neighbours goes through `PairTerms`
(docs/mathematics.md, 3 and 5).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .angles import HALF, SLACK
from .domain import Floats, Ints, Rings


def parity_sign(p: Ints) -> Floats:
    """The sign (-1)^p of each jump."""
    return 1.0 - 2.0 * (p & 1).astype(np.float64)


def quarter_turns(rings: Rings, offsets: Floats) -> Ints:
    """The quarter turns of a cross along each ring, (r,), with these turns of labels along pairs, (m,)."""
    return np.round((rings.defect - rings.sums(offsets)) / HALF).astype(np.int32)


@dataclass(frozen=True, eq=False)
class PairTerms:
    """Two residuals for each pair (i, j) of neighbours with the jump p.

    A = alpha_i - alpha_j + offset(p) and B = (-1)^p beta_i - beta_j, shapes (m,). Jumps may have more axes
    in front: p (c, m) are c candidates for each pair.

    first, second: the points i and j of each pair, shapes (m,). kappa: turn of a direction from the frame
    of i to that of j in radians, (m,), None where all are 0. weight: weight of each pair's smoothness, (m,),
    None where all are 1.
    """

    first: Ints
    second: Ints
    kappa: Floats | None = None
    weight: Floats | None = None

    def offset(self, p: Ints | int) -> Floats:
        """The turn kappa + pi/2 p between the two labels of a pair with jump p, which A contains."""
        return np.asarray(HALF * p if self.kappa is None else self.kappa + HALF * p)

    def weighted(self, values: Floats) -> Floats:
        """The values (m,) of the pairs times their weights."""
        return values if self.weight is None else self.weight * values

    def residual_a(self, alpha: Floats, p: Ints | int) -> Floats:
        """A of each pair, in radians, of the angles alpha (n,) of all points."""
        return np.asarray(alpha[self.first] - alpha[self.second] + self.offset(p))

    def residual_b(self, beta: Floats, p: Ints) -> Floats:
        """B of each pair, in radians, of the angles beta (n,) of all points."""
        return np.asarray(parity_sign(p) * beta[self.first] - beta[self.second])

    def jump_below(self, alpha: Floats) -> Ints:
        """The greatest jump p of each pair with A <= 0: the best even and odd ones are p and p + 1."""
        return np.floor(-self.residual_a(alpha, 0) / HALF).astype(np.int32)

    def costs(self, alpha: Floats, beta: Floats, p: Ints, size: np.ufunc = np.square) -> Floats:
        """Smooth energy 2 (phi(A) + phi(B)) of each pair. size: phi, the square or the absolute value."""
        return self.weighted(2 * (size(self.residual_a(alpha, p)) + size(self.residual_b(beta, p))))

    def least_costs(self, alpha: Floats, beta: Floats) -> Floats:
        """Least smooth energy of each pair over all jumps, shape (m,)."""
        jumps = self.jump_below(alpha) + np.array([[0], [1]], dtype=np.int32)
        costs: Floats = self.costs(alpha, beta, jumps).min(axis=0)
        return costs

    def degree(self, points: int) -> Ints:
        """Number of pairs of each point, shape (points,)."""
        ends = np.concatenate([self.first, self.second])
        return np.bincount(ends, minlength=points).astype(np.int32)

    def jump_range(self, lower: Floats, upper: Floats) -> tuple[Ints, Ints]:
        """Smallest and greatest useful jump of each pair where lower <= alpha <= upper, shapes (n,).

        For every A at jump 0 in its range, the best even and the best odd jump lie between the two.
        """
        least = lower[self.first] - upper[self.second] + self.offset(0)
        greatest = upper[self.first] - lower[self.second] + self.offset(0)
        p_min = np.floor(-2 * greatest / np.pi + SLACK).astype(np.int32)
        return p_min, np.ceil(-2 * least / np.pi - SLACK).astype(np.int32)

    def select(self, pairs: NDArray[Any], number: Ints | None = None) -> PairTerms:
        """Some of the pairs, by their numbers or a mask, at points renumbered by `number` (n,)."""
        first, second = self.first[pairs], self.second[pairs]
        kappa, weight = (None if all_ is None else all_[pairs] for all_ in (self.kappa, self.weight))
        if number is not None:
            first, second = number[first], number[second]
        return PairTerms(first, second, kappa, weight)


@dataclass(frozen=True, eq=False)
class StrokeTerms:
    """One residual R = alpha + beta - goal for each stroke point, shapes (s,).

    goal: direction in the gauge's range. weight: reliability times the instance's `stroke_coefficient`.
    """

    point: Ints
    goal: Floats
    weight: Floats

    def residuals(self, alpha: Floats, beta: Floats) -> Floats:
        """R of each term in radians, shape (s,), of the angles (n,) of all points."""
        return alpha[self.point] + beta[self.point] - self.goal

    def costs(self, alpha: Floats, beta: Floats, size: np.ufunc = np.square) -> Floats:
        """Weighted phi(R) of each term, shape (s,). size: phi, the square or the absolute value."""
        costs: Floats = self.weight * size(self.residuals(alpha, beta))
        return costs

    def at_points(self, values: Floats, size: int) -> Floats:
        """Sums of the terms' values at each of `size` points, shape (size,)."""
        return np.bincount(self.point, values, size).astype(np.float64, copy=False)
