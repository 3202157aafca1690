"""A dual solution of one level: shares by message passing, and tables on rings.

Sequential tree-reweighted message passing (TRW-S, Kolmogorov 2006) finds the shares of pairs. Rings become
clusters: a block of the dual ascent moves what the pairs of a ring cost together into the pairs. The checker
computes bounds anew from shares and tables, so nothing here has to be exact.
"""

from __future__ import annotations

from itertools import pairwise, product
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...array_archive import Arrays
from ...instance.domain import Bools, Floats
from ...processes.compilation import compiled, compiled_in_any_order, compiled_inside
from ..checkers.check_orthogonal import STRIDE, CellLevel, spans, starts_of

Indices = NDArray[np.int64]

_PART_OF_GAP: Final = 0.02  # that rounding the shares and tables may cost
_MOST: Final = 2**31 - 1
_AT_ONCE: Final = 1 << 16  # entries of tables, to spare memory
_OF_PAIRS: Final = 60  # work for two labels of a pair, next to that for three of a ring


class DualArrays(NamedTuple):
    """The arrays of a level that compiled functions share, all flat; inf marks what is excluded.

    Of m pairs, pair e has the slots e, of its first point, and m + e, of its second one.

    order: of the points in a pass. point: of each slot. later: whether it comes after the other point of the
    pair. around: slots of each point, from around_start. unary: costs of labels, from start. costs: of two
    labels with all tables, from begin, those of the first point in rows. shares: of the point of each slot,
    from share_start. sums: room for a number per label of a point.
    """

    order: Indices
    point: Indices
    later: Bools
    around_start: Indices
    around: Indices
    start: Indices
    unary: Floats
    begin: Indices
    costs: Floats
    share_start: Indices
    shares: Floats
    sums: Floats


class RingArrays(NamedTuple):
    """Rings in use, their steps and the tables of these steps, flat, as pairs have them.

    walk: the steps of each ring, from the point with the fewest labels on. size: labels where a step begins.
    """

    start: Indices
    walk: Indices
    pair: Indices
    sign: Indices
    size: Indices
    begin: Indices
    tables: Floats


