"""Energies as weighted sums of squares of residuals, which are linear where jumps are fixed.

With x = (alpha, beta), shape (2n,), the residuals of a field with jumps p (docs/mathematics.md, 5) are A and
B of each pair, R of each stroke, and beta of each point. Where crosses are orthogonal, A and R remain, with
x = alpha. They are then the rows of an incidence matrix: strokes lead to one further vertex, the ground,
whose angle is 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from .angles import HALF
from .domain import Bools, Floats, Ints
from .instance import Instance
from .sparse_systems import Solve, factor_matrix
from .terms import parity_sign


@dataclass(frozen=True, eq=False)
class Residuals:
    """Weighted residuals r = M x + c, with the energy sum of k r^2.

    matrix: M, sparse (r, x), real or complex. constant: c, (r,). weight: k, at least 0, (r,).
    """

    matrix: Any
    constant: Floats
    weight: Floats

    @staticmethod
    def join(parts: Sequence[Residuals]) -> Residuals:
        """All residuals of some parts with the same unknowns."""
        return Residuals(
            sparse.vstack([part.matrix for part in parts], format="csr"),
            np.concatenate([part.constant for part in parts]),
            np.concatenate([part.weight for part in parts]),
        )

    def at(self, x: Floats) -> Floats:
        """The residuals at x, (r,)."""
        return np.asarray(self.matrix @ x + self.constant)

    def energy(self, x: Floats) -> float:
        """The energy at x."""
        residual = self.at(x)
        return float(self.weight @ (residual * residual))

    @cached_property
    def normal_matrix(self) -> Any:
        """The matrix H = M' diag(k) M of the normal equations H x = b, sparse (x, x)."""
        return self.weighted_matrix(self.weight)

    @cached_property
    def right_side(self) -> Floats:
        """The vector b = -M' diag(k) c of the normal equations, (x,)."""
        return np.asarray(-(self.matrix.T @ (self.weight * self.constant)))

    def weighted_matrix(self, weight: Floats) -> Any:
        """The normal matrix with other weights (r,), sparse (x, x)."""
        rows = self.matrix
        counts = np.repeat(weight, np.diff(rows.indptr))
        weighted = sparse.csr_array((rows.data * counts, rows.indices, rows.indptr), shape=rows.shape)
        return rows.conj().T.tocsr() @ weighted

    def slope(self, x: Floats) -> Floats:
        """Half the gradient of the energy, H x - b, shape (x,)."""
        return np.asarray(self.matrix.T @ (self.weight * self.at(x)))

    def change(self, slope: Floats, step: Floats) -> float:
        """Change of the energy by a step from the point with that slope."""
        return float(step @ (2 * slope + self.normal_matrix @ step))


def two_entry_matrix(first: Ints, second: Ints, size: int, here: Any = 1.0, there: Any = -1.0) -> Any:
    """The sparse matrix (r, size) of here x_first + there x_second; here, there: numbers or (r,)."""
    values = np.stack([np.broadcast_to(value, len(first)) for value in (here, there)], axis=1).ravel()
    ends = np.stack([first, second], axis=1).ravel()
    return sparse.csr_array((values, ends, np.arange(0, len(ends) + 1, 2)), shape=(len(first), size))


