"""The convex problem that remains when no choice of jumps and lines is left.

Sections 6 and 9 of docs/proofs.md prove when the jumps of the centre are best on the boxes, and that a
convex problem bounds the energy there: the energy at these jumps with line u at every stroke (`qp-fixed`),
less terms linear in beta at strokes whose box exceeds the window. If the loss is too large, boxes are cut at
the edges of the window. Beyond them, v carries the stroke. Multipliers of its residuals bound its least
value.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, NamedTuple, Self

import numpy as np

from ..field.field import CrossField
from ..instance.angles import HALF, QUARTER
from ..instance.grid import Bools, Floats, Ints
from ..instance.terms import parity_sign
from ..processes.deadline import Over, never
from ..search.absolute_fit import absolute_fit
from ..search.box_qp import field_at
from .check_certificate import LastStep
from .lattice import Lattice
from .pruning import RemainingCells
from .record import EXACT

_MOST_PIECES: Final = 60
_MOST_CROSSED: Final = 6  # strokes whose windows the boxes exceed; with more, all pieces are too many
MARGIN: Final = 2e-9  # radians by which conditions hold here, as the checker's boxes are wider by less
_BEYOND: Final = 1e-12  # radians by which a box exceeds a window, as in the checker


class Least(NamedTuple):
    """The least energy on the boxes: its field, a bound, and the multipliers that prove it.

    multipliers: (r,) of a piece, (pieces, r) of all that stay whole; see models/search/absolute_fit.py. cuts:
    for each piece, in the order of the search, the stroke where it is cut into three parts, or -1 if it stays
    whole.
    """

    field: CrossField
    bound: float
    multipliers: Floats
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
    def whole(self) -> Piece:
        """The boxes as one piece."""
        at = self.left.lattice.instance.stroke_index
        above = self.left.alpha_low[at] - self.target - QUARTER > _BEYOND
        below = self.target - self.left.alpha_high[at] - QUARTER > _BEYOND
        return Piece(self.left, above.astype(np.int32) - below, self.target)

    def least(self, energy: float, over: Over = never) -> Least:
        """The minimum of the lowest piece, and a bound of all; pieces with a bound of `energy` stay whole.

        The bound is that of the whole boxes if pieces are missing.
        """
        waiting: list[Piece | None] = [self.whole]
        found, whole, cuts = list[Least](), list[Least | None](), list[int]()
        few = np.count_nonzero(np.add(*self.whole.beyond)) <= _MOST_CROSSED
        while waiting and len(found) < (_MOST_PIECES if few else 1) and not (found and over()):
            piece = waiting.pop()
            cuts.append(-1)
            if piece is None:
                whole.append(None)
                continue
            found.append(piece.least())
            if found[-1].bound < energy - EXACT / 2 * (1 + energy):
                cuts[-1] = piece.crossed(found[-1].field)
            if cuts[-1] < 0:
                whole.append(found[-1])
            else:
                waiting += reversed(piece.cut(cuts[-1]))
        best = min(filter(None, whole), key=lambda each: each.bound, default=found[-1])
        if waiting:
            return found[0]._replace(field=best.field, multipliers=found[0].multipliers[None])
        of_pieces = [np.zeros_like(best.multipliers) if each is None else each.multipliers for each in whole]
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

    def least(self) -> Least:
        """The field that minimises the convex problem on the piece, and a lower bound of the energy there."""
        lattice, (above, below) = self.left.lattice, self.beyond
        instance, weight = lattice.instance, lattice.instance.stroke_terms.weight
        tilt, constant = np.zeros(2 * instance.grid.size), 2 * float(weight @ (above + below))
        if lattice.norm != 1:
            tilt[instance.grid.size + instance.stroke_index] = 4 * weight * (above - below)
            constant *= HALF
        fit = absolute_fit(
            instance, lattice.p, lattice.norm, *self.left.bounds,
            tilt=tilt, lines=self.lines, target=self.target,
        )  # fmt: skip
        return Least(field_at(instance, fit.x, lattice.p), fit.bound - constant, fit.multipliers)

    def crossed(self, field: CrossField) -> int:
        """The stroke with the largest deduction whose window the piece exceeds, or -1."""
        (above, below), instance = self.beyond, field.instance
        if not (above + below).any():
            return -1
        beta = field.beta[instance.stroke_index]
        away = above + below
        if self.left.lattice.norm != 1:
            away = above * (QUARTER + beta) + below * (QUARTER - beta)
        return int(np.argmax(np.where(above + below > 0, 1e-12 + instance.stroke_terms.weight * away, 0.0)))

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


def last_step_pieces(first: Lattice, step: LastStep, energy: float) -> tuple[Ints, Floats]:
    """The cuts and multipliers of a certificate for a last step of the checker; see docs/files.md.

    first: any lattice of the proof. energy: at which a bound is sufficient.
    """
    instance, (low, high) = first.instance, (step.boxes[:, ::2].T, step.boxes[:, 1::2].T)
    middle = (low + high) / 2
    lattice = replace(first, alpha=middle[0], beta=middle[1], p=step.p.astype(np.int32))
    left = RemainingCells(lattice, first.allowed, low[0], high[0], low[1], high[1])
    pairs, strokes = np.ones(len(step.p), bool), np.ones(len(instance.theta), bool)
    least = Forced(left, pairs, strokes, step.theta[instance.stroke_index]).least(energy)
    at, cuts = instance.stroke_index, np.array(least.cuts, np.int32)
    m, s, n = len(step.p), len(at), instance.grid.size
    multipliers = np.zeros((len(least.multipliers), 2 * m + 2 * n))
    multipliers[:, : 2 * m] = least.multipliers[:, : 2 * m]
    multipliers[:, 2 * m + at] = least.multipliers[:, 2 * m : 2 * m + s]
    multipliers[:, 2 * m + n :] = least.multipliers[:, 2 * m + s :]
    return np.where(cuts < 0, -1, at[cuts]).astype(np.int32), multipliers


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
