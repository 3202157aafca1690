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
from ..instance.domain import Bools, Floats
from ..processes.compilation import compiled, compiled_in_any_order
from .check_orthogonal import CellLevel, CentredRows, Costs

Indices = NDArray[np.int64]

_PART_OF_GAP: Final = 0.02  # that rounding the shares and tables may cost
_MOST: Final = 2**31 - 1


class DualArrays(NamedTuple):
    """The arrays of a level that compiled functions share, all flat; inf marks what is excluded.

    Pair e has the slots 2 e and 2 e + 1, of its first and its second point.

    order, rank: of the points in a pass. point: of each slot. around: slots of each point, from around_start.
    unary: costs of labels, from start. costs: of two labels with all tables, from begin, those of the first
    point in rows. shares: of the point of each slot, from share_start. low, high: columns of the first and
    after the last cost in use of each row, at the shares of the first point.
    """

    order: Indices
    rank: Indices
    point: Indices
    around_start: Indices
    around: Indices
    start: Indices
    unary: Floats
    begin: Indices
    costs: Floats
    share_start: Indices
    shares: Floats
    low: Indices
    high: Indices


class RingArrays(NamedTuple):
    """Rings in use, their steps and the tables of these steps, flat, as pairs have them."""

    start: Indices
    pair: Indices
    sign: Indices
    point: Indices
    begin: Indices
    tables: Floats