def residuals_at(
    instance: Instance,
    p: Ints,
    known: Bools | None = None,
    *,
    lines: Ints | None = None,
    target: Floats | None = None,
) -> Residuals:
    """Residuals of the angles (alpha, beta) at jumps p (m,): A and B of pairs, R of strokes, beta of points.

    known (m,): the pairs that count, None for all. lines (s,): 0 where line u carries the stroke, None for
    zeros; -1 and 1 where v does, below and above the window of u. target (s,): the direction of each stroke
    at one turn, None for that of the gauge.
    """
    pairs, strokes, n = instance.pair_terms, instance.stroke_terms, instance.domain.size
    if known is not None:
        pairs, p = pairs.select(known), p[known]
    m, s = len(p), len(strokes.goal)
    lines = np.zeros(s, np.int32) if lines is None else lines
    target = strokes.goal if target is None else target
    turned = two_entry_matrix(
        np.concatenate([pairs.first, pairs.first + n, strokes.point]),
        np.concatenate([pairs.second, pairs.second + n, strokes.point + n]),
        2 * n,
        np.concatenate([np.ones(m), parity_sign(p), np.ones(s)]),
        np.concatenate([np.full(2 * m, -1.0), np.where(lines == 0, 1.0, -1.0)]),
    )
    betas = np.arange(n, dtype=np.int32)
    rows = (
        np.append(turned.data, np.ones(n)),
        np.append(turned.indices, betas + n),
        np.append(turned.indptr, turned.indptr[-1] + betas + 1),
    )
    of_pair = pairs.weighted(np.full(m, 2.0))
    skew = np.full(n, instance.skew_coefficient)
    return Residuals(
        sparse.csr_array(rows, shape=(2 * m + s + n, 2 * n)),
        np.concatenate([pairs.offset(p), np.zeros(m), -target - HALF * lines, np.zeros(n)]),
        np.concatenate([of_pair, of_pair, strokes.weight, skew]),
    )


@dataclass(frozen=True, eq=False)
class RightAngles(Residuals):
    """Residuals A and R of crosses with beta = 0 at jumps 0, by alpha (n,): rows of an incidence matrix.

    first, second: the ends of each row, (r,); n is the ground.
    """

    first: Ints
    second: Ints

    @classmethod
    def between(cls, size: int, first: Ints, second: Ints, constant: Floats, weight: Floats) -> Self:
        """The residuals of rows between those of `size` points."""
        matrix = two_entry_matrix(first, second, size + 1)[:, :size]
        return cls(matrix, constant, weight, first, second)

    @classmethod
    def of(cls, instance: Instance) -> Self:
        """The residuals of an instance as if all its crosses were orthogonal: of pairs, then of strokes."""
        pairs, strokes, n = instance.pair_terms, instance.stroke_terms, instance.domain.size
        m, s = len(pairs.first), len(strokes.point)
        return cls.between(
            n,
            np.concatenate([pairs.first, strokes.point]),
            np.concatenate([pairs.second, np.full(s, n, dtype=np.int32)]),
            np.concatenate([np.broadcast_to(pairs.offset(0), m), -strokes.goal]),
            np.concatenate([pairs.weighted(np.full(m, 2.0)), strokes.weight]),
        )

    @property
    def size(self) -> int:
        """Number of points n."""
        return int(self.matrix.shape[1])

    @cached_property
    def links(self) -> Any:
        """Sparse matrix (n, n) with an entry where a row of weight joins two points."""
        used = (np.maximum(self.first, self.second) < self.size) & (self.weight > 0)
        ends = (self.first[used], self.second[used])
        return sparse.csr_array((np.ones(len(ends[0])), ends), shape=(self.size, self.size))

    @cached_property
    def pins(self) -> Ints:
        """First point of each part that no row of weight ties to the ground: its angle is 0."""
        part = connected_components(self.links, directed=False)[1]
        ties = (np.maximum(self.first, self.second) == self.size) & (self.weight > 0)
        parts, points = np.unique(part, return_index=True)
        tied = part[np.minimum(self.first, self.second)[ties]]
        return np.asarray(points[~np.isin(parts, tied)], dtype=np.int32)

    def weighted_matrix(self, weight: Floats) -> Any:
        """The normal matrix with these weights, 1 more at pins; definite if its rows join what all join."""
        pinned = np.zeros(self.size)
        pinned[self.pins] = 1.0
        return super().weighted_matrix(weight) + sparse.diags_array(pinned)

    @cached_property
    def solve_system(self) -> Solve:
        """The solver of the normal equations."""
        return factor_matrix(self.normal_matrix, pull=0.0)
