"""The last step of a proof: pieces of the last boxes, and a convex problem on each.

Sections 6 and 9 of docs/proofs.md state and prove it. The pieces and their bounds are those of the checker.
This module branches and bounds: it cuts the piece of least bound at a pair whose jump is open, or at the
window of a stroke, finds the least energy on the parts without what is open there, and returns the cuts and
multipliers that a certificate contains.

Where optima lie on both sides of an edge of a window, only cuts close the gap: without them, nine pixels with
contradicting strokes keep one of 0.07 % in the 1-norm.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np

from ...array_archive import Arrays
from ...field.field import CrossField, Norm
from ...instance.angles import HALF, QUARTER
from ...instance.domain import Bools, Floats
from ...instance.instance import Instance
from ...processes.deadline import IsOver, never
from ...search.angle_program import solve_angle_program
from ...search.box_qp import field_at
from ..bound.pruning import RemainingCells
from ..checkers.check_certificate import (
    BoxPiece,
    EnergyTerms,
    LastStep,
    excess_over_windows,
    last_step,
    linear_bound,
    pieces_of,
)
from .record import EXACT

_MOST_NODES: Final = 390  # of the tree of pieces
_MOST_OPEN: Final = 24  # pairs whose jump is open; with more, there would be too many pieces
_SLIGHT: Final = 1e-2  # deduction up to which a stroke counts where its box exceeds the window
_TRIAL: Final = 50  # nodes after which this part of the way to the energy must lie behind the bound
_TRIAL_PART: Final = 0.6
_SECOND: Final = 0.2  # part of the difference between the least costs of two jumps in a pair's rank
_DIGITS: Final = 2.0**40  # per unit of multipliers: fewer digits take less space, and lose some 1e-10
_MARGIN: Final = 2e-9  # radians by which the boxes are wider here; those of the checker are wider by less


class BoxMinimum(NamedTuple):
    """The least energy on the last boxes: its field, a bound, and the arrays of a certificate that prove it.

    pieces: cuts and multipliers, as docs/files/certificate.csv describes them.
    """

    field: CrossField
    bound: float
    pieces: Arrays


def energy_terms(instance: Instance, norm: Norm) -> EnergyTerms:
    """The terms of the energy as the checker has them."""
    grid, none = instance.grid, np.zeros(instance.grid.size)
    theta = none.copy()
    theta[instance.stroke_index] = instance.target
    white = (grid.rows + grid.columns) % 2 == 1
    strokes = instance.point_weight, theta, none, none
    return EnergyTerms(norm, grid.first, grid.second, white, *strokes, instance.skew_coefficient)


def last_step_on(left: RemainingCells, terms: EnergyTerms, field: CrossField) -> LastStep:
    """The last step on the boxes round the cells that are left, with the jumps of a field."""
    boxes = left.boxes + np.array([-_MARGIN, _MARGIN, -_MARGIN, _MARGIN])
    boxes[:, 2:] = np.clip(boxes[:, 2:], -QUARTER, QUARTER)
    return last_step(terms, boxes, field.alpha, field.p.astype(np.int64))


def has_few_open(terms: EnergyTerms, step: LastStep) -> bool:
    """Whether so few jumps are open in the boxes that the last step may prove something.

    With absolute values, none may be open: pieces would prove optima in boxes that are still whole windows,
    and a certificate would narrow none.
    """
    most = _MOST_OPEN if terms.norm == 2 else 0
    return int((~step.whole_piece.has_known_jump(terms)).sum()) <= most


def fit_to_boxes(
    instance: Instance, terms: EnergyTerms, step: LastStep, pieces: Arrays, enough: float
) -> Arrays:
    """The pieces of slightly larger boxes, with new multipliers where theirs prove less than `enough`.

    Raises NotProvenError where the pieces do not cover these boxes.
    """
    multipliers = pieces["multipliers"].copy()
    for row, piece in zip(multipliers, pieces_of(terms, step, pieces["cuts"].tolist()), strict=True):
        if linear_bound(terms, step, piece, row) < enough:
            row[:] = _minimise_on_piece(instance, terms, step, piece).multipliers
    return {"cuts": pieces["cuts"], "multipliers": multipliers}


@dataclass(eq=False)
class _Node:
    """A piece with its minimum and, once it is cut, its cut and parts."""

    piece: BoxPiece
    minimum: _PieceMinimum
    cut: int = -1
    parts: list[_Node] = field(default_factory=list)

    def __lt__(self, other: _Node) -> bool:
        return self.minimum.bound < other.minimum.bound

    def numbers(self, terms: EnergyTerms) -> list[int]:
        """Its numbers in the cuts of a certificate."""
        e, ends = self.cut - len(terms.white), [part.piece for part in (*self.parts[:1], *self.parts[-1:])]
        return [self.cut] if e < 0 else [self.cut, *(int(piece.p[e]) for piece in ends)]

    def in_order(self) -> Iterator[_Node]:
        """The node and all below, each before its parts."""
        yield self
        for part in self.parts:
            yield from part.in_order()


def minimise_on_boxes(
    instance: Instance, terms: EnergyTerms, step: LastStep, energy: float, is_over: IsOver = never
) -> BoxMinimum:
    """Find the least energy on the boxes of a last step, and prove a bound of it.

    Pieces with a bound of `energy` are not cut.
    """
    whole = step.whole_piece
    root = _Node(whole, _minimise_on_piece(instance, terms, step, whole))
    waiting, count, enough = [root], 1, energy - EXACT / 2 * (1 + energy)
    hoped = root.minimum.bound + _TRIAL_PART * (energy - root.minimum.bound)
    while waiting[0].minimum.bound < enough and count < _MOST_NODES and not (count > 1 and is_over()):
        node = waiting[0]
        node.cut = _find_cut(terms, step, node.piece, node.minimum.x)
        if node.cut < 0:
            break
        heapq.heappop(waiting)
        for piece in _parts(terms, step, node):
            node.parts.append(_Node(piece, _minimise_on_piece(instance, terms, step, piece)))
            heapq.heappush(waiting, node.parts[-1])
        count += len(node.parts)
        if count - len(node.parts) < _TRIAL <= count and waiting[0].minimum.bound < hoped:
            break
    least = waiting[0]
    nodes = list(root.in_order())
    return BoxMinimum(
        field_at(instance, least.minimum.x, least.piece.p.astype(np.int32)),
        least.minimum.bound,
        {
            "cuts": np.array([number for node in nodes for number in node.numbers(terms)], np.int32),
            "multipliers": np.stack([node.minimum.multipliers for node in nodes if node.cut < 0]),
        },
    )


def _parts(terms: EnergyTerms, step: LastStep, node: _Node) -> list[BoxPiece]:
    """The parts of the piece of a node."""
    e = node.cut - len(terms.white)
    if e < 0:
        return [node.piece.beside_window(node.cut, side, step.theta) for side in (-1, 0, 1)]
    jumps = node.piece.possible_jumps(e, terms) or [int(node.piece.p[e])]  # where no field is: an empty part
    return [node.piece.with_jump(e, p, terms) for p in range(jumps[0], jumps[-1] + 1)]


class _PieceMinimum(NamedTuple):
    """Angles x (2n,) with the least energy in a piece, its bound, and their multipliers (2m + 2n,)."""

    x: Floats
    bound: float
    multipliers: Floats


def _minimise_on_piece(
    instance: Instance, terms: EnergyTerms, step: LastStep, piece: BoxPiece
) -> _PieceMinimum:
    """The least energy on a piece, which is infinite on an empty one."""
    m, n, at, p = len(step.p), len(step.theta), instance.stroke_index, piece.p.astype(np.int32)
    low, high = piece.boxes[:, ::2].T.ravel(), piece.boxes[:, 1::2].T.ravel()
    multipliers = np.zeros(2 * m + 2 * n)
    if piece.is_empty:
        return _PieceMinimum(low, np.inf, multipliers)
    of_a, of_b, of_r, of_beta = piece.weights(terms, step.theta)
    above, below = _deductions(terms, step, piece)
    counts = _counts(terms, step, piece)
    tilt = np.concatenate([np.zeros(n), 4 * (above - below) * counts * (terms.norm != 1)])
    x, fitted = solve_angle_program(
        instance, p, terms.norm, low, high, tilt=tilt, lines=piece.line[at], target=step.theta[at],
        weight=np.concatenate([of_a, of_b, (of_r * counts)[at], of_beta]),
    )  # fmt: skip
    multipliers[: 2 * m], multipliers[2 * m + n :] = fitted[: 2 * m], fitted[-n:]
    multipliers[2 * m + at] = fitted[2 * m : -n]
    multipliers = np.round(multipliers * _DIGITS) / _DIGITS
    return _PieceMinimum(x, linear_bound(terms, step, piece, multipliers), multipliers)


def _deductions(terms: EnergyTerms, step: LastStep, piece: BoxPiece) -> Floats:
    """Weights times the distances by which the piece exceeds windows where u carries the stroke, (2, n)."""
    excess = np.maximum(excess_over_windows(step.theta, piece.boxes), 0.0)
    return np.asarray(excess * terms.weight * (piece.line == 0))


def _counts(terms: EnergyTerms, step: LastStep, piece: BoxPiece) -> Bools:
    """Which strokes (n,) count: those with a slight deduction at most."""
    return np.asarray(np.pi * _deductions(terms, step, piece).sum(axis=0) <= _SLIGHT)


def _find_cut(terms: EnergyTerms, step: LastStep, piece: BoxPiece, x: Floats) -> int:
    """The pixel or n + the pair that costs most at the angles x beyond what counts, or -1 without any."""
    n = len(step.theta)
    alpha, beta = np.split(x, 2)
    costs, best, rank = _stroke_losses(terms, step, piece, alpha, beta), -1, 0.0
    if costs.max(initial=0.0) > 0:
        best, rank = int(np.argmax(costs)), float(costs.max())
    for e in np.flatnonzero(~piece.has_known_jump(terms)).tolist():
        i, j = terms.first[e], terms.second[e]
        sizes = sorted(
            _size(alpha[i] - alpha[j] + HALF * p, terms.squared[0])
            + _size((1 - 2 * (p % 2)) * beta[i] - beta[j], terms.squared[0])
            for p in piece.possible_jumps(e, terms)
        )
        lost = 2 * (sizes[0] + _SECOND * (sizes[1] - sizes[0])) if len(sizes) > 1 else np.inf
        if lost > rank:
            best, rank = n + e, lost
    return best


def _stroke_losses(
    terms: EnergyTerms, step: LastStep, piece: BoxPiece, alpha: Floats, beta: Floats
) -> Floats:
    """Loss at each stroke (n,) whose window the piece exceeds: its whole term or a deduction."""
    above, below = _deductions(terms, step, piece)
    away, size = alpha - step.theta, above + below
    if terms.norm != 1:
        size = above * 4 * (QUARTER + beta) + below * 4 * (QUARTER - beta)
    lines = (away + beta, away - HALF - beta, away + HALF - beta)
    whole = terms.weight * np.min([_size(line, terms.squared[2]) for line in lines], axis=0)
    open_here = (above + below > 0) | (piece.weights(terms, step.theta)[2] < terms.weight)
    return np.asarray(np.where(open_here, 1e-12 + np.where(_counts(terms, step, piece), size, whole), 0.0))


def _size(residual: Any, squared: bool) -> Any:
    return residual * residual if squared else np.abs(residual)
