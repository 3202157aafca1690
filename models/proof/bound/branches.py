"""Branches on particles: docs/orthogonal-proofs.md, Lemma 11.

A branch has particles that are there and others that are not; a convex problem has shares of the rest. The
branch with the least bound is divided next, by the particle with the largest share.
"""

from __future__ import annotations

import heapq
import time
from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...array_archive import Arrays
from ...instance.angles import HALF
from ...instance.domain import Floats, Ints
from ...processes.compilation import compiled, compiled_inside
from ..checkers.check_certificate import OPTIMAL
from ..checkers.check_orthogonal import (
    BRANCHES,
    MOST_BRANCHED,
    MOST_SHARES,
    WHOLE,
    Branches,
    Charges,
    Clouds,
)

State = NDArray[np.int8]
Shares = NDArray[np.uint16]
Indices = NDArray[np.int64]
System = tuple[Floats, Floats, Floats, Indices]  # quadratic; mutual, alone, sign of `Branches`

_CLOSE: Final = 0.05  # of what a bound lacks: by which it may be below the least energy of shares
_LOOK: Final = 256  # ends at the first look at what the least bound lacks; twice as many at each further one
_SLOW: Final = 0.97  # of what it lacked at the look before: more ends are not worth it
_SECONDS: Final = 1e-9  # of the check of an end, for each product of two numbers: a forecast
_SWEEPS: Final = 60
_STILL: Final = 1e-12  # slope
_FLAT: Final = 1e-12  # curvature


def branch_arrays(
    charges: Charges, clouds: Clouds, count: Ints, threshold: float, is_over: Callable[[float], bool]
) -> tuple[Arrays, Floats | None]:
    """The arrays of branches in a certificate, and charges (l,) of less energy than the best field, if any.

    clouds, count: of the last stage, and how many particles of each kind it leaves. threshold: as of `Proof`.
    is_over: whether fewer than so many seconds are left. Charges are in quarter turns. There are no arrays
    where loops do not share all their rows, or are too many.
    """
    units = int(count.sum())
    if not charges.closed.all() or not 0 < max(charges.size, units) <= MOST_BRANCHED or not units:
        return {}, None
    begin = time.perf_counter()
    tree = _Tree(Branches(charges, clouds, count), threshold)
    begun = time.perf_counter() - begin
    check = _SECONDS * (charges.size + units) ** 2
    lacking, look = tree.lacking, _LOOK
    while tree.lacking > 0 and tree.ends * units < MOST_SHARES - units:
        if is_over(2 * (begun + tree.ends * check)):
            break
        if tree.ends >= look:
            if tree.lacking > _SLOW * lacking:
                break
            lacking, look = tree.lacking, 2 * look
        tree.divide()
    if tree.better is None:
        return tree.arrays(), None
    numbers = tree.branches.sign * (tree.better == 1)
    return tree.arrays(), np.bincount(tree.branches.loop, numbers, charges.size) - charges.origin


class _Tree:
    """Branches from the first one, which has all particles free; bounds in units of (pi/2)^2.

    unit: the particle that divides a branch, or -1 at an end. after: the two branches that follow, the first
    of which has the particle. state, share: of the ends. goal: a bound that is enough, at most the energy of
    an end without free particles; better: its state, if a field of that energy would be the best one. open:
    ends below the goal.
    """

    def __init__(self, branches: Branches, threshold: float) -> None:
        charges, reply = branches.charges, branches.smeared @ branches.inverse
        pull = branches.sign * (branches.weight @ charges.origin) + reply @ charges.origin
        self.branches, alone = branches, branches.alone - 2 * pull
        mutual = np.where(branches.never, -1.0, branches.mutual)
        self.system = reply @ branches.smeared.T, mutual, alone, branches.sign
        self.empty = float(charges.origin @ branches.inverse @ charges.origin)
        room = OPTIMAL / 4 * max(1.0, threshold)
        self.goal = (threshold - room - charges.rows.constant) / HALF**2 - self.empty
        self.unit, self.after = list[int](), dict[int, int]()
        self.state, self.share = dict[int, State](), dict[int, Shares]()
        self.open, self.ends = list[tuple[float, int]](), 0
        self.better: State | None = None
        self._add(np.full(len(alone), 2, np.int8), np.zeros(len(alone)))

    def _add(self, state: State, shares: Floats) -> None:
        """Add an end. shares: of the branch before, near which those of the end are."""
        bound, number = _solve(self.system, state, shares, self.branches.wanted, self.goal), len(self.unit)
        if bound < self.goal and (state == 2).any():
            heapq.heappush(self.open, (bound, number))
        elif bound < self.goal:
            self.better, self.goal = state, bound
        self.unit.append(-1)
        self.state[number], self.share[number] = state, np.round(WHOLE * shares).astype(np.uint16)
        self.ends += 1

    @property
    def lacking(self) -> float:
        """By how much the least bound is below the goal."""
        return self.goal - self.open[0][0] if self.open else 0.0

    def divide(self) -> None:
        """Divide the branch with the least bound by the particle with the greatest share."""
        _, number = heapq.heappop(self.open)
        state, shares = self.state.pop(number), self.share.pop(number) / WHOLE
        unit = int(np.where(state == 2, shares, -1.0).argmax())
        self.unit[number], self.after[number], self.ends = unit, len(self.unit), self.ends - 1
        for choice in (1, 0):
            state[unit] = choice
            self._add(state.copy(), shares.copy())

    def arrays(self) -> Arrays:
        """The arrays of a certificate."""
        tree, shares, ahead = list[int](), list[Shares](), [0]
        while ahead:
            number = ahead.pop()
            tree.append(self.unit[number])
            if tree[-1] < 0:
                shares.append(self.share[number])
            else:
                ahead += [self.after[number] + 1, self.after[number]]
        particles = self.branches.count.astype(np.uint8)
        arrays = np.array(tree, np.int32), particles, np.array(shares, np.uint16)
        return dict(zip(BRANCHES, arrays, strict=True))


