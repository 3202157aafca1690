"""The lattice of a refinement level: for every pixel the labels (alpha, beta) to which its cross is rounded.

Label (k, l) of pixel i stands at alpha_i + h (k + o_i), beta_i + h (l + o_i) round a centre (alpha_i,
beta_i), which is the cross of the best field known. The offset o is 0 on black and 1/2 on white pixels of the
checkerboard. So the differences of neighbours at that field lie in the middle between the differences of
their labels, where a pair's discrete cost touches the true one. Rectangles of labels are stored one after
the other, each pixel's alpha-major; `allowed` marks the labels that are left.

Where pairs count with absolute values, the lattice is common to all pixels instead: every alpha and beta is a
multiple of h, and pairs lose nothing.

The discrete costs of the labels are in the mean at most the energy of the crosses that they represent.
Sections 3 and 9 of docs/proofs.md state and prove this.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...array_archive import Arrays
from ...field.field import AbsoluteNorm, CrossField, Norm
from ...field.jumps import step_labels
from ...instance.angles import HALF, QUARTER, wrap
from ...instance.domain import Bools, Floats, Ints
from ...instance.grid import Grid
from ...instance.instance import Instance

Starts = NDArray[np.int64]  # places in flat arrays, as of the starts of blocks and the end of the last one

_LINEAR: Final = 128.0  # additions that take as long as a label's part of the product over beta
_AT_ONCE: Final = 200_000  # labels whose costs are computed together, for some 100 bytes each


@dataclass(frozen=True, eq=False)
class Lattice:
    """The labels of one level.

    instance: the problem. h: spacing in radians. alpha, beta (n,), p (m,): the centres. alpha_first,
    alpha_count, beta_first, beta_count (n,): the ranges k = first ... first + count - 1 and of l. allowed:
    bool, one for each label of each pixel's rectangle, alpha-major, pixels in the grid's order. A pixel's
    cross may be anywhere in a cell whose four vertices are all allowed.

    norm: of the energy. slopes (s,): in other norms than 2, the slope of each stroke's term at the best known
    angles: in [-1, 1] in the 1-norm, and in [-pi/2, pi/2] in the mixed norm.
    """

    instance: Instance
    h: float
    alpha: Floats
    beta: Floats
    p: Ints
    alpha_first: Ints
    alpha_count: Ints
    beta_first: Ints
    beta_count: Ints
    allowed: Bools
    norm: Norm = field(default=2, kw_only=True)
    slopes: Floats = field(default_factory=lambda: np.zeros(0), kw_only=True)

    @classmethod
    def whole(cls, field: CrossField, steps: int) -> Lattice:
        """The lattice of spacing pi / (2 steps) round a field, with every cross of the strip in a cell.

        steps: an even number. alpha covers a window of length pi/2 round its centre, beta [-pi/4, pi/4].
        Cells that stick out are kept.
        """
        h = HALF / steps
        ranges = full_ranges(field.beta, h, checkerboard_offsets(field.instance.grid))
        return cls(field.instance, h, field.alpha, field.beta, field.p, **ranges)

    @classmethod
    def common(cls, field: CrossField, norm: AbsoluteNorm, slopes: Floats, steps: int) -> Lattice:
        """As `whole`, common to all pixels: centres are the multiples of h nearest to alpha, and beta 0."""
        h, beta = HALF / steps, np.zeros(field.instance.grid.size)
        alpha = h * np.round(field.alpha / h)
        most = 1.0 if norm == 1 else HALF
        ranges = full_ranges(beta, h, beta)
        return cls(
            field.instance, h, alpha, beta, field.p, **ranges, norm=norm, slopes=np.clip(slopes, -most, most)
        )

    def centre_arrays(self) -> Arrays:
        """The centre, and unless the norm is 2 the slopes, as arrays of a certificate."""
        arrays = {"centre_alpha": self.alpha, "centre_beta": self.beta}
        if self.norm == 2:
            return arrays
        slopes = np.zeros(self.instance.grid.size)
        slopes[self.instance.stroke_index] = self.slopes
        return arrays | {"slopes": slopes}

    @cached_property
    def offset(self) -> Floats:
        """The offset o of each pixel in steps, 0 or 1/2; shape (n,)."""
        return (
            checkerboard_offsets(self.instance.grid) if self.norm == 2 else np.zeros(self.instance.grid.size)
        )

    @cached_property
    def count(self) -> Ints:
        """Number of labels in each pixel's rectangle, shape (n,)."""
        return self.alpha_count * self.beta_count

    @cached_property
    def allowed_count(self) -> Starts:
        """Number of allowed labels of each pixel, shape (n,)."""
        counts, filled = np.zeros(len(self.count), np.int64), self.count > 0
        counts[filled] = np.add.reduceat(self.allowed, self.start[:-1][filled], dtype=np.int64)
        return counts

    @cached_property
    def start(self) -> Starts:
        """Start of each pixel's labels in flat arrays, shape (n + 1,)."""
        return block_starts(self.count)

    @cached_property
    def pixel(self) -> Ints:
        """The pixel of each label, flat."""
        return np.repeat(np.arange(len(self.count), dtype=np.int32), self.count)

    def steps(self, at: Starts) -> tuple[Ints, Ints]:
        """The steps k and l of some labels."""
        pixel = self.pixel[at]
        row, column = np.divmod((at - self.start[pixel]).astype(np.int32), self.beta_count[pixel])
        return self.alpha_first[pixel] + row, self.beta_first[pixel] + column

    def angles(self, at: Starts) -> tuple[Floats, Floats]:
        """Alpha and beta of some labels in radians."""
        k, l = self.steps(at)  # noqa: E741 - the letters of the equation
        pixel, offset = self.pixel[at], self.offset[self.pixel[at]]
        return self.alpha[pixel] + self.h * (k + offset), self.beta[pixel] + self.h * (l + offset)

    @property
    def pass_work(self) -> float:
        """The work of a pass, in additions of the product over alpha."""
        i, j = self.instance.grid.first, self.instance.grid.second
        rows, columns = self.alpha_count.astype(np.float64), self.beta_count.astype(np.float64)
        fill_product_over_beta = _LINEAR if self.norm == 2 else columns[j]
        return float(2 * rows[j] @ (columns[i] * fill_product_over_beta + self.allowed_count[i]))

    def share_starts(self, end: Ints) -> Starts:
        """Starts of the pairs' shares at one end (`first` or `second` of the grid), flat; shape (m + 1,)."""
        return block_starts(self.count[end])

    def unary_costs(self) -> Floats:
        """D of each label, flat: skew and stroke term; inf for labels that are not allowed."""
        cost = np.full(self.start[-1], np.inf)
        weights = self.instance.point_weight
        for begin in range(0, len(cost), _AT_ONCE):
            at = begin + np.flatnonzero(self.allowed[begin : begin + _AT_ONCE])
            alpha, beta = self.angles(at)
            cost[at] = self.instance.skew_coefficient * self._skew_costs(beta)
            weight = weights[self.pixel[at]]
            held = np.flatnonzero(weight)
            cost[at[held]] += weight[held] * self._stroke_costs(at[held], alpha[held], beta[held])
        return cost

    def _skew_costs(self, beta: Floats) -> Floats:
        return np.abs(beta) if self.norm == 1 else beta**2 - self.h * self.h / 4

    def _stroke_costs(self, at: Starts, alpha: Floats, beta: Floats) -> Floats:
        """The size of the angle from the stroke to the nearer line, less its deduction, at some labels."""
        pixel, half = self.pixel[at], self.h * self.h / 2
        target = np.zeros(self.instance.grid.size)
        target[self.instance.stroke_index] = self.instance.target
        u = alpha + beta - target[pixel]
        v = wrap(alpha + HALF - beta - target[pixel], -HALF, np.pi)
        if self.norm == 2:
            return self._stroke_squares(at, u, v, target)
        u, slope = wrap(u, -HALF, np.pi), np.zeros(self.instance.grid.size)
        slope[self.instance.stroke_index] = self.slopes
        # A value that rounding could put on either side of 2 h takes the lesser cost, that of the near side.
        near = 2 * self.h * (1 + 1e-12) + 1e-12
        if self.norm == 1:
            sizes = np.where(np.abs(u) < near, slope[pixel] * u, np.abs(u))
            return np.minimum(sizes, np.where(np.abs(v) < near, 0.0, np.abs(v)))
        away = np.abs(u - slope[pixel] / 2)
        return np.minimum(u * u - np.where(away < near, away * away, half), v * v - half)

    def _stroke_squares(self, at: Starts, u: Floats, v: Floats, target: Floats) -> Floats:
        """In the 2-norm. One line and turn, u as at the centre, has its own deduction, even if v is near."""
        pixel, square = self.pixel[at], self.h * self.h
        k, l = self.steps(at)  # noqa: E741 - the letters of the equation
        turn = np.round((self.alpha + self.beta - target) / np.pi)[pixel]
        away = np.abs(k + l + 2 * self.offset[pixel])
        lost = np.where(away <= 1, away, 0.5)
        turns = np.round(u / np.pi)
        nearest = np.abs(u - np.pi * turns)
        others = np.minimum(np.where(turns == turn, np.pi - nearest, nearest), np.abs(v))
        return np.minimum((u - np.pi * turn) ** 2 - lost * square, others**2 - square / 2)


