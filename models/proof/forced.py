"""The convex quadratic that remains when no choice of jumps and lines is left.

models/proof/check_certificate.py, 4, proves when the jumps of the centre are best on the boxes, and that a
convex quadratic bounds the energy there: the energy at these jumps with line u at every stroke (`qp-fixed`),
less terms linear in beta at strokes whose box exceeds the window. If the loss is too large, boxes are cut at
the edges of the window. Beyond them, v carries the stroke.

The least value of that quadratic on the boxes is bounded from its gradient g at any point x: by its value
there + the least of g (y - x) over y in the boxes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, NamedTuple, Self

import numpy as np
from scipy import sparse

from ..field.field import CrossField
from ..instance.angles import HALF, QUARTER
from ..instance.grid import Bools, Floats, Ints
from ..instance.terms import parity_sign
from ..processes.deadline import Over, never
from ..search.box_qp import field_at, minimise_in_box
from ..search.energy import QuadraticForm, energy_at
from ..smooth.systems import stroke_weight
from .check_certificate import convex_error
from .pruning import RemainingCells
from .record import EXACT

_MOST_PIECES: Final = 60
_MOST_CROSSED: Final = 6  # strokes whose windows the boxes exceed; with more, all pieces are too many
MARGIN: Final = 2e-9  # radians by which conditions hold here, as the checker's boxes are wider by less
_ROUNDING: Final = 1e-10  # deduction from a bound, relative to 1 + its value: float64 loses some 1e-12 in it


class Least(NamedTuple):
    """The least energy on the boxes: its field, and a bound.

    Where pairs count with absolute values, multipliers (pieces, r) prove it, of each piece that stays whole;
    see models/search/absolute_fit.py. cuts: for each piece, in the order of the search, the stroke where it
    is cut into three parts, or -1 if it stays whole.
    """

    field: CrossField
    bound: float
    multipliers: Floats | None = None
    cuts: tuple[int, ...] = (-1,)


@dataclass(frozen=True, eq=False)
class Forced:
    """Choices that the boxes force.

    pairs (m,): whether the jump of the centre is a best one on the whole box. strokes (s,): whether a box
    lies so close to its stroke that the lemma holds. target (s,): the direction of each stroke at one turn.
    """

    left: RemainingCells
    pairs: Bools
    strokes: Bools
    target: Floats

    @property
    def everything(self) -> bool:
        """Whether one convex quadratic bounds the energy on the boxes."""
        return bool(self.pairs.all() and self.strokes.all())

    @property
    def open_pixels(self) -> Bools:
        """Pixels where something is not forced; if all is, those whose box exceeds a window; shape (n,)."""
        instance = self.left.lattice.instance
        grid, found = instance.grid, np.zeros(instance.grid.size, dtype=bool)
        for pixels in (grid.first[~self.pairs], grid.second[~self.pairs]):
            found[pixels] = True
        found[instance.stroke_index[~self.strokes]] = True
        if self.everything:
            found[instance.stroke_index] = np.add(*self.whole.beyond) > 0
        return found

    @property
    def whole(self) -> Piece:
        """The boxes as one piece."""
        at = self.left.lattice.instance.stroke_index
        above = self.left.alpha_low[at] - self.target >= QUARTER
        below = self.target - self.left.alpha_high[at] >= QUARTER
        return Piece(self.left, above.astype(np.int32) - below, self.target)

    def least(self, energy: float, over: Over = never) -> Least:
        """The minimum of the lowest piece, and a bound of all; pieces with a bound of `energy` stay whole.

        Where multipliers have to prove it, the bound is that of the whole boxes if pieces are missing.
        """
        waiting: list[tuple[float, Piece | None]] = [(-np.inf, self.whole)]
        found, whole, cuts = list[Least](), list[Least | None](), list[int]()
        few = np.count_nonzero(np.add(*self.whole.beyond)) <= _MOST_CROSSED
        while waiting and len(found) < (_MOST_PIECES if few else 1) and not (found and over()):
            _, piece = waiting.pop()
            cuts.append(-1)
            if piece is None:
                whole.append(None)
                continue
            found.append(piece.least(over))
            if found[-1].bound < energy - EXACT / 2 * (1 + energy):
                cuts[-1] = piece.crossed(found[-1].field)
            if cuts[-1] < 0:
                whole.append(found[-1])
            else:
                waiting += [(found[-1].bound, part) for part in reversed(piece.cut(cuts[-1]))]
        best = min(filter(None, whole), key=lambda each: each.bound, default=found[-1])
        first = found[0].multipliers
        if first is None:
            return Least(best.field, min([best.bound, *(bound for bound, part in waiting if part)]))
        if waiting:
            return found[0]._replace(field=best.field)
        of_pieces = [first * 0.0 if each is None else np.asarray(each.multipliers) for each in whole]
        return Least(best.field, best.bound, np.stack(of_pieces), tuple(cuts))


@dataclass(frozen=True, eq=False)
class Piece:
    """A part of the boxes, cut at the edges of windows.

    lines (s,): 0 where u carries the stroke, or v beyond an edge that the piece crosses; -1 below the window
    and 1 above it, where v carries the stroke. target (s,): as of `Forced`.
    """

    left: RemainingCells
    lines: Ints
    target: Floats

    def least(self, over: Over = never) -> Least:
        """The field that minimises the quadratic on the piece, and a lower bound of the energy there."""
        lattice = self.left.lattice
        (lower, upper), quadratic = self.left.bounds, self._quadratic()
        x = minimise_in_box(quadratic, np.concatenate([lattice.alpha, lattice.beta]), lower, upper, over=over)
        gradient = 2 * quadratic.slope(x)
        field = field_at(lattice.instance, x, lattice.p)
        value = field.energy().total - float(self._given(field).sum())
        bound = value + float(np.minimum(gradient * (lower - x), gradient * (upper - x)).sum())
        return Least(field, bound - _ROUNDING * (1 + abs(bound)) - self._error(field, upper - lower))

    def _error(self, field: CrossField, far: Floats) -> float:
        """Margin that the checker takes off the bound for rounding, or a little more."""
        instance, at = field.instance, field.instance.stroke_index
        weight, skew = stroke_weight(instance), instance.skew_coefficient
        angles, goal = np.concatenate([field.alpha, field.beta]), self.target + HALF * self.lines
        r = field.alpha[at] + np.where(self.lines == 0, 1, -1) * field.beta[at] - goal
        sizes = (
            skew * np.abs(field.beta).sum() + np.abs(field.residual_a).sum() + np.abs(field.residual_b).sum()
        )
        sizes += weight[at] @ (np.abs(r) + 4 * np.add(*self.beyond))
        terms = field.energy().total + float(sizes)
        return convex_error(weight, skew, (angles, goal, self.left.lattice.p), terms, far)

    def crossed(self, field: CrossField) -> int:
        """The stroke with the largest deduction whose window the piece exceeds, or -1."""
        above, below = self.beyond
        if not (above + below).any():
            return -1
        return int(np.argmax(np.where(above + below > 0, 1e-12 + self._given(field), 0.0)))

    def cut(self, stroke: int) -> list[Self | None]:
        """The parts below, in and above the window of a stroke, None for an empty one."""
        instance, left = self.left.lattice.instance, self.left
        target, at = self.target[stroke], instance.stroke_index[stroke]
        ends = (-np.inf, target - QUARTER, target + QUARTER, np.inf)
        parts: list[Self | None] = []
        for line in (-1, 0, 1):
            low, high, lines = left.alpha_low.copy(), left.alpha_high.copy(), self.lines.copy()
            high[at] = min(high[at], ends[line + 2])
            low[at] = max(low[at], ends[line + 1])
            lines[stroke] = line
            # A part that is empty here by less may not be empty for the checker.
            if low[at] > high[at] + MARGIN:
                parts.append(None)
                continue
            low[at] = min(low[at], high[at])
            parts.append(replace(self, left=replace(left, alpha_low=low, alpha_high=high), lines=lines))
        return parts

    @property
    def beyond(self) -> tuple[Floats, Floats]:
        """Distances by which the piece exceeds the windows where u carries the stroke, shapes (s,)."""
        instance = self.left.lattice.instance
        at, u = instance.stroke_index, self.lines == 0
        above = np.maximum(self.left.alpha_high[at] - self.target - QUARTER, 0.0)
        below = np.maximum(self.target - QUARTER - self.left.alpha_low[at], 0.0)
        return above * u, below * u

    def _given(self, field: CrossField) -> Floats:
        """Difference between the energy and the quadratic at each stroke, shape (s,)."""
        instance = field.instance
        at, weight = instance.stroke_index, instance.stroke_coefficient * instance.w
        alpha, beta, counted = field.alpha[at], field.beta[at], field.residual_r
        u, v = alpha + beta - self.target, alpha - HALF * self.lines - beta - self.target
        above, below = self.beyond
        tilt = 4 * (above * (beta + QUARTER) + below * (QUARTER - beta))
        given: Floats = weight * (counted * counted - np.where(self.lines == 0, u * u - tilt, v * v))
        return given

    def _quadratic(self) -> QuadraticForm:
        """The quadratic of the piece without its constant."""
        lattice = self.left.lattice
        instance, n = lattice.instance, lattice.instance.grid.size
        energy, at = energy_at(instance, lattice.p), instance.stroke_index
        weight, v = instance.stroke_coefficient * instance.w, self.lines != 0
        above, below = self.beyond
        vector, turned = energy.vector.copy(), self.target - instance.target
        vector[at] += weight * (turned + HALF * self.lines)
        of_v = -2 * instance.target - turned - HALF * self.lines
        vector[n + at] += weight * np.where(v, of_v, turned + 2 * (above - below))
        places = (np.concatenate([at, at + n]), np.concatenate([at + n, at]))
        swapped = sparse.csr_array((np.tile(-2 * weight * v, 2), places), shape=energy.matrix.shape)
        return QuadraticForm(energy.matrix + swapped, vector)


def forced(left: RemainingCells, target: Floats | None = None) -> Forced:
    """Choices that are forced on the boxes that are left. target (s,): as of `Forced`; None: as the gauge."""
    instance = left.lattice.instance
    at, target = instance.stroke_index, instance.target if target is None else target
    away = np.maximum(np.abs(left.alpha_low[at] - target), np.abs(left.alpha_high[at] - target))
    most, products = at_pairs(left)
    pairs = (most <= HALF - MARGIN) & (np.pi * (most + MARGIN) - np.pi**2 / 4 <= 4 * products.min(axis=0))
    return Forced(left, pairs, away <= 3 * QUARTER - MARGIN, target)


def at_pairs(left: RemainingCells) -> tuple[Floats, Floats]:
    """Greatest |A| on the boxes of each pair, (m,), and (-1)^p beta_i beta_j at their corners, (4, m)."""
    terms, p, betas = left.lattice.instance.pair_terms, left.lattice.p, (left.beta_low, left.beta_high)
    lowest, highest = terms.range_a(left.alpha_low, left.alpha_high, p)
    products = np.array([parity_sign(p) * x[terms.first] * y[terms.second] for x in betas for y in betas])
    return np.maximum(np.abs(lowest), np.abs(highest)), products
