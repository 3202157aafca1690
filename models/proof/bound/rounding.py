"""Fields from a dual solution: pixel by pixel the label of least estimated cost, then improved.

In the order of a pass, each pixel takes the label of least D + cost to the neighbours that have their label +
shares of the neighbours that have none (Kolmogorov 2006, 5).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from ...field.field import CrossField, field_in_windows
from ...field.jumps import free_jumps
from ...instance.angles import HALF, QUARTER
from ...instance.domain import Bools, Floats
from ...instance.sparse_systems import SimilarSystems
from ...processes.compilation import compiled, inlined
from ...processes.deadline import IsOver, never
from ...search.box_qp import FreeField
from ...search.improvement import improved_field, settle
from .dual import Dual
from .passes import add_to, least_a, shares_at, size_of
from .state import Indices, State

_BETTER: Final = 1e-9  # relative: rounding is no improvement

BetterField = Callable[[CrossField, CrossField, IsOver], CrossField]
"""Returns the better of a rounded field and the best one so far, improved."""


class Rounding:
    """Rounds fields from a dual, each set of jumps once."""

    def __init__(self, dual: Dual, better_field: BetterField) -> None:
        self._dual, self._better_field = dual, better_field
        self._tried: set[bytes] = set()

    def lower(self, best: CrossField, is_over: IsOver = never) -> CrossField:
        """`best`, or a lower field that the shares suggest; before and after it the last pass is backward."""
        best = self._round_dual(best, is_over, forwards=True)
        if is_over():
            return best
        self._dual.forward()
        best = self._round_dual(best, is_over, forwards=False)
        self._dual.backward()
        return best

    def _round_dual(self, best: CrossField, is_over: IsOver, *, forwards: bool) -> CrossField:
        instance = best.instance
        alpha, beta = decode(self._dual.state, forwards=forwards)
        rounded = field_in_windows(instance, alpha, beta, free_jumps(instance, alpha, beta)[0])
        jumps = rounded.p.tobytes()
        if jumps in self._tried:
            return best
        self._tried.add(jumps)
        return self._better_field(rounded, best, is_over)


def better_field(rounded: CrossField, best: CrossField, is_over: IsOver) -> CrossField:
    """The field of lower 2-norm energy: the best field, or the new one, improved where that may pay."""
    state = FreeField.of(rounded)
    settle(state, SimilarSystems(), is_over)
    if state.energy >= best.energy().total * (1 - _BETTER):
        return best
    return min(
        best,
        improved_field(state.fit_in_bounds(is_over), stop=is_over),
        key=lambda field: field.energy().total,
    )


def decode(state: State, *, forwards: bool) -> tuple[Floats, Floats]:
    """Alpha and beta (n,) of the crosses that the shares suggest; forwards after a backward pass."""
    size = len(state.least)
    order = np.arange(size)[:: 1 if forwards else -1].copy()
    alpha, beta = np.zeros((2, size))
    _decode(order, state, alpha, beta, np.zeros(size, dtype=bool))
    return alpha, np.clip(beta, -QUARTER, QUARTER)


@compiled
def _decode(order: Indices, state: State, alpha: Floats, beta: Floats, fixed: Bools) -> None:
    """Fill in the angles, pixel by pixel in that order. fixed: the pixels that have theirs."""
    for i in order:
        cost = state.unary[state.pixels[i].start : state.pixels[i + 1].start].copy()
        for column in range(4):
            pair = state.around[i, column]
            if pair < 0:
                continue
            j = state.pairs[pair].first + state.pairs[pair].second - i
            if fixed[j]:
                _add_distance(i, state, alpha[j], beta[j], cost)
            else:
                add_to(cost, shares_at(pair, i, state))
        x = 0
        for label in range(1, cost.size):
            if cost[label] < cost[x]:
                x = label
        alpha[i] = state.pixels[i].alpha + state.h * (x // state.pixels[i].beta_count)
        beta[i] = state.pixels[i].beta + state.h * (x % state.pixels[i].beta_count)
        fixed[i] = True


@inlined
def _add_distance(i: int, state: State, alpha: float, beta: float, cost: Floats) -> None:
    """Add the cost of a pair of pixel i with a fixed cross."""
    columns = state.pixels[i].beta_count
    for row in range(state.pixels[i].alpha_count):
        even = state.pixels[i].alpha + state.h * row - alpha
        even, odd = least_a(even), least_a(even + HALF)
        for column in range(columns):
            mine = state.pixels[i].beta + state.h * column
            with_even = size_of(even, state.power) + size_of(mine - beta, state.power)
            with_odd = size_of(odd, state.power) + size_of(mine + beta, state.power)
            cost[row * columns + column] += 2 * min(with_even, with_odd)