def nearest_labels(field: CrossField, lattice: Lattice) -> tuple[Floats, Floats, Ints]:
    """Angles (n,) and jumps (m,) of a field, with the labels nearest to the centres of a lattice."""
    steps = np.round((lattice.alpha - field.alpha) / HALF).astype(np.int32)
    return step_labels(lattice.instance.grid, field.alpha, field.beta, field.p, steps)


def checkerboard_offsets(grid: Grid) -> Floats:
    """0 on black pixels of the checkerboard (row + column even), 1/2 on white ones; shape (n,)."""
    return 0.5 * ((grid.rows + grid.columns) % 2).astype(np.float64)


def ranges(k: Ints, last_k: Ints, l: Ints, last_l: Ints) -> dict[str, Any]:  # noqa: E741 - of the equation
    """The ranges of a lattice from its least and greatest k and l, with all labels allowed."""
    rows, columns = last_k - k + 1, last_l - l + 1
    allowed = np.ones(int((rows.astype(np.int64) * columns).sum()), dtype=bool)
    return {
        "alpha_first": k, "alpha_count": rows, "beta_first": l, "beta_count": columns, "allowed": allowed
    }  # fmt: skip


def full_ranges(beta: Floats, h: float, offset: Floats) -> dict[str, Any]:
    """The ranges round centres of those betas that hold every cross of the strip."""
    k = np.full(len(beta), round(QUARTER / h), np.int32)
    return ranges(-k, k, *beta_range(beta, h, offset))


def block_starts(counts: Ints | Starts) -> Starts:
    """Starts of consecutive blocks of those lengths, and the end of the last."""
    return np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])


def beta_range(beta: Floats, h: float, offset: Floats) -> tuple[Ints, Ints]:
    """Least and greatest step l so that the cells round the centres cover [-pi/4, pi/4]; shapes (n,)."""
    lower, upper = (-QUARTER - beta) / h - offset, (QUARTER - beta) / h - offset
    return np.floor(lower).astype(np.int32), np.ceil(upper).astype(np.int32)
