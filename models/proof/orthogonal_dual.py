"""A dual solution of one level: shares by message passing, and tables on rings.

Sequential tree-reweighted message passing (TRW-S, Kolmogorov 2006) finds the shares of pairs. Rings become
clusters: a block of the dual ascent moves what the pairs of a ring cost together into the pairs. The checker
computes bounds anew from shares and tables, so nothing here has to be exact.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..array_archive import Arrays
from ..instance.domain import Floats
from ..processes.compilation import compiled, compiled_in_any_order
from .check_orthogonal import Level, Problem

Indices = NDArray[np.int64]

_PART_OF_GAP: Final = 0.02  # that rounding the shares and tables may cost
_MOST: Final = 2**31 - 1


class State(NamedTuple):
    """The arrays of a level that compiled functions share, all flat; inf marks what is excluded.

    order, rank: of the points in a pass. around: pairs of each point, from around_start. unary: costs of
    labels, from start. costs: of two labels with all tables, from begin, those of the first end in rows.
    low, high: columns of the first and after the last cost in use of each row. shares of both ends.
    """

    order: Indices
    rank: Indices
    around_start: Indices
    around: Indices
    first: Indices
    second: Indices
    start: Indices
    unary: Floats
    begin: Indices
    costs: Floats
    first_start: Indices
    first_shares: Floats
    second_start: Indices
    second_shares: Floats
    low: Indices
    high: Indices


class RingState(NamedTuple):
    """Rings in use, their steps and the tables of these steps, flat, as pairs have them."""

    start: Indices
    pair: Indices
    sign: Indices
    point: Indices
    begin: Indices
    tables: Floats


class Dual:
    """Shares and tables on a level, which rise to a better bound."""

    def __init__(
        self,
        problem: Problem,
        level: Level,
        costs: tuple[list[Floats], list[Floats]],
        order: Indices,
        rings: list[int],
    ) -> None:
        """Begin with shares and tables of 0. order: of the points in a pass. rings: those in use."""
        m, n = problem.rows.pairs, problem.rows.size
        self.problem, self.level, self.ring_numbers = problem, level, rings
        first, second = (end[:m].astype(np.int64) for end in (problem.rows.first, problem.rows.second))
        counts = np.array([len(labels) for labels in level.labels])
        rank = np.empty(n, dtype=np.int64)
        rank[order] = np.arange(n)
        ends = np.argsort(np.concatenate([first, second]), kind="stable")
        degree = np.bincount(np.concatenate([first, second]), minlength=n)
        sizes = counts[first] * counts[second]
        self.state = State(
            order, rank, starts_of(degree), ends % m if m else ends, first, second,
            starts_of(counts[:-1]), np.concatenate(costs[0][:-1]),
            starts_of(sizes), np.concatenate([cost.ravel() for cost in costs[1]] or [np.zeros(0)]),
            starts_of(counts[first]), np.zeros(counts[first].sum()),
            starts_of(counts[second]), np.zeros(counts[second].sum()),
            np.zeros(counts[first].sum(), dtype=np.int64), np.zeros(counts[first].sum(), dtype=np.int64),
        )  # fmt: skip
        walks = [problem.rings[number] for number in rings]
        pair, sign, point = (_join([walk[part] for walk in walks]) for part in range(3))
        begin = starts_of(sizes[pair])
        lengths = np.array([len(walk[0]) for walk in walks], dtype=np.int64)
        self.rings = RingState(starts_of(lengths), pair, sign, point, begin, np.zeros(begin[-1]))
        self.bound = -np.inf
        _find_hulls(self.state)

    def pass_over(self, most: float, *, forward: bool) -> tuple[float, float]:
        """One pass: the bound, if no tables cost anything, and the share of labels that `most` leaves."""
        bound, left = _pass_over(self.state, most - self.bound, forward)
        self.bound = bound
        return bound, left / len(self.state.unary)

    def update_rings(self, cap: float, *, backward: bool) -> None:
        """Move what rings cost into their pairs, one ring after the other; sums above cap count as cap."""
        numbers = np.arange(len(self.ring_numbers))[:: -1 if backward else 1].copy()
        _update_rings(numbers, self.state, self.rings, cap)

    def interpolate(self, old: Dual) -> None:
        """Take shares and tables from those of a level whose cells contain the cells of this one."""
        where, part = self._places_in(old)
        for new, before in zip(_ends_of(self.state), _ends_of(old.state), strict=True):
            _interpolate_shares(
                self.state.start, old.state.start, old.state.unary, where, part, *new, *before
            )
        step_of = {number: k for k, number in enumerate(old.ring_numbers)}
        for k, number in enumerate(self.ring_numbers):
            if number in step_of:
                _interpolate_tables(
                    k, step_of[number], self.state, self.rings, where, part, old.state, old.rings
                )

    def _places_in(self, old: Dual) -> tuple[Indices, Floats]:
        """Of each label, the old labels below and above in the same point, or -1; and its place between."""
        factor = self.level.divisions // old.level.divisions
        where, part = [], []
        for new, before, half in zip(
            self.level.labels[:-1], old.level.labels, self.problem.half.tolist(), strict=False
        ):
            place = (new - half * (factor // 3)) / factor
            lower = np.floor(place).astype(np.int64)
            sides = []
            for label in (lower, lower + 1):
                at = np.minimum(np.searchsorted(before, label), len(before) - 1)
                sides.append(np.where(before[at] == label, at, -1))
            where.append(np.stack(sides, axis=1))
            part.append(place - lower)
        return np.concatenate(where), np.concatenate(part)

    def arrays(self, gap: float) -> Arrays:
        """Shares and tables as whole multiples of units: the arrays of a certificate, without prefix."""
        arrays: Arrays = {"rings": np.array(self.ring_numbers, dtype=np.int32)}
        parts = {
            "shares": (self.state.first_shares, len(self.state.first)),
            "tables": (self.rings.tables, len(self.rings.pair)),
        }
        for name, (numbers, count) in parts.items():
            unit = _PART_OF_GAP * gap / max(count, 1)
            unit = max(unit, float(np.abs(numbers).max(initial=0.0)) / _MOST, 1e-300)
            arrays[name] = np.round(numbers / unit).astype(np.int32)
            arrays[f"{name}_unit"] = np.array([unit])
        return arrays

    def decode(self, *, forward: bool) -> Floats:
        """The angles (n,) that the shares suggest: after a pass in the other direction."""
        chosen = np.zeros(len(self.state.order), dtype=np.int64)
        _decode(self.state, forward, chosen)
        problem, h = self.problem, np.pi / 2 / self.level.divisions
        label = np.array([labels[x] for labels, x in zip(self.level.labels, chosen, strict=False)])
        angles: Floats = problem.centre[:-1] + h * (label + problem.half[:-1] / 2)
        return angles

    def ring_gaps(self) -> Floats:
        """The cost of the pairs of each ring at the centre beyond their shares, (r,): where the gap lies."""
        at = np.array([int(np.abs(labels).argmin()) for labels in self.level.labels[:-1]])
        state = self.state
        i, j = at[state.first], at[state.second]
        columns = np.diff(state.second_start)
        cost = state.costs[state.begin[:-1] + i * columns + j]
        cost = (
            cost
            - state.first_shares[state.first_start[:-1] + i]
            - state.second_shares[state.second_start[:-1] + j]
        )
        finite = np.where(np.isfinite(cost), cost, 0.0)
        return np.array([finite[walk[0]].sum() for walk in self.problem.rings])


def starts_of(sizes: Any) -> Indices:
    """Where blocks of these sizes begin in a flat array, and its length."""
    return np.concatenate([[0], np.cumsum(sizes, dtype=np.int64)])


def _join(parts: list[list[int]]) -> Indices:
    return np.array([number for part in parts for number in part], dtype=np.int64)


@compiled
def _find_hulls(state: State) -> None:
    """Exclude costs of excluded labels, and fill in the columns that each row uses."""
    for e in range(len(state.first)):
        i, j = state.start[state.first[e]], state.start[state.second[e]]
        rows = state.first_start[e + 1] - state.first_start[e]
        columns = state.second_start[e + 1] - state.second_start[e]
        for x in range(rows):
            low, high, at = columns, 0, state.begin[e] + x * columns
            for y in range(columns):
                if state.unary[i + x] == np.inf or state.unary[j + y] == np.inf:
                    state.costs[at + y] = np.inf
                if state.costs[at + y] < np.inf:
                    low = min(low, y)
                    high = y + 1
            state.low[state.first_start[e] + x] = low
            state.high[state.first_start[e] + x] = high


@compiled_in_any_order
def _send_to_first(costs: Floats, other: Floats, low: Indices, high: Indices, out: Floats) -> None:
    """The least cost less the share of the second point, at each label of the first."""
    columns = len(other)
    for x in range(len(out)):
        least = np.inf
        at = x * columns
        for y in range(low[x], high[x]):
            least = min(least, costs[at + y] - other[y])
        out[x] = least


@compiled_in_any_order
def _send_to_second(costs: Floats, other: Floats, low: Indices, high: Indices, out: Floats) -> None:
    """The least cost less the share of the first point, at each label of the second."""
    columns = len(out)
    for y in range(columns):
        out[y] = np.inf
    for x in range(len(other)):
        at, share = x * columns, other[x]
        for y in range(low[x], high[x]):
            out[y] = min(out[y], costs[at + y] - share)


@compiled
def _pass_over(state: State, spare: float, forward: bool) -> tuple[float, int]:  # noqa: C901, PLR0912
    """A pass over all points; the sum of their least costs, and the labels that cost at most `spare` more."""
    count, total, left = len(state.order), 0.0, 0
    cost = np.empty(np.diff(state.start).max())
    for step in range(count):
        i = state.order[step] if forward else state.order[count - 1 - step]
        begin, size = state.start[i], state.start[i + 1] - state.start[i]
        cost[:size] = state.unary[begin : begin + size]
        earlier, later = 0, 0
        for q in range(state.around_start[i], state.around_start[i + 1]):
            e = state.around[q]
            a = state.first_shares[state.first_start[e] : state.first_start[e + 1]]
            b = state.second_shares[state.second_start[e] : state.second_start[e + 1]]
            is_first = state.first[e] == i
            j = state.second[e] if is_first else state.first[e]
            own = a if is_first else b
            if (state.rank[j] < state.rank[i]) == forward:
                earlier += 1
                rows = slice(state.first_start[e], state.first_start[e + 1])
                costs = state.costs[state.begin[e] : state.begin[e + 1]]
                if is_first:
                    _send_to_first(costs, b, state.low[rows], state.high[rows], own)
                else:
                    _send_to_second(costs, a, state.low[rows], state.high[rows], own)
            else:
                later += 1
            for x in range(size):
                cost[x] += own[x]
                if own[x] == np.inf:
                    own[x] = 0.0
        least = cost[:size].min()
        total += least
        weight = 1.0 / max(earlier, later, 1)
        for x in range(size):
            if cost[x] == np.inf:
                state.unary[begin + x] = np.inf
            left += cost[x] - least <= spare
        for q in range(state.around_start[i], state.around_start[i + 1]):
            e = state.around[q]
            is_first = state.first[e] == i
            j = state.second[e] if is_first else state.first[e]
            if (state.rank[j] < state.rank[i]) != forward:
                at = state.first_start[e] if is_first else state.second_start[e]
                shares = state.first_shares if is_first else state.second_shares
                for x in range(size):
                    if cost[x] < np.inf:
                        shares[at + x] -= weight * (cost[x] - least)
    return total, left


@compiled
def _decode(state: State, forward: bool, chosen: Indices) -> None:
    """Choose a label for each point: of least cost to those that have one, and shares of the others."""
    count = len(state.order)
    cost = np.empty(np.diff(state.start).max())
    for step in range(count):
        i = state.order[step] if forward else state.order[count - 1 - step]
        size = state.start[i + 1] - state.start[i]
        cost[:size] = state.unary[state.start[i] : state.start[i + 1]]
        for q in range(state.around_start[i], state.around_start[i + 1]):
            e = state.around[q]
            is_first = state.first[e] == i
            j = state.second[e] if is_first else state.first[e]
            columns = state.second_start[e + 1] - state.second_start[e]
            for x in range(size):
                if (state.rank[j] < state.rank[i]) == forward:
                    at = x * columns + chosen[j] if is_first else chosen[j] * columns + x
                    cost[x] += state.costs[state.begin[e] + at]
                elif is_first:
                    cost[x] += state.first_shares[state.first_start[e] + x]
                else:
                    cost[x] += state.second_shares[state.second_start[e] + x]
        chosen[i] = cost[:size].argmin()


@compiled
def _update_rings(numbers: Indices, state: State, rings: RingState, cap: float) -> None:
    for number in numbers:
        _update_ring(number, state, rings, cap)


@compiled_in_any_order
def _update_ring(  # noqa: C901, PLR0912, PLR0915 - compiled functions cannot share arrays cheaply
    number: int, state: State, rings: RingState, cap: float
) -> None:
    """Give each pair of a ring an equal part of the least cost of the whole ring at its two labels.

    All steps are first shifted so that no cost is negative: partial sums above cap can then be left out.
    """
    begin, steps = rings.start[number], rings.start[number + 1] - rings.start[number]
    shift = 0
    for k in range(steps):
        i, j = rings.point[begin + k], rings.point[begin + shift]
        if state.start[i + 1] - state.start[i] < state.start[j + 1] - state.start[j]:
            shift = k
    size, at, step = np.empty(steps + 1, np.int64), np.zeros(steps + 1, np.int64), np.empty(steps, np.int64)
    for k in range(steps):
        step[k] = begin + (shift + k) % steps
        i = rings.point[step[k]]
        size[k] = state.start[i + 1] - state.start[i]
    size[steps] = size[0]
    for k in range(steps):
        at[k + 1] = at[k] + size[k] * size[k + 1]
    cost, best, least = np.empty(at[steps]), np.empty(at[steps]), np.empty(steps)
    widest = size.max()
    low, high = np.empty((steps, widest), np.int64), np.empty((steps, widest), np.int64)
    moved = 0.0
    for k in range(steps):
        e, rows, columns = rings.pair[step[k]], size[k], size[k + 1]
        a, b, t, own_table = state.first_start[e], state.second_start[e], state.begin[e], rings.begin[step[k]]
        least[k] = np.inf
        for x in range(rows):
            for y in range(columns):
                if rings.sign[step[k]] > 0:
                    z = x * columns + y
                    own = state.first_shares[a + x] + state.second_shares[b + y]
                else:
                    z = y * rows + x
                    own = state.first_shares[a + y] + state.second_shares[b + x]
                value = state.costs[t + z] - own - rings.tables[own_table + z]
                cost[at[k] + x * columns + y] = value
                least[k] = min(least[k], value)
        if least[k] == np.inf:
            return
        moved += least[k]
        cost[at[k] : at[k + 1]] -= least[k]
    cap = max(cap - moved, 0.0)
    for k in range(steps):
        for x in range(size[k]):
            low[k, x], high[k, x] = size[k + 1], 0
            for y in range(size[k + 1]):
                if cost[at[k] + x * size[k + 1] + y] < cap:
                    low[k, x] = min(low[k, x], y)
                    high[k, x] = y + 1
    best[:] = cap
    ahead, back = np.empty((steps + 1, widest)), np.empty((steps + 1, widest))
    last = steps - 1
    for s in range(size[0]):
        ahead[1, : size[1]] = np.inf
        for y in range(low[0, s], high[0, s]):
            ahead[1, y] = cost[at[0] + s * size[1] + y]
        for k in range(1, last):
            ahead[k + 1, : size[k + 1]] = np.inf
            for x in range(size[k]):
                value, row = ahead[k, x], at[k] + x * size[k + 1]
                if value < cap:
                    for y in range(low[k, x], high[k, x]):
                        ahead[k + 1, y] = min(ahead[k + 1, y], value + cost[row + y])
        for x in range(size[last]):
            back[last, x] = cost[at[last] + x * size[0] + s]
        for k in range(last - 1, 0, -1):
            for x in range(size[k]):
                value, row = np.inf, at[k] + x * size[k + 1]
                if ahead[k, x] < cap:
                    for y in range(low[k, x], high[k, x]):
                        value = min(value, cost[row + y] + back[k + 1, y])
                back[k, x] = value
        for y in range(low[0, s], high[0, s]):
            z = at[0] + s * size[1] + y
            best[z] = min(best[z], cost[z] + back[1, y])
        for x in range(size[last]):
            z = at[last] + x * size[0] + s
            best[z] = min(best[z], ahead[last, x] + cost[z])
        for k in range(1, last):
            for x in range(size[k]):
                value, row = ahead[k, x], at[k] + x * size[k + 1]
                if value + back[k, x] < cap:
                    for y in range(low[k, x], high[k, x]):
                        best[row + y] = min(best[row + y], value + cost[row + y] + back[k + 1, y])
    for k in range(steps):
        e, rows, columns = rings.pair[step[k]], size[k], size[k + 1]
        for x in range(rows):
            for y in range(columns):
                z = x * columns + y if rings.sign[step[k]] > 0 else y * rows + x
                if state.costs[state.begin[e] + z] < np.inf:
                    from_ = at[k] + x * columns + y
                    table = (best[from_] + moved) / steps - cost[from_] - least[k]
                    old = rings.tables[rings.begin[step[k]] + z]
                    state.costs[state.begin[e] + z] += table - old
                    rings.tables[rings.begin[step[k]] + z] = table


def _ends_of(state: State) -> tuple[tuple[Indices, Indices, Floats], tuple[Indices, Indices, Floats]]:
    """Points, first places and shares of both ends of all pairs."""
    first = (state.first, state.first_start, state.first_shares)
    return first, (state.second, state.second_start, state.second_shares)


@compiled
def _interpolate_shares(  # noqa: PLR0917
    start: Indices, old_start: Indices, old_unary: Floats, where: Indices, part: Floats, points: Indices,
    share_start: Indices, shares: Floats, _: Indices, old_share_start: Indices, old_shares: Floats,
) -> None:  # fmt: skip
    """Fill in the shares of one end of all pairs, between those of old labels in use."""
    for e in range(len(points)):
        i = points[e]
        for x in range(start[i + 1] - start[i]):
            at = start[i] + x
            weight, value = 0.0, 0.0
            for side in range(2):
                old, own = where[at, side], part[at] if side else 1 - part[at]
                if old >= 0 and old_unary[old_start[i] + old] < np.inf:
                    weight += own + 1e-12
                    value += (own + 1e-12) * old_shares[old_share_start[e] + old]
            if weight > 0:
                shares[share_start[e] + x] = value / weight


@compiled
def _interpolate_tables(  # noqa: PLR0917
    ring: int, old_ring: int, state: State, rings: RingState, where: Indices, part: Floats, old_state: State,
    old: RingState,
) -> None:  # fmt: skip
    """Fill in the tables of a ring on triangles of old labels: one threshold rounds both ends of a pair."""
    for q in range(rings.start[ring + 1] - rings.start[ring]):
        step, before = rings.start[ring] + q, old.start[old_ring] + q
        e = rings.pair[step]
        i, j = state.start[state.first[e]], state.start[state.second[e]]
        rows = state.first_start[e + 1] - state.first_start[e]
        columns = state.second_start[e + 1] - state.second_start[e]
        old_columns = old_state.second_start[e + 1] - old_state.second_start[e]
        for x in range(rows):
            f = part[i + x]
            for y in range(columns):
                z = state.begin[e] + x * columns + y
                if state.costs[z] == np.inf:
                    continue
                g = part[j + y]
                weight, value = 0.0, 0.0
                for corner in range(3):  # both up, one up, none up
                    if corner == 0:
                        own, up, over = min(f, g), 1, 1
                    elif corner == 1:
                        own, up, over = abs(f - g), int(f > g), int(g > f)
                    else:
                        own, up, over = 1 - max(f, g), 0, 0
                    p, r = where[i + x, up], where[j + y, over]
                    if (
                        p >= 0
                        and r >= 0
                        and old_state.costs[old_state.begin[e] + p * old_columns + r] < np.inf
                    ):
                        weight += own + 1e-12
                        value += (own + 1e-12) * old.tables[old.begin[before] + p * old_columns + r]
                if weight > 0:
                    rings.tables[rings.begin[step] + x * columns + y] = value / weight
                    state.costs[z] += value / weight