class RingDual:
    """Shares and tables on a level, which rise to a better bound."""

    def __init__(
        self, rows: CentredRows, level: CellLevel, costs: Costs, order: Indices, rings: list[int]
    ) -> None:
        """Begin with shares and tables of 0. order: of the points in a pass. rings: those in use."""
        self.rows, self.level, self.ring_numbers, self.bound = rows, level, rings, -np.inf
        point = np.column_stack([rows.first, rows.second])[: rows.pairs].ravel().astype(np.int64)
        counts = np.array([len(labels) for labels in level.labels])
        sizes, share_start = counts[point].reshape(-1, 2).prod(axis=1), starts_of(counts[point])
        windows = np.zeros((2, share_start[-1]), dtype=np.int64)
        for e, cost in enumerate(costs[1]):
            used = np.isfinite(cost)
            ends = used.argmax(axis=1), cost.shape[1] - used[:, ::-1].argmax(axis=1)
            windows[:, share_start[2 * e] : share_start[2 * e + 1]] = ends
        self.state = DualArrays(
            order, np.argsort(order), point,
            starts_of(np.bincount(point, minlength=rows.size)), np.argsort(point, kind="stable"),
            starts_of(counts[:-1]), np.concatenate(costs[0][:-1]),
            starts_of(sizes), _join([cost.ravel() for cost in costs[1]], np.float64),
            share_start, np.zeros(share_start[-1]), *windows,
        )  # fmt: skip
        pair, sign, on_ring = (
            _join([rows.rings[ring][part] for ring in rings], np.int64) for part in range(3)
        )
        begin, lengths = starts_of(sizes[pair]), [len(rows.rings[ring][0]) for ring in rings]
        self.rings = RingArrays(starts_of(lengths), pair, sign, on_ring, begin, np.zeros(begin[-1]))

    def pass_over(self, most: float, *, forward: bool) -> tuple[float, float]:
        """One pass: the bound, if no tables cost anything, and the share of labels that `most` leaves."""
        self.bound, left = _pass_over(self.state, most - self.bound, forward)
        return self.bound, left / len(self.state.unary)

    def update_rings(self, cap: float, *, backward: bool) -> None:
        """Move what rings cost into their pairs, one ring after the other; sums above cap count as cap."""
        numbers = np.arange(len(self.ring_numbers))[:: -1 if backward else 1].copy()
        _update_rings(numbers, self.state, self.rings, cap)

    def interpolate(self, old: RingDual) -> None:
        """Take shares and tables from those of a level whose cells contain the cells of this one.

        Labels between two old ones get a mean. Two labels of a pair lie in a triangle of old ones, because
        one threshold rounds both.
        """
        places = self._places_in(old)
        for slot, point in enumerate(self.state.point.tolist()):
            low, up, part = places[point]
            used = old.state.unary[old.state.start[point] : old.state.start[point + 1]] < np.inf
            self.share(slot)[:] = _mean(old.share(slot), used, [(1 - part, (low,)), (part, (up,))])
        for step, e in enumerate(old.rings.pair.tolist()):  # rings that are added come last
            (low, up, part), (below, above, other) = (places[point] for point in self.rows.ends[e])
            low, up, part = low[:, None], up[:, None], part[:, None]
            corners = [
                (np.minimum(part, other), (up, above)),
                (
                    np.abs(part - other),
                    (np.where(part > other, up, low), np.where(part < other, above, below)),
                ),
                (1 - np.maximum(part, other), (low, below)),
            ]
            table, used = self.table(step), np.isfinite(self.costs(e))
            table[used] = _mean(old.table(step), np.isfinite(old.costs(e)), corners)[used]
            self.costs(e)[:] += table

    def _places_in(self, old: RingDual) -> list[tuple[Indices, Indices, Floats]]:
        """Of each point, where its labels lie: old labels below and above, or -1, and the place between."""
        factor, places = self.level.divisions // old.level.divisions, []
        for new, before, half in zip(self.level.labels, old.level.labels, self.rows.half, strict=True):
            place = (new - half * (factor // 3)) / factor
            lower = np.floor(place).astype(np.int64)
            at = [np.searchsorted(before, label).clip(max=len(before) - 1) for label in (lower, lower + 1)]
            low, up = (np.where(before[k] == lower + step, k, -1) for step, k in enumerate(at))
            places.append((low, up, place - lower))
        return places

    def share(self, slot: int) -> Floats:
        """The share of the point of a slot."""
        return self.state.shares[self.state.share_start[slot] : self.state.share_start[slot + 1]]

    def costs(self, pair: int) -> Floats:
        """The costs of each two labels of a pair, with all tables."""
        return self._square(self.state.costs, self.state.begin[pair], pair)

    def table(self, step: int) -> Floats:
        """The table of a step of a ring in use."""
        return self._square(self.rings.tables, self.rings.begin[step], int(self.rings.pair[step]))

    def _square(self, numbers: Floats, begin: int, pair: int) -> Floats:
        rows, columns = (len(self.level.labels[point]) for point in self.rows.ends[pair])
        return numbers[begin : begin + rows * columns].reshape(rows, columns)

    def arrays(self, gap: float) -> Arrays:
        """Shares and tables as whole multiples of a unit: the arrays of a certificate, without prefix."""
        shares = _join([self.share(slot) for slot in range(0, len(self.state.point), 2)], np.float64)
        numbers = np.concatenate([shares, self.rings.tables])
        unit = _PART_OF_GAP * gap / max(self.rows.pairs + len(self.rings.pair), 1)
        unit = max(unit, float(np.abs(numbers).max(initial=0.0)) / _MOST, 1e-300)
        rings, multiples = np.array(self.ring_numbers, np.int32), np.round(numbers / unit).astype(np.int32)
        return {"rings": rings, "shares": multiples, "unit": np.array([unit])}

    def decode(self, *, forward: bool) -> Floats:
        """The angles (n,) that the shares suggest: after a pass in the other direction."""
        chosen = np.zeros(len(self.state.order), dtype=np.int64)
        _decode(self.state, forward, chosen)
        h = np.pi / 2 / self.level.divisions
        label = np.array([labels[x] for labels, x in zip(self.level.labels, chosen, strict=False)])
        angles: Floats = self.rows.centre[:-1] + h * (label + self.rows.half[:-1] / 2)
        return angles

    def ring_gaps(self) -> Floats:
        """The cost of the pairs of each ring at the centre beyond their shares, (r,): where the gap lies."""
        at = [int(np.abs(labels).argmin()) for labels in self.level.labels]
        gaps = np.zeros(self.rows.pairs)
        for e, (i, j) in enumerate(self.rows.ends[: self.rows.pairs]):
            shares = self.share(2 * e)[at[i]] + self.share(2 * e + 1)[at[j]]
            gaps[e] = self.costs(e)[at[i], at[j]] - shares
        gaps[~np.isfinite(gaps)] = 0.0
        return np.array([gaps[walk[0]].sum() for walk in self.rows.rings])


def _mean(old: Floats, used: Bools, corners: list[Any]) -> Floats:
    """Means of old numbers in use with given weights at given places, -1 for none; 0 where none is in use."""
    total = weight = np.zeros(())
    for share, at in corners:
        known = np.logical_and.reduce(np.broadcast_arrays(used[at], *(place >= 0 for place in at)))
        own = np.where(known, share + 1e-12, 0.0)
        total, weight = total + own * np.where(known, old[at], 0.0), weight + own
    return np.asarray(total / np.where(weight > 0, weight, 1.0))


def starts_of(sizes: Any) -> Indices:
    """Where blocks of these sizes begin in a flat array, and its length."""
    return np.concatenate([[0], np.cumsum(sizes, dtype=np.int64)])


def _join(parts: list[Any], kind: Any) -> Any:
    """One array of all parts, which may be none."""
    return np.concatenate([np.zeros(0, kind), *parts]).astype(kind)


@compiled_in_any_order
def _send(state: DualArrays, slot: int) -> None:
    """Set the share of a slot to the least cost less the other point's share."""
    own = state.shares[state.share_start[slot] : state.share_start[slot + 1]]
    other = state.shares[state.share_start[slot ^ 1] : state.share_start[(slot ^ 1) + 1]]
    costs = state.costs[state.begin[slot // 2] : state.begin[slot // 2 + 1]]
    row, columns = state.share_start[slot - slot % 2], len(own) if slot % 2 else len(other)
    own[:] = np.inf
    for x in range(len(costs) // columns):
        at, low, high = x * columns, state.low[row + x], state.high[row + x]
        if slot % 2:
            for y in range(low, high):
                own[y] = min(own[y], costs[at + y] - other[x])
        else:
            least = np.inf
            for y in range(low, high):
                least = min(least, costs[at + y] - other[y])
            own[x] = least


@compiled
def _pass_over(state: DualArrays, spare: float, forward: bool) -> tuple[float, int]:
    """A pass over all points; the sum of their least costs, and the labels that cost at most `spare` more."""
    total, left = 0.0, 0
    for i in state.order if forward else state.order[::-1].copy():
        unary = state.unary[state.start[i] : state.start[i + 1]]
        cost, earlier, later = unary.copy(), 0, 0
        for slot in state.around[state.around_start[i] : state.around_start[i + 1]]:
            own = state.shares[state.share_start[slot] : state.share_start[slot + 1]]
            if (state.rank[state.point[slot ^ 1]] < state.rank[i]) == forward:
                earlier += 1
                _send(state, slot)
            else:
                later += 1
            cost += own
            own[own == np.inf] = 0.0
        least = cost.min()
        total += least
        left += int((cost - least <= spare).sum())
        unary[cost == np.inf] = np.inf
        for slot in state.around[state.around_start[i] : state.around_start[i + 1]]:
            if (state.rank[state.point[slot ^ 1]] < state.rank[i]) != forward:
                own = state.shares[state.share_start[slot] : state.share_start[slot + 1]]
                for x in range(len(cost)):
                    if cost[x] < np.inf:
                        own[x] -= (cost[x] - least) / max(earlier, later, 1)
    return total, left


@compiled
def _decode(state: DualArrays, forward: bool, chosen: Indices) -> None:
    """Choose a label for each point: of least cost to those that have one, and shares of the others."""
    for i in state.order if forward else state.order[::-1].copy():
        cost = state.unary[state.start[i] : state.start[i + 1]].copy()
        for slot in state.around[state.around_start[i] : state.around_start[i + 1]]:
            j, begin, share = state.point[slot ^ 1], state.begin[slot // 2], state.share_start[slot]
            if (state.rank[j] < state.rank[i]) == forward:
                step = 1 if slot % 2 else state.start[j + 1] - state.start[j]
                at = begin + chosen[j] * (len(cost) if slot % 2 else 1)
                for x in range(len(cost)):
                    cost[x] += state.costs[at + x * step]
            else:
                cost += state.shares[share : share + len(cost)]
        chosen[i] = cost.argmin()


@compiled
def _update_rings(numbers: Indices, state: DualArrays, rings: RingArrays, cap: float) -> None:
    for number in numbers:
        _update_ring(rings.start[number], rings.start[number + 1], state, rings, cap)


@compiled
def _update_ring(begin: int, end: int, state: DualArrays, rings: RingArrays, cap: float) -> None:
    """Give each pair of a ring an equal part of the least cost of the whole ring at its two labels.

    The walk begins at the point with the fewest labels. All steps are first shifted so that no cost is
    negative: partial sums above cap can then be left out.
    """
    steps, sizes = end - begin, np.diff(state.start)[rings.point[begin:end]]
    order = begin + (np.arange(steps) + sizes.argmin()) % steps
    size = np.append(sizes[order - begin], sizes.min())
    cost = np.full((steps, size.max(), size.max()), np.inf)
    least = np.empty(steps)
    for k in range(steps):
        matrix, share, table = _matrices_of(state, rings, order[k])
        turned = matrix - share - table
        cost[k, : size[k], : size[k + 1]] = turned if rings.sign[order[k]] > 0 else turned.T.copy()
        least[k] = cost[k].min()
    if least.max() == np.inf:
        return
    cap, moved = max(cap - least.sum(), 0.0), least.sum()
    walks = np.full((steps + 1, size.max(), size[0]), cap)  # least costs from each first label to each label
    for s in range(size[0]):
        walks[0, s, s] = 0.0
    for k in range(steps):
        cost[k] -= least[k]
        _walk_on(walks[k], cost[k], cap, walks[k + 1])
    back, further = walks[0].copy(), walks[0].copy()
    for k in range(steps - 1, -1, -1):
        best = _close_walks(walks[k], cost[k], back, cap)
        _walk_on(back, cost[k].T, cap, further)
        back, further = further, back
        part = ((best + moved) / steps - cost[k] - least[k])[: size[k], : size[k + 1]]
        matrix, _, table = _matrices_of(state, rings, order[k])
        part = part.copy() if rings.sign[order[k]] > 0 else part.T.copy()
        for x in range(matrix.shape[0]):
            for y in range(matrix.shape[1]):
                if matrix[x, y] < np.inf:
                    matrix[x, y] += part[x, y] - table[x, y]
                    table[x, y] = part[x, y]


@compiled
def _matrices_of(state: DualArrays, rings: RingArrays, step: int) -> tuple[Floats, Floats, Floats]:
    """Costs with all tables, both shares together, and the own table of a step, by the labels of its pair."""
    e = rings.pair[step]
    one = state.shares[state.share_start[2 * e] : state.share_start[2 * e + 1]]
    other = state.shares[state.share_start[2 * e + 1] : state.share_start[2 * e + 2]]
    shape = (len(one), len(other))
    table = rings.tables[rings.begin[step] : rings.begin[step + 1]].reshape(shape)
    costs = state.costs[state.begin[e] : state.begin[e + 1]].reshape(shape)
    return costs, one.reshape(-1, 1) + other, table


@compiled_in_any_order
def _walk_on(walks: Floats, cost: Floats, cap: float, out: Floats) -> None:
    """Fill in the least costs, up to cap, of walks with one more step: [label, first label]."""
    out[:] = cap
    for x in range(walks.shape[0]):
        low, high = _range_below(walks[x], cap)
        for y in range(out.shape[0]):
            value = cost[x, y]
            if value < cap:
                for s in range(low, high):
                    out[y, s] = min(out[y, s], walks[x, s] + value)


@compiled_in_any_order
def _close_walks(walks: Floats, cost: Floats, back: Floats, cap: float) -> Floats:
    """The least costs, up to cap, of closed walks that take each step."""
    best = np.full(cost.shape, cap)
    for x in range(walks.shape[0]):
        low, high = _range_below(walks[x], cap)
        for y in range(back.shape[0]):
            if cost[x, y] < cap:
                least = cap
                for s in range(low, high):
                    least = min(least, walks[x, s] + back[y, s])
                best[x, y] = min(cap, least + cost[x, y])
    return best


@compiled
def _range_below(numbers: Floats, cap: float) -> tuple[int, int]:
    """The first number below cap, and the one after the last."""
    low, high = 0, len(numbers)
    while low < high and numbers[low] >= cap:
        low += 1
    while high > low and numbers[high - 1] >= cap:
        high -= 1
    return low, high
