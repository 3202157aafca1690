"""The last step of a proof: a convex problem, where the last boxes leave no choice of jumps.

Sections 6 and 9 of docs/proofs.md state and prove it. The conditions, the boxes and the bound are those of
the checker. This module finds the least energy on the boxes, cuts them at the edges of windows where the
bound is not sufficient, and returns the cuts and multipliers that a certificate contains.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from ..field.field import CrossField, Norm
from ..instance.angles import QUARTER
from ..instance.domain import Floats, Ints
from ..instance.instance import Instance
from ..processes.deadline import Over, never
from ..search.angle_program import solve_angle_program
from ..search.box_qp import field_at
from ..smooth.sparse_systems import stroke_weight
from .check_certificate import (
    BoxPiece,
    EnergyTerms,
    LastStep,
    excess_over_windows,
    last_step,
    linear_bound,
)  # fmt: skip
from .pruning import RemainingCells
from .record import EXACT

_MOST_PIECES: Final = 60
_MOST_CROSSED: Final = 6  # strokes whose windows the boxes exceed; with more, all pieces are too many
_MARGIN: Final = 2e-9  # radians by which the boxes are wider here; those of the checker are wider by less


class BoxMinimum(NamedTuple):
    """The least energy on the last boxes: its field, a bound, and the arrays of a certificate that prove it.

    cuts, multipliers: as docs/files/certificate.csv describes them.
    """

    field: CrossField
    bound: float
    cuts: Ints
    multipliers: Floats


def energy_terms(instance: Instance, norm: Norm) -> EnergyTerms:
    """The terms of the energy as the checker has them."""
    grid, none = instance.grid, np.zeros(instance.grid.size)
    theta = none.copy()
    theta[instance.stroke_index] = instance.target
    white = (grid.rows + grid.columns) % 2 == 1
    strokes = stroke_weight(instance), theta, none, none
    return EnergyTerms(norm, grid.first, grid.second, white, *strokes, instance.skew_coefficient)


def last_step_on(left: RemainingCells, terms: EnergyTerms, field: CrossField) -> LastStep:
    """The last step on the boxes round the cells that are left, with the jumps of a field."""
    beta_low, beta_high = np.maximum(left.beta_low - _MARGIN, -QUARTER), left.beta_high + _MARGIN
    sides = left.alpha_low - _MARGIN, left.alpha_high + _MARGIN, beta_low, np.minimum(beta_high, QUARTER)
    return last_step(terms, np.stack(sides, axis=1), field.alpha, field.p.astype(np.int64))


def minimise_on_boxes(
    instance: Instance, terms: EnergyTerms, step: LastStep, energy: float, over: Over = never
) -> BoxMinimum:
    """Find the least energy on the boxes of a convex last step, and prove a bound of it.

    Pieces with a bound of `energy` are not cut. With too many pieces, the bound is that of the whole boxes.
    """
    whole = step.whole_piece
    whole_minimum = _minimise_on_piece(instance, terms, step, whole)
    waiting, minima, cuts = [whole], list[BoxMinimum](), list[int]()
    few = np.count_nonzero(_deductions(terms, step, whole).sum(axis=0)) <= _MOST_CROSSED
    while waiting and len(cuts) < (_MOST_PIECES if few else 1) and not (cuts and over()):
        piece = waiting.pop()
        minimum = whole_minimum if piece is whole else _minimise_on_piece(instance, terms, step, piece)
        cut = -1
        if minimum.bound < energy - EXACT / 2 * (1 + energy):
            cut = _pixel_to_cut(terms, step, piece, minimum.field.beta)
        cuts.append(cut)
        if cut < 0:
            minima.append(minimum)
        else:
            waiting += reversed(piece.cut(cut, step.theta))
    best = min(minima, key=lambda minimum: minimum.bound, default=whole_minimum)
    if waiting:
        return whole_minimum._replace(field=best.field)
    multipliers = np.concatenate([minimum.multipliers for minimum in minima])
    return BoxMinimum(best.field, best.bound, np.array(cuts, np.int32), multipliers)


def _minimise_on_piece(instance: Instance, terms: EnergyTerms, step: LastStep, piece: BoxPiece) -> BoxMinimum:
    """The least energy on a piece, which is infinite on an empty one."""
    m, n, at, p = len(step.p), len(step.theta), instance.stroke_index, step.p.astype(np.int32)
    low, high = piece.boxes[:, ::2].T.ravel(), piece.boxes[:, 1::2].T.ravel()
    multipliers, cuts = np.zeros((1, 2 * m + 2 * n)), np.full(1, -1, np.int32)
    if (low > high).any():
        return BoxMinimum(field_at(instance, low, p), np.inf, cuts, multipliers)
    above, below = _deductions(terms, step, piece)
    tilt = np.concatenate([np.zeros(n), 4 * (above - below) * (terms.norm != 1)])
    fit = solve_angle_program(
        instance, p, terms.norm, low, high, tilt=tilt, lines=piece.line[at], target=step.theta[at]
    )
    multipliers[0, : 2 * m], multipliers[0, 2 * m + n :] = fit.multipliers[: 2 * m], fit.multipliers[-n:]
    multipliers[0, 2 * m + at] = fit.multipliers[2 * m : -n]
    bound = linear_bound(terms, step, piece, multipliers[0])
    return BoxMinimum(field_at(instance, fit.x, p), bound, cuts, multipliers)


def _deductions(terms: EnergyTerms, step: LastStep, piece: BoxPiece) -> Floats:
    """Weights times the distances by which the piece exceeds windows where u carries the stroke, (2, n)."""
    excess = np.maximum(excess_over_windows(step.theta, piece.boxes), 0.0)
    return np.asarray(excess * terms.weight * (piece.line == 0))


def _pixel_to_cut(terms: EnergyTerms, step: LastStep, piece: BoxPiece, beta: Floats) -> int:
    """The pixel of the stroke with the largest deduction whose window the piece exceeds, or -1."""
    above, below = _deductions(terms, step, piece)
    crossed = above + below > 0
    if not crossed.any():
        return -1
    size = above + below
    if terms.norm != 1:
        size = above * (QUARTER + beta) + below * (QUARTER - beta)
    return int(np.argmax(np.where(crossed, 1e-12 + size, 0.0)))
