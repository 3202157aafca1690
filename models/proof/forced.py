"""The convex quadratic that remains when no choice of jumps and lines is left.

Let p be the jumps of the centre, s = (-1)^p, and Q the energy with these jumps and with line u at its own
turn at every stroke: convex, `qp-fixed`.

Jumps. p is a best jump of a pair on its whole box where |A| <= pi/2 and pi |A| - pi^2/4 <= 4 s beta_i beta_j:
one step further A^2 falls by pi |A| - pi^2/4 at most, and B^2 grows by 4 s beta_i beta_j; two steps further
A^2 does not fall, and B stays.

Strokes. Let a = alpha - theta, |a| <= 3 pi/4. Where |a| <= pi/4, u at this turn is the nearest line. Above
pi/4 it is v, and with e = a - pi/4 the cost of u exceeds v's cost, (alpha - pi/2 - beta - theta)^2, by 4 e
(beta + pi/4). Below -pi/4, with e = -pi/4 - a, it exceeds (alpha + pi/2 - beta - theta)^2 by 4 e (pi/4 -
beta). With e replaced by its greatest value on the box, these are linear in beta. So the energy is at least
Q minus w times both: again a convex quadratic. It loses nothing where beta is at the end at which u and v
coincide. If the loss is too large, the box is cut at the edges of the window into pieces. In the pieces
beyond, v carries the stroke, and on each piece the energy is again a convex quadratic.

The least value of that quadratic on the boxes is bounded from its gradient g at any point x: by its value
there + the least of g (y - x) over y in the boxes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import sparse

from ..field.field import CrossField
from ..instance.grid import Bools, Floats, Ints
from ..instance.instance import HALF, QUARTER
from ..processes.deadline import Over, never
from ..search.box_qp import least_in_box
from ..search.energy import Quadratic, energy_at
from .pruning import RemainingCells
from .record import EXACT

_MOST_PIECES: Final = 60
_ROUNDING: Final = 1e-10
"""Deduction from a bound, relative to 1 + its value: float64 loses some 1e-12 in it."""


@dataclass(frozen=True, eq=False)
class Forced:
    """Choices that the boxes force.

    pairs (m,): whether the jump of the centre is a best one on the whole box. strokes (s,): whether a box
    lies within 3 pi/4 of its stroke, so that the lemma holds. above, below (s,): greatest excess of alpha
    over theta + pi/4, and below theta - pi/4.
    """

    left: RemainingCells
    pairs: Bools
    strokes: Bools
    above: Floats
    below: Floats

    @property
    def everything(self) -> bool:
        """Whether one convex quadratic bounds the energy on the boxes."""
        return bool(self.pairs.all() and self.strokes.all())

    def least(self, energy: float, over: Over = never) -> tuple[CrossField, float]:
        """The field that minimises the quadratic of the lowest piece, and a lower bound of the energy on all.

        Pieces with a bound of `energy` are not cut.
        """
        lines = np.zeros(len(self.strokes), dtype=np.int32)
        waiting = [(-np.inf, Piece(self.left, self.left.alpha_low, self.left.alpha_high, lines))]
        found: list[tuple[float, CrossField]] = []
        for _ in range(_MOST_PIECES):
            _, piece = waiting.pop()
            field, bound = piece.least(over)
            cut = piece.cut(field) if bound < energy - EXACT / 2 * (1 + energy) else []
            waiting += [(bound, part) for part in cut]
            if not cut:
                found.append((bound, field))
            if not waiting or over():
                break
        best = min(found, key=lambda pair: pair[0], default=(bound, field))
        return best[1], min([best[0], *(bound for bound, _ in waiting)])


@dataclass(frozen=True, eq=False)
class Piece:
    """A part of the boxes, cut at the edges of windows.

    alpha_low, alpha_high (n,). lines (s,): 0 where u carries the stroke, or v beyond an edge that the piece
    crosses; -1 below the window and 1 above it, where v carries the stroke.
    """

    left: RemainingCells
    alpha_low: Floats
    alpha_high: Floats
    lines: Ints

    def least(self, over: Over = never) -> tuple[CrossField, float]:
        """The field that minimises the quadratic on the piece, and a lower bound of the energy there."""
        lattice = self.left.lattice
        instance, n = lattice.instance, lattice.instance.grid.size
        lower = np.concatenate([self.alpha_low, self.left.beta_low])
        upper = np.concatenate([self.alpha_high, self.left.beta_high])
        quadratic = self._quadratic()
        x = least_in_box(quadratic, np.concatenate([lattice.alpha, lattice.beta]), lower, upper, over=over)
        gradient = 2 * quadratic.slope(x)
        field = CrossField(instance, x[:n], x[n:], lattice.p)
        value = field.energy().total - float(self._given(field).sum())
        value += float(np.minimum(gradient * (lower - x), gradient * (upper - x)).sum())
        return field, value - _ROUNDING * (1 + abs(value))

    def cut(self, field: CrossField) -> list[Piece]:
        """The piece cut at both edges of the window of the stroke with the largest deduction.

        Empty if it crosses no edge.
        """
        above, below = self._beyond()
        if not (above + below).any():
            return []
        stroke = int(np.argmax(np.where(above + below > 0, 1e-12 + self._given(field), 0.0)))
        target, at = (
            self.left.lattice.instance.target[stroke],
            self.left.lattice.instance.stroke_index[stroke],
        )
        ends = (-np.inf, target - QUARTER, target + QUARTER, np.inf)
        parts = []
        for line in (-1, 1, 0):
            low, high, lines = self.alpha_low.copy(), self.alpha_high.copy(), self.lines.copy()
            low[at], high[at] = max(low[at], ends[line + 1]), min(high[at], ends[line + 2])
            lines[stroke] = line
            if low[at] <= high[at]:
                parts.append(Piece(self.left, low, high, lines))
        return parts

    def _beyond(self) -> tuple[Floats, Floats]:
        """Distances by which the piece exceeds the windows where u carries the stroke, shapes (s,)."""
        instance = self.left.lattice.instance
        at, u = instance.stroke_index, self.lines == 0
        above = np.maximum(self.alpha_high[at] - instance.target - QUARTER, 0.0)
        below = np.maximum(instance.target - QUARTER - self.alpha_low[at], 0.0)
        return above * u, below * u

    def _given(self, field: CrossField) -> Floats:
        """Difference between Q and the quadratic at each stroke, shape (s,)."""
        instance = field.instance
        at, weight = instance.stroke_index, instance.stroke_coefficient * instance.w
        beta, u = field.beta[at], field.residual_r
        v = field.alpha[at] - HALF * self.lines - beta - instance.target
        above, below = self._beyond()
        tilt = 4 * (above * (beta + QUARTER) + below * (QUARTER - beta))
        given: Floats = weight * np.where(self.lines == 0, tilt, u * u - v * v)
        return given

    def _quadratic(self) -> Quadratic:
        """The quadratic of the piece without its constant."""
        lattice = self.left.lattice
        instance, n = lattice.instance, lattice.instance.grid.size
        energy, at = energy_at(instance, lattice.p), instance.stroke_index
        weight, v = instance.stroke_coefficient * instance.w, self.lines != 0
        above, below = self._beyond()
        vector = energy.vector.copy()
        vector[at] += weight * v * HALF * self.lines
        vector[n + at] += weight * np.where(v, -2 * instance.target - HALF * self.lines, 2 * (above - below))
        places = (np.concatenate([at, at + n]), np.concatenate([at + n, at]))
        turned = sparse.csr_array((np.tile(-2 * weight * v, 2), places), shape=energy.matrix.shape)
        return Quadratic(energy.matrix + turned, vector)


def forced(left: RemainingCells) -> Forced:
    """Choices that are forced on the boxes that are left."""
    lattice = left.lattice
    at, target = lattice.instance.stroke_index, lattice.instance.target
    low, high = left.alpha_low[at] - target, left.alpha_high[at] - target
    return Forced(
        left,
        _best_jumps(left),
        np.maximum(np.abs(low), np.abs(high)) <= 3 * QUARTER,
        np.maximum(high - QUARTER, 0.0),
        np.maximum(-QUARTER - low, 0.0),
    )


def _best_jumps(left: RemainingCells) -> Bools:
    """Whether the centre's jump is a best one on the boxes of each pair, shape (m,)."""
    lattice, (i, j) = left.lattice, (left.lattice.instance.grid.first, left.lattice.instance.grid.second)
    turn, sign = HALF * lattice.p, 1.0 - 2.0 * (lattice.p & 1)
    lowest = left.alpha_low[i] - left.alpha_high[j] + turn
    highest = left.alpha_high[i] - left.alpha_low[j] + turn
    most = np.maximum(np.abs(lowest), np.abs(highest))
    ends = [
        sign * x[i] * y[j] for x in (left.beta_low, left.beta_high) for y in (left.beta_low, left.beta_high)
    ]
    least: Floats = np.min(ends, axis=0)
    forced: Bools = (most <= HALF) & (np.pi * most - np.pi**2 / 4 <= 4 * least)
    return forced