class RingDual:
    """Shares and tables on a level, which rise to a better bound."""

    def __init__(self, level: CellLevel, costs: Floats, order: Indices, rings: list[int]) -> None:
        """Begin with shares and tables of 0. order: of the points in a pass. rings: those in use."""
        self.level, self.ring_numbers, self.bound = level, rings, -np.inf
        rows, pairs, m = level.rows, level.pairs, level.rows.pairs
        point = np.append(rows.first[:m], rows.second[:m])
        counts, rank = np.diff(pairs.start), np.argsort(order)
        unary = np.where(pairs.have_partners(np.isfinite(costs)), 0.0, np.inf)
        share_start = starts_of(counts[point])
        unary[pairs.item[0][pairs.first_line[m] :]] += costs[pairs.begin[m] :]
        self.state = DualArrays(
            order, point, rank[point] > rank[np.roll(point, m)],
            starts_of(np.bincount(point, minlength=rows.size)),
            np.lexsort((np.tile(np.arange(m), 2), point)), pairs.start[:-1], unary[:-1],
            pairs.begin[: m + 1], costs[: pairs.begin[m]].copy(), share_start, np.zeros(share_start[-1]),
            np.empty(counts.max()),
        )  # fmt: skip
        walks = [rows.rings[ring] for ring in rings]
        pair, sign, on_ring = (np.array([x for walk in walks for x in walk[part]], int) for part in range(3))
        start, begin = starts_of([len(walk[0]) for walk in walks]), starts_of(np.diff(pairs.begin)[pair])
        turned = (np.roll(np.arange(a, b), -counts[on_ring[a:b]].argmin()) for a, b in pairwise(start))
        walk = np.array([step for steps in turned for step in steps], int)
        self.rings = RingArrays(start, walk, pair, sign, counts[on_ring], begin, np.zeros(begin[-1]))
        self.work = 1.0 + _OF_PAIRS * len(pairs.row) + float((counts[on_ring] ** 3).sum())  # of the checker

    def pass_over(self, most: float, *, forward: bool) -> tuple[float, float]:
        """One pass: the bound, if no tables cost anything, and the share of labels that `most` leaves."""
        bound, left = _pass_over(self.state, most - self.bound, forward)
        self.bound = bound + self.level.rows.constant
        return self.bound, left / len(self.state.unary)

    def interpolate(self, old: RingDual) -> None:
        """Take shares and tables of a level whose cells contain these, by means of the old labels around."""
        pairs, state, before, steps = self.level.pairs, self.state, old.state, old.rings.pair
        ends, used = self._ends_in(old), np.append(before.unary < np.inf, False)
        label = spans(state.start[state.point], np.diff(state.share_start))
        shift = np.repeat(before.share_start[:-1] - before.start[state.point], np.diff(state.share_start))
        corners = [(share[label], used[at[label]], at[label] + shift) for share, at in ends]
        state.shares[:] = _mean(before.shares, corners)
        begin, sizes = self.rings.begin[: len(steps)], np.diff(pairs.begin)[steps]
        for some in np.split(np.arange(len(steps)), np.nonzero(np.diff(begin // _AT_ONCE))[0] + 1):
            entry, corners = spans(pairs.begin[steps[some]], sizes[some]), []
            shift = np.repeat(old.rings.begin[some] - before.begin[steps[some]], sizes[some])
            first, second = (item[line[entry]] for item, line in zip(pairs.item, pairs.line, strict=True))
            for (share, up), (part, along) in product(ends, ends):
                at = old.level.pairs.places(pairs.row[entry], up[first], along[second])
                finite = np.isfinite(before.costs.take(at, mode="clip"))
                known = used[up[first]] & used[along[second]] & finite
                corners.append((share[first] * part[second], known, at + shift))
            tables = np.where(np.isfinite(state.costs[entry]), _mean(old.rings.tables, corners), 0.0)
            self.rings.tables[spans(begin[some], sizes[some])] = tables  # rings that are added come last
            np.add.at(state.costs, entry, tables)

    def _ends_in(self, old: RingDual) -> list[tuple[Floats, Indices]]:
        """Old labels below and above each label, -1 for none, after their shares in it."""
        level, before, factor = self.level, old.level, self.level.divisions // old.level.divisions
        place = (level.label - level.rows.half[level.point] * (factor // 3)) / factor
        lower = np.floor(place).astype(np.int64)
        key = level.point * STRIDE + lower
        at = [np.searchsorted(before.key, key + step).clip(max=len(before.key) - 1) for step in (0, 1)]
        low, up = (np.where(before.key[k] == key + step, k, -1) for step, k in enumerate(at))
        return [(1 - place + lower, low), (place - lower, up)]

    def arrays(self, gap: float) -> Arrays:
        """Shares and tables as whole multiples of a unit: the arrays of a certificate, without prefix."""
        m = self.level.rows.pairs
        numbers = np.append(self.state.shares[: self.state.share_start[m]], self.rings.tables)
        unit = _PART_OF_GAP * gap / max(m + len(self.rings.pair), 1)
        unit = max(unit, float(np.abs(numbers).max(initial=0.0)) / _MOST, 1e-300)
        rings, multiples = np.array(self.ring_numbers, np.int32), np.round(numbers / unit).astype(np.int32)
        return {"rings": rings, "shares": multiples, "unit": np.array([unit])}

    def decode(self) -> Floats:
        """The angles (n,) of the labels that cost least with their shares."""
        cost, state, rows = self.state.unary.copy(), self.state, self.level.rows
        np.add.at(cost, spans(state.start[state.point], np.diff(state.share_start)), state.shares)
        chosen = np.lexsort((cost, self.level.point[:-1]))[state.start[:-1]]
        steps = self.level.label[chosen] + rows.half[:-1] / 2
        return np.asarray(rows.centre[:-1] + np.pi / 2 / self.level.divisions * steps)

    def ring_gaps(self) -> Floats:
        """The cost of the pairs of each ring at the centre beyond their shares, (r,): where the gap lies."""
        level, state, rows = self.level, self.state, self.level.rows
        central = np.lexsort((np.abs(level.label), level.point))[level.pairs.start[:-1]]
        shares = state.shares[state.share_start[:-1] + central[state.point] - state.start[state.point]]
        at = level.pairs.places(np.arange(rows.pairs), *central[state.point].reshape(2, -1))
        gaps = np.nan_to_num(state.costs[at] - shares.reshape(2, -1).sum(axis=0), posinf=0.0)
        return np.array([gaps[walk[0]].sum() for walk in rows.rings])


def _mean(numbers: Floats, corners: list[Any]) -> Floats:
    """Means of numbers at places, with their shares and whether they are known; 0 where none is."""
    total = weight = np.zeros(())
    for share, known, at in corners:
        part = np.where(known, share + 1e-12, 0.0)
        total, weight = total + part * np.where(known, numbers.take(at, mode="clip"), 0.0), weight + part
    return np.asarray(total / np.where(weight > 0, weight, 1.0))


@compiled_in_any_order
def _send(state: DualArrays, slot: int) -> None:
    """Set the share of a slot to the least cost less the other point's share."""
    pairs = len(state.begin) - 1
    e = slot % pairs
    first, second, at = state.share_start[e], state.share_start[pairs + e], state.begin[e]
    rows, columns = state.share_start[e + 1] - first, state.share_start[pairs + e + 1] - second
    for y in range(columns if slot >= pairs else 0):
        state.shares[second + y] = np.inf
    for x in range(rows):
        share = np.inf if slot < pairs else state.shares[first + x]
        for y in range(columns):
            if slot < pairs:
                share = min(share, state.costs[at + y] - state.shares[second + y])
            else:
                state.shares[second + y] = min(state.shares[second + y], state.costs[at + y] - share)
        if slot < pairs:
            state.shares[first + x] = share
        at += columns


@compiled_inside
def _collect(state: DualArrays, i: int, forward: bool) -> int:
    """Add up costs and shares of the labels of a point, those with earlier points anew; return how many."""
    earlier, begin, size = 0, state.start[i], state.start[i + 1] - state.start[i]
    for x in range(size):
        state.sums[x] = state.unary[begin + x]
    for at in range(state.around_start[i], state.around_start[i + 1]):
        slot = state.around[at]
        if state.later[slot] == forward:
            earlier += 1
            _send(state, slot)
        for x in range(size):
            share = state.share_start[slot] + x
            state.sums[x] += state.shares[share]
            state.shares[share] = state.shares[share] if state.shares[share] < np.inf else 0.0
    return earlier


@compiled
def _pass_over(state: DualArrays, spare: float, forward: bool) -> tuple[float, int]:
    """A pass over all points; the sum of their least costs, and the labels that cost at most `spare` more."""
    total, left, sums = 0.0, 0, state.sums
    for number in range(len(state.order)):
        i = state.order[number if forward else -1 - number]
        earlier, around = _collect(state, i, forward), range(state.around_start[i], state.around_start[i + 1])
        least, parts = np.inf, max(earlier, len(around) - earlier, 1)
        for x in range(state.start[i + 1] - state.start[i]):
            least = min(least, sums[x])
        total += least
        for x in range(state.start[i + 1] - state.start[i]):
            left += sums[x] - least <= spare
            if sums[x] == np.inf:
                state.unary[state.start[i] + x] = np.inf
                continue
            for at in around:
                if state.later[state.around[at]] != forward:
                    state.shares[state.share_start[state.around[at]] + x] -= (sums[x] - least) / parts
    return total, left


@compiled
def update_rings(state: DualArrays, rings: RingArrays, most: float) -> None:
    """Give each pair of a ring an equal part of the least cost of the whole ring at its two labels.

    One ring follows the other. All steps are first shifted so that no cost is negative: partial sums above
    most can then be left out.
    """
    for number in range(len(rings.start) - 1):
        walk, moved, widest = rings.walk[rings.start[number] : rings.start[number + 1]], 0.0, len(state.sums)
        steps, size = len(walk), rings.size[walk]
        cost, least = np.empty((steps, widest, widest)), np.empty(steps)
        walks = np.empty((2, steps + 1, widest, size[0]))  # least costs from, and to, each first label
        for k in range(steps):
            least[k] = _take_step(state, rings, walk[k], cost[k])
            moved += least[k]
        if moved == np.inf:
            continue
        cap = max(most - moved, 0.0)
        for x in range(size[0]):
            for s in range(size[0]):
                walks[0, 0, x, s] = walks[1, steps, x, s] = 0.0 if s == x else cap
        for k in range(steps):
            _walk_on(walks[0, k], cost[k, : size[k], : size[(k + 1) % steps]], cap, walks[0, k + 1])
        for k in range(steps - 1, -1, -1):
            along, turned = cost[k, : size[k], : size[(k + 1) % steps]], rings.sign[walk[k]] < 0
            _walk_on(walks[1, k + 1], along.T, cap, walks[1, k])
            ends = (walks[1, k + 1], walks[0, k]) if turned else (walks[0, k], walks[1, k + 1])
            e, begin = rings.pair[walk[k]], rings.begin[walk[k]]
            _set_table(
                state.costs[state.begin[e] : state.begin[e + 1]], rings.tables[begin:],
                along.T if turned else along, ends, (cap, steps, moved / steps - least[k]),
            )  # fmt: skip


@compiled_inside
def _take_step(state: DualArrays, rings: RingArrays, step: int, cost: Floats) -> float:
    """Fill in what a step costs beyond its shares, its table and the least, which is returned."""
    e, at, least, turned = rings.pair[step], 0, np.inf, rings.sign[step] < 0
    first, second = state.share_start[e], state.share_start[len(state.begin) - 1 + e]
    rows = state.share_start[e + 1] - first
    columns = (state.begin[e + 1] - state.begin[e]) // rows
    matrix = cost[:columns, :rows].T if turned else cost[:rows, :columns]
    for x in range(rows):
        for y in range(columns):
            shares = state.shares[first + x] + state.shares[second + y]
            matrix[x, y] = state.costs[state.begin[e] + at] - shares - rings.tables[rings.begin[step] + at]
            least, at = min(least, matrix[x, y]), at + 1
    for x in range(rows):
        for y in range(columns):
            matrix[x, y] -= least
    return least


@compiled_in_any_order
def _walk_on(walks: Floats, cost: Floats, cap: float, out: Floats) -> None:
    """Fill in the least costs, up to cap, of walks with one more step: [label, first label]."""
    for y in range(cost.shape[1]):
        for s in range(walks.shape[1]):
            out[y, s] = cap
    for x in range(cost.shape[0]):
        for y in range(cost.shape[1]):
            value = cost[x, y]
            if value < cap:
                for s in range(walks.shape[1]):
                    out[y, s] = min(out[y, s], walks[x, s] + value)


@compiled_in_any_order
def _set_table(costs: Floats, tables: Floats, excess: Floats, ends: Any, numbers: Any) -> None:
    """Set the table of a step so that the excess of its labels is the part of the least walk through them."""
    (there, back), (cap, steps, offset), at = ends, numbers, 0
    for x in range(excess.shape[0]):
        for y in range(excess.shape[1]):
            least = cap
            if excess[x, y] < cap:
                for s in range(there.shape[1]):
                    least = min(least, there[x, s] + back[y, s])
                least = min(cap, least + excess[x, y])
            if costs[at] < np.inf:
                part = least / steps + offset - excess[x, y]
                costs[at] += part - tables[at]
                tables[at] = part
            at += 1
