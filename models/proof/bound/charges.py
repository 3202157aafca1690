"""Charges of rings, and clouds that bound their energy from below: docs/orthogonal-proofs.md, section 5.

The best clouds for a potential fill a background, as sand that topples; the best potential for given clouds
is that of a convex problem, in which parts of particles may appear. A stage finds them in turns, and the next
one has the particles that are left. The checker computes all bounds anew, so nothing here has to be exact.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, diags_array
from scipy.sparse.csgraph import connected_components, reverse_cuthill_mckee

from ...array_archive import Arrays
from ...instance.angles import HALF
from ...instance.domain import Bools, Domain, Floats
from ...instance.sparse_systems import factor_matrix
from ...processes.compilation import compiled, compiled_inside
from ...processes.deadline import IsOver
from ..checkers.check_orthogonal import (
    MOST_STAGES,
    RELATIVE,
    STAGE_PARTS,
    CentredRows,
    Charges,
    Clouds,
    stage_of,
    starts_of,
)

Indices = NDArray[np.int64]
Laplacian = tuple[Indices, Indices, Floats, Floats]  # begin, column, entry, resistance of `Charges`
Places = tuple[Floats, Bools, Bools]
Cloud = tuple[Indices, Indices, Floats]

_MOST_CELLS: Final = 400  # of a cloud
_MOST_ENTRIES: Final = 8_000_000  # of all clouds
_CHUNK: Final = 1000  # clouds between looks at the clock
_SWEEPS: Final = 400  # in which sand topples
_OVER: Final = 1.5  # relaxation
_STILL: Final = 1e-7  # excess of sand, in particles, that topples no more
_LEAST: Final = 1e-5  # background below which sand is not spread thinner
_ROUNDING: Final = 1e-12  # relative: of the charges of a cloud, far above what a checker deducts
_NEAR: Final = 0.1  # of what joins a loop to others: how fast charges count less with distance
_DIGITS: Final = 9  # of charges: those that symmetry makes equal are, however a mesh is numbered
_MIXED: Final = 0.25  # share of loops with both signs: above, levels prove more if all parts have strokes
_ROUNDS: Final = 12  # of a stage
_STEPS: Final = 300  # of gradients for a potential
_HALVINGS: Final = 60  # of the range of a multiplier
_GAIN: Final = 1e-4  # relative: by which another round, or stage, has to raise the bound
_SHARE: Final = 0.02  # of the gap: the same for another round


def charge_arrays(
    domain: Domain, rows: CentredRows, threshold: float, is_over: IsOver, *, quick: bool = False
) -> Arrays:
    """The arrays of charges in a certificate; none without rings, or without the time for a first round.

    None either where all parts have strokes, and too many loops may have charges of both signs.

    threshold: as of `Proof`. quick: whether to end after the first round.
    """
    arrays = _loops(domain, rows) if len(domain.rings.defect) else {}
    if not arrays:
        return {}
    charges, best = Charges(arrays, rows), 0.0
    mixed = float(charges.most.all(axis=0).mean())
    if charges.most.max() > np.iinfo(np.uint8).max or (mixed > _MIXED and not rows.fixed[:-1].any()):
        return {}
    remaining, stages = charges.most, _Stages(charges)
    for number in range(MOST_STAGES):
        stage, bound, after = stages.stage(remaining, threshold, is_over, 1 if quick else _ROUNDS)
        if not stage or (number and bound < best + _GAIN * threshold):
            break
        arrays |= {f"stage_{number}_{part}": array for part, array in stage.items()}
        arrays["stages"] = np.array([number + 1], np.int32)
        best = max(best, bound)
        if quick or is_over() or bound >= threshold or (after == remaining).all():
            break
        remaining = after
    return arrays if "stages" in arrays else {}


def _loops(domain: Domain, rows: CentredRows) -> Arrays:
    """The arrays of loops, if any: rings, and fans along the boundary, neighbours close to each other.

    Between two points with strokes, they lead through the ground, if no other loop has these strokes in
    the same direction, and fall into parts there. Fans have to. No loop has a row of too little weight.
    """
    fans, rings, heavy = domain.fans, domain.rings, rows.weight >= RELATIVE
    pair = np.append(np.insert(fans.pair, fans.start[1:], -1), rings.pair)  # -1 closes a fan
    sign = np.append(np.insert(fans.sign, fans.start[1:], 1), rings.sign)
    start = starts_of(np.append(np.diff(fans.start) + 1, np.diff(rings.start)))
    count, step = len(start) - 1, np.arange(len(pair))
    walk, before, after = np.repeat(np.arange(count), np.diff(start)), step - 1, step + 1
    before[start[:-1]], after[start[1:] - 1] = start[1:] - 1, start[:-1]
    ends = rows.first[pair], rows.second[pair]
    tail, head, closes = np.where(sign > 0, *ends), np.where(sign < 0, *ends), pair < 0
    tail[closes], head[closes] = head[before[closes]], tail[after[closes]]
    stroke, own = np.full(rows.size + 1, -1), rows.pairs + np.nonzero(heavy[rows.pairs :])[0]
    stroke[rows.first[own]] = own
    cut = (stroke[tail] >= 0) & (stroke[head] >= 0) & (closes | (walk >= len(fans.start) - 1))
    while True:
        kept = ~cut & (np.bincount(walk, ~cut & (closes | ~heavy[pair]), count) == 0)[walk]
        begin, end = np.nonzero(kept & cut[before])[0], np.nonzero(kept & cut[after])[0]
        _, first = np.unique(np.append(tail[begin], rows.size + head[end]), return_index=True)
        if len(first) == len(begin) + len(end):
            break
        cut[np.delete(np.append(before[begin], after[end]), first)] = False
    part = np.cumsum(cut) + walk
    last = part == part[start[1:] - 1][walk]  # the last part of a walk is one with its first
    part[last] = (part - cut)[start[:-1]][walk[last]]
    kept = np.nonzero(kept)[0]
    row = np.concatenate([pair[kept], stroke[tail[begin]], stroke[head[end]]])
    sign = np.concatenate([sign[kept], np.full(len(begin), -1), np.full(len(end), 1)])
    found, loop = np.unique(part[np.concatenate([kept, begin, end])], return_inverse=True)
    if not len(found):
        return {}
    uses = coo_array((np.ones(len(row)), (loop, row)), shape=(len(found), len(heavy))).tocsr()
    order = reverse_cuthill_mckee((uses @ uses.T).tocsr(), symmetric_mode=True)
    place = np.argsort(order)[loop]
    step = np.argsort(place, kind="stable")
    return {
        "loop_start": starts_of(np.bincount(place, minlength=len(found))).astype(np.int32),
        "loop_row": row[step].astype(np.int32),
        "loop_sign": sign[step].astype(np.int8),
    }


class _Stages:
    """Stages of charges. part (l,): of each loop; whole: whether charges of a part add up to 0.

    nearby (l,): means of charges round each loop.
    """

    def __init__(self, charges: Charges) -> None:
        line = np.repeat(np.arange(charges.size), np.diff(charges.begin))
        shape, places = (charges.size, charges.size), (line, charges.column)
        near = coo_array((charges.entry, places), shape=shape).tocsr()
        count, self.part = connected_components(near, directed=False)
        self.whole = np.bincount(self.part, ~charges.closed, count) == 0
        self.charges, self.laplacian = charges, (diags_array(charges.resistance) - near).tocsr()
        self.inverse = factor_matrix(self.laplacian, pull=1e-9 * float(charges.resistance.max()))
        pull = _NEAR * float(charges.resistance.mean())
        self.nearby = (pull * factor_matrix(self.laplacian, pull=pull)(charges.origin)).round(_DIGITS)

    def stage(
        self, most: Indices, threshold: float, is_over: IsOver, rounds: int
    ) -> tuple[Arrays, float, Indices]:
        """The arrays of a stage with these particles, its bound, and the particles that it leaves.

        There are no arrays where time is over before the first round is complete.
        """
        charges, best, potential = self.charges, -np.inf, np.zeros(self.charges.size)
        places, shares = self._places(most), np.zeros(int(most.sum()))
        arrays, bound, remaining = Arrays(), best, most
        for _ in range(rounds):
            background = charges.origin + self.laplacian @ potential
            if (spread := self._spread(most, places, background, is_over)) is None:
                break
            start, cell, weight = spread
            clouds = Clouds(charges, most, start, cell, weight)
            _, added, kind = stage_of(charges, clouds, potential, np.zeros(charges.size))
            price = self._best_price(clouds, added, kind)
            bound, added, kind = stage_of(charges, clouds, potential, price)
            if bound > best:
                parts = zip(STAGE_PARTS.items(), (*most, potential, price, start, cell, weight), strict=True)
                arrays = {name: array.astype(kind) for (name, kind), array in parts}
                remaining = clouds.remaining(bound, added, kind, threshold)
            if bound < best + max(_GAIN * threshold, _SHARE * (threshold - best)) or is_over():
                break
            best = bound
            shares, potential = self._better_potential(clouds, kind, shares, is_over)
        return arrays, max(best, bound), remaining

    def _potential_of(self, numbers: Floats) -> Floats:
        """The potential of charges, less their means in parts where they add up to 0."""
        mean = np.bincount(self.part, numbers) / np.bincount(self.part)
        return np.asarray(self.inverse(numbers - np.where(self.whole, mean, 0.0)[self.part]))

    def _places(self, most: Indices) -> tuple[Bools, Bools]:
        """Where clouds of a sign may lie, and loops whose own particle may have one: (2, l) each.

        Clouds of both signs stay apart: each loop has those of the sign of most charges near it.
        """
        first, second = self.charges.links
        home = np.array([self.nearby >= 0, self.nearby < 0])
        strength = np.abs(self.nearby) + 10.0**-_DIGITS * home[1]  # in a tie, the negative one
        weaker = np.where(strength[first] < strength[second], first, second)
        home[:, weaker[home[0][first] != home[0][second]]] = False
        return home & (most[::-1] == 0), home

    def _spread(
        self, most: Indices, places: tuple[Bools, Bools], background: Floats, is_over: IsOver
    ) -> tuple[Indices, Indices, Floats] | None:
        """The clouds of all particles that fill the background best: starts, loops and weights.

        None where time is over before.
        """
        charges, parts = self.charges, list[tuple[Indices, Indices, Floats]]()
        for side, sign in enumerate((1, -1)):
            loop = np.nonzero(most[side])[0]
            cells = max(min(_MOST_CELLS, _MOST_ENTRIES // max(len(loop), 1)), 1)
            room = np.maximum(sign * background, _LEAST), *(place[side] for place in places)
            for at in range(0, max(len(loop), 1), _CHUNK):
                if is_over():
                    return None
                laplacian = charges.begin, charges.column, charges.entry, charges.resistance
                parts.append(_topple(laplacian, room, loop[at : at + _CHUNK], cells))
        count, cell, weight = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        return starts_of(count), cell, weight

    def _best_price(self, clouds: Clouds, added: Floats, kind: Indices) -> Floats:
        """The Lagrange multiplier of each loop for the sum of charges in its part, where that is 0."""
        sign, part, added = clouds.sign[kind], self.part[clouds.loop[kind]], added / HALF**2

        def total(price: Floats) -> Floats:
            return np.bincount(part, sign * (added < sign * price[part]), len(self.whole))

        wanted = np.round(np.bincount(self.part, self.charges.origin, len(self.whole)))
        price = self._multipliers(total, wanted, 1 + float(np.abs(added).max(initial=0.0)))
        return np.asarray(price[self.part])

    def _multipliers(self, total: Callable[[Floats], Floats], wanted: Floats, far: float) -> Floats:
        """The greatest multiplier of each part below `far` whose total is too small; 0 if none is due."""
        low, high = np.full(len(self.whole), -far), np.full(len(self.whole), far)
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            few = total(middle) < wanted
            low, high = np.where(few, middle, low), np.where(few, high, middle)
        return np.where(self.whole, low, 0.0)

    def _better_potential(
        self, clouds: Clouds, kind: Indices, shares: Floats, is_over: IsOver
    ) -> tuple[Floats, Floats]:
        """Minimum-energy shares of particles in [0, 1], for given clouds, and their potential.

        Accelerated projected gradients (Beck and Teboulle 2009), restarted where they turn back.
        """
        charges, shape = self.charges, (len(clouds.loop), self.charges.size)
        weights = csr_array((clouds.weight, (clouds.owner, clouds.cell)), shape=shape)
        unit = csr_array((np.ones(len(clouds.loop)), (np.arange(len(clouds.loop)), clouds.loop)), shape=shape)
        smeared: Any = (diags_array(clouds.sign.astype(float)) @ (unit - weights @ self.laplacian)).tocsr()
        _, fixed, _ = stage_of(charges, clouds, np.zeros(charges.size), np.zeros(charges.size))
        fixed = fixed / HALF**2
        back = smeared.T.tocsr()

        def charge(numbers: Floats) -> Floats:
            return np.asarray(back @ np.bincount(kind, numbers, len(clouds.loop)))

        def reply(numbers: Floats) -> Floats:
            return np.asarray((smeared @ self._potential_of(numbers))[kind])

        vector = np.cos(np.arange(len(kind)))
        for _ in range(15):
            vector = reply(charge(vector))
            length = float(np.linalg.norm(vector))
            vector /= max(length, 1e-300)
        step, sign = 0.45 / max(length, 1e-300), clouds.sign[kind]
        part = self.part[clouds.loop[kind]]
        shares = self._project(shares, sign, part)
        ahead, pace = shares, 1.0
        for number in range(_STEPS):
            slope = 2 * reply(charge(ahead) - charges.origin) + fixed
            new = self._project(ahead - step * slope, sign, part)
            step_taken = new - shares
            pace = 1.0 if (ahead - new) @ step_taken > 0 else pace
            next_pace = (1 + np.sqrt(1 + 4 * pace * pace)) / 2
            ahead, moved = new + (pace - 1) / next_pace * step_taken, np.abs(step_taken).max(initial=0.0)
            shares, pace = new, next_pace
            if moved < _STILL or (number % 10 == 9 and is_over()):
                break
        return shares, self._potential_of(charge(shares) - charges.origin)

    def _project(self, shares: Floats, sign: Indices, part: Indices) -> Floats:
        """The nearest shares in [0, 1] with the sums of parts whose charges add up to 0."""

        def projected(shift: Floats) -> Floats:
            return np.clip(shares + sign * shift[part], 0, 1)

        def total(shift: Floats) -> Floats:
            return np.bincount(part, sign * projected(shift), len(self.whole))

        wanted = np.bincount(self.part, self.charges.origin, len(self.whole))
        return projected(self._multipliers(total, wanted, 2 + float(np.abs(shares).max(initial=0.0))))


@compiled
def _topple(
    laplacian: Laplacian, places: Places, loop: Indices, most: int
) -> tuple[Indices, Indices, Floats]:
    """Spread each particle until no loop has more than its room: the divisible sandpile.

    places: the room of each loop, whether clouds may lie there, and whether that of its own particle may.
    most: loops of a cloud. Returns how many loops all clouds have, and these loops, ascending, and weights.
    A particle has none where its sand does not come to rest, as in a closed part with little room.
    """
    count, place = np.zeros(len(loop), np.int64), np.full(len(places[0]), -1)
    cells, weights = np.empty(len(loop) * most, np.int64), np.empty(len(loop) * most)
    local, numbers, filled = np.empty(most, np.int64), np.zeros((2, most)), 0
    for a in range(len(loop)):
        if not places[2][loop[a]]:
            continue
        size, local[0], place[loop[a]], numbers[0, 0], numbers[1, 0] = 1, loop[a], 0, 0.0, 1.0
        for _ in range(_SWEEPS):
            size, moved = _sweep(laplacian, places, (place, local, numbers), size)
            if moved < _STILL:
                break
        for k in range(size):  # rounded as in a certificate
            numbers[0, k] = float(np.float32(numbers[0, k]))
        is_cloud = _is_cloud(laplacian, (place, local, numbers), size)
        for j in np.sort(local[:size]):
            if is_cloud and numbers[0, place[j]] > 0.0:
                cells[filled], weights[filled] = j, numbers[0, place[j]]
                filled, count[a] = filled + 1, count[a] + 1
            place[j] = -1
    return count, cells[:filled], weights[:filled]


@compiled_inside
def _is_cloud(laplacian: Laplacian, cloud: Cloud, size: int) -> bool:
    """Whether a particle less the charges of its cloud is clearly not negative anywhere."""
    (begin, column, entry, resistance), (place, local, numbers) = laplacian, cloud
    for k in range(size):
        i, own = local[k], 1.0 if k == 0 else 0.0
        rest, reach = own - resistance[i] * numbers[0, k], own + resistance[i] * numbers[0, k]
        for at in range(begin[i], begin[i + 1]):
            if place[column[at]] >= 0:
                rest += entry[at] * numbers[0, place[column[at]]]
                reach += entry[at] * numbers[0, place[column[at]]]
        if numbers[0, k] > 0.0 and rest < _ROUNDING * reach:
            return False
    return True


@compiled_inside
def _sweep(laplacian: Laplacian, places: Places, cloud: Cloud, size: int) -> tuple[int, float]:
    """Topple all loops of a cloud once; its new size, and the most sand that moved.

    cloud: the place of each loop in it, or -1; its loops; their weights, and sand.
    """
    (begin, column, entry, resistance), (place, local, numbers) = laplacian, cloud
    moved, k = 0.0, 0
    while k < size:
        i = local[k]
        after = max(numbers[0, k] + _OVER * (numbers[1, k] - places[0][i]) / resistance[i], 0.0)
        step, numbers[0, k] = after - numbers[0, k], after
        numbers[1, k] -= resistance[i] * step
        moved = max(moved, abs(step) * resistance[i])
        for at in range(begin[i], begin[i + 1] if step != 0.0 else begin[i]):
            j = column[at]
            if place[j] < 0 and places[1][j] and size < len(local):
                place[j], local[size], numbers[0, size], numbers[1, size] = size, j, 0.0, 0.0
                size += 1
            if place[j] >= 0:
                numbers[1, place[j]] += entry[at] * step
        k += 1
    return size, moved