@compiled
def _solve(system: System, state: State, shares: Floats, wanted: int, goal: float) -> float:
    """Move shares of free particles to the least energy, in pairs, and return a bound below it.

    It ends where the bound reaches the goal. The bound is inf where no choice has the wanted sum, or where
    particles are there of which no field has both: their entry of `mutual` is negative.
    """
    quadratic, sign, free, linear = system[0], system[3], np.nonzero(state == 2)[0], system[2].copy()
    fixed, due, negative = _fix(system, state, linear), wanted, 0
    for i in range(len(state)):
        due -= sign[i] * (state[i] == 1) - (state[i] == 2 and sign[i] < 0)
        negative += state[i] == 2 and sign[i] < 0
    if fixed == np.inf or due < 0 or due > len(free):
        return np.inf
    _fit_sum(state, sign, shares, due - negative)
    slope, order, bound = np.zeros(len(state)), np.empty(len(free)), fixed
    for sweep in range((_SWEEPS + 1) * (len(free) > 0)):
        slope[:] = 0.0
        for i in free:
            shares[i] = np.round(WHOLE * shares[i]) / WHOLE  # as in a certificate
            for j in free if shares[i] > 0 else free[:0]:
                slope[j] += 2 * quadratic[i, j] * shares[i]
        bound, energy = fixed, fixed
        for a in range(len(free)):
            i = free[a]
            bound -= shares[i] * slope[i] / 2
            energy += shares[i] * (linear[i] + slope[i] / 2)
            order[a] = sign[i] * (linear[i] + slope[i])
        order.sort()
        price = order[min(max(due - 1, 0), len(free) - 1)]
        bound += price * (due - negative)
        for i in free:
            bound += min(linear[i] + slope[i] - price * sign[i], 0.0)
        if sweep == _SWEEPS or bound >= goal or energy - bound < _CLOSE * abs(goal - bound):
            break
        _exchange(system, linear, slope, shares, free)
    return bound


@compiled_inside
def _fix(system: System, state: State, linear: Floats) -> float:
    """The energy of particles that are there, inf if no field has them; and what others add, in `linear`."""
    quadratic, mutual, fixed = system[0], system[1], 0.0
    for i in np.nonzero(state == 1)[0]:
        fixed += linear[i] + quadratic[i, i]
        for j in range(len(state)):
            if mutual[i, j] < 0 and state[j] == 1:
                return np.inf
            linear[j] += max(mutual[i, j], 0.0) + 2 * quadratic[i, j]
    return fixed


@compiled_inside
def _fit_sum(state: State, sign: Indices, shares: Floats, wanted: int) -> None:
    """Let shares of free particles have the wanted sum, and others none."""
    need, room = float(wanted), 0.0
    for k in range(len(state)):
        shares[k] *= state[k] == 2
        need -= sign[k] * shares[k]
    for i in np.nonzero(state == 2)[0]:
        room += 1 - shares[i] if sign[i] * need > 0 else shares[i]
    for i in np.nonzero(state == 2)[0] if room > 0 else np.nonzero(state > 2)[0]:
        shares[i] += sign[i] * need * (1 - shares[i] if sign[i] * need > 0 else shares[i]) / room


@compiled_inside
def _has_room(share: float, up: bool) -> bool:
    """Whether a share in [0, 1] can grow, or else become less."""
    return share < 1 if up else share > 0


@compiled_inside
def _exchange(system: System, linear: Floats, slope: Floats, shares: Floats, free: Indices) -> None:
    """Exchange shares between pairs of particles that gain most, about as many as there are."""
    quadratic, sign = system[0], system[3]
    for _ in range(len(free) // 2 + 1):
        low, most, best, i, j = np.inf, 0.0, 0.0, free[0], free[0]
        for k in free:
            value = sign[k] * (linear[k] + slope[k])
            if value < low and _has_room(shares[k], sign[k] > 0):
                low, i = value, k
        for k in free if low < np.inf else free[:0]:
            gain = sign[k] * (linear[k] + slope[k]) - low
            if gain > _STILL and _has_room(shares[k], sign[k] < 0):
                curve = quadratic[i, i] + quadratic[k, k] - 2 * sign[i] * sign[k] * quadratic[i, k]
                step = gain / (2 * max(curve, _FLAT))
                if gain * step > most:
                    most, best, j = gain * step, step, k
        if most == 0.0:
            break
        best = min(best, 1 - shares[i] if sign[i] > 0 else shares[i])
        best = min(best, shares[j] if sign[j] > 0 else 1 - shares[j])
        shares[i] += sign[i] * best
        shares[j] -= sign[j] * best
        for k in free:
            slope[k] += 2 * best * (sign[i] * quadratic[i, k] - sign[j] * quadratic[j, k])
