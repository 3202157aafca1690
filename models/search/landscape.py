"""The least energy as a function of the jumps, and its change for each single change of a jump.

For given jumps the least energy over the angles is E(p) = c - b'Gb with G the inverse of H
(models/instance/least_squares.py). On a patch of some hundred pixels G is a small dense matrix. A jump p_e
of the pair (i, j) of weight w that changes by d

- moves A_e by q = d pi/2: with r = e_i - e_j on alpha, b changes by -2 w q r;
- if d is odd, turns the sign of the coupling of beta_i and beta_j: H changes in two entries by 4 w (-1)^p,
  which by the formula of Woodbury changes G by a matrix of rank 2.

So the gain of every change of one jump is a short formula in off-diagonal entries of G, and making a change
costs one update of G. Angles outside the patch stay as they are; the energy is the energy of the whole field.

Updates lose digits. Where the parities of all jumps fit together and every stroke has the same sign of beta,
(alpha + c, beta -+ c) costs w_beta alone. Then H has an eigenvalue of about w_beta, and a jump that ends this
state takes the difference of numbers as large as 1 / w_beta. So after every change the energy is computed
from its definition (`Landscape.defined_energy`). If the updates give another energy, G is computed again.
Gains that no energy can have are discarded too.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import ClassVar, Final, NamedTuple

import numpy as np
from scipy.linalg.blas import dgemm

from ..field.field import energy_of
from ..instance.angles import HALF
from ..instance.domain import Bools, Floats, Ints
from ..instance.instance import Instance
from ..instance.least_squares import residuals_at
from ..instance.sparse_systems import PULL
from ..instance.terms import PairTerms, parity_sign
from ..orthogonal.energy import OrthogonalEnergy
from .box_qp import stroke_bounds

STEPS: Final = np.array([1, -1], dtype=np.int32)  # changes of one jump in the rows of `gains`

_HOLD: Final = 1e4  # weight that holds an angle at its bound, against stiffnesses of 1 to 20
_OUTSIDE: Final = 1e-4  # radians by which an angle may pass its bound before it is held
_SOFTEST: Final = 1e-6  # price of beta below which G grows so large that updates lose their digits
_MOST_HOLDS: Final = 60
_DRIFT: Final = 1e-8  # error of updates, relative to 1 + energy, beyond which everything is solved anew


class FieldPoint(NamedTuple):
    """Angles (alpha, beta) (2n,) and jumps (m,) of the whole field, and their 2-norm energy."""

    energy: float
    x: Floats
    p: Ints


class _State(NamedTuple):
    inverse: Floats
    x: Floats
    p: Ints
    energy: float
    held: dict[int, float]


@dataclass(frozen=True, eq=False)
class Patch:
    """Pixels whose angles are free and the pairs inside, by local numbers.

    pixels: (k,) numbers of pixels; pairs: (e,) numbers of the pairs with both ends inside; terms: their
    residuals, by local numbers of pixels.
    """

    instance: Instance
    pixels: Ints
    pairs: Ints
    terms: PairTerms

    @classmethod
    def of(cls, instance: Instance, free: Bools) -> Patch:
        """The patch of the pixels that are free; free has shape (n,)."""
        grid = instance.grid
        pixels = np.nonzero(free)[0].astype(np.int32)
        number = np.full(grid.size, -1, dtype=np.int32)
        number[pixels] = np.arange(len(pixels), dtype=np.int32)
        pairs = np.nonzero(free[grid.first] & free[grid.second])[0].astype(np.int32)
        return cls(instance, pixels, pairs, instance.pair_terms.select(pairs, number))

    @property
    def unknowns(self) -> Ints:
        """Places of the patch's angles in (alpha, beta), shape (2k,)."""
        return np.concatenate([self.pixels, self.pixels + self.instance.grid.size])


class Landscape:
    """The least energy over a patch's angles at jumps that change step by step; angles outside stay.

    energy: of the whole field, by its definition, plus penalties. A stiff penalty keeps angles within their
    bounds at every step, to about 1e-4; without it walks lead to points that look low and are not. Raises
    LinAlgError when the jumps lead to a system that double precision cannot solve.
    """

    patience: ClassVar = 4

    def __init__(self, patch: Patch, x: Floats, p: Ints) -> None:
        """Start at the angles x (2n,), which are solved for inside the patch, and jumps p (m,)."""
        self.patch = patch
        self.p = p.copy()
        self._around = x
        soft = max(PULL, _SOFTEST - patch.instance.skew_coefficient)
        self._soft = np.repeat([PULL, soft], len(patch.pixels))
        self._lower, self._upper = (end[patch.unknowns] for end in stroke_bounds(patch.instance))
        self._held: dict[int, float] = {}
        self._solve()
        self._settle()

    @property
    def angles(self) -> Floats:
        """The angles (alpha, beta) of the whole field, shape (2n,)."""
        return self._with_patch(self._x)

    @property
    def point(self) -> FieldPoint:
        """The field within its bounds, with its energy by definition."""
        inside = np.clip(self._x, self._lower, self._upper)
        return FieldPoint(self.defined_energy(inside), self._with_patch(inside), self.p.copy())

    @property
    def bounded_energy(self) -> float:
        """The energy by definition of the field within its bounds."""
        return self.point.energy

    @property
    def offsets(self) -> Floats:
        """The turn of labels of each pair of the patch, (e,), in radians."""
        return self.patch.terms.offset(self.p[self.patch.pairs])

    def at(self, jumps: Ints) -> Landscape:
        """The landscape at other jumps (m,), computed anew."""
        return Landscape(self.patch, self.angles, jumps)

    def _with_patch(self, inside: Floats) -> Floats:
        """The angles (2n,) of the whole field with these angles (2k,) inside the patch."""
        x = self._around.copy()
        x[self.patch.unknowns] = inside
        return x

    def defined_energy(self, inside: Floats) -> float:
        """The 2-norm energy of the field by its definition, with these angles (2k,) inside the patch."""
        alpha, beta = np.split(self._with_patch(inside), 2)
        return energy_of(self.patch.instance, alpha, beta, self.p).total

    def save_state(self) -> _State:
        """A state for `restore`."""
        return _State(
            self._inverse.copy(order="F"), self._x.copy(), self.p.copy(), self.energy, dict(self._held)
        )

    def restore(self, state: _State) -> None:
        """Restore a saved state."""
        self._inverse, self._x, self.p = state.inverse.copy(order="F"), state.x.copy(), state.p.copy()
        self.energy, self._held, self._fresh = state.energy, dict(state.held), False

    def gains(self) -> Floats:
        """Change of the energy for each change of one jump, (2, e), rows as in STEPS; inf where unknown."""
        gains = self._gains()
        if np.isinf(gains).any() and not self._fresh:
            self._solve()
            gains = self._gains()
        return gains

    def _gains(self) -> Floats:
        """The gains by the present inverse, infinite where they are impossible."""
        g, x, terms = self._inverse, self._x, self.patch.terms
        i, j, k = terms.first, terms.second, len(self.patch.pixels)
        p, w = self.p[self.patch.pairs], terms.weighted(np.ones(len(i)))
        a = terms.residual_a(x, p)
        give = g[i, i] + g[j, j] - 2 * g[i, j]
        at_i, at_j = i + k, j + k
        to_i, to_j = g[at_i, i] - g[at_i, j], g[at_j, i] - g[at_j, j]
        ii, jj, ij = g[at_i, at_i], g[at_j, at_j], g[at_i, at_j] + parity_sign(p) / (4 * w)
        q = HALF * STEPS[:, None]
        y_i, y_j = x[at_i] - 2 * w * q * to_i, x[at_j] - 2 * w * q * to_j
        # 16 w^2 (ij^2 - ii jj) is det(H + C) / det(H), of two definite matrices.
        ratio = ij**2 - ii * jj
        with np.errstate(all="ignore"):
            turned = (2 * ij * y_i * y_j - jj * y_i**2 - ii * y_j**2) / ratio
            gains: Floats = w * (2 * q * q * (1 - 2 * w * give) + 4 * q * a) + turned
            believed = np.isfinite(gains) & (ratio > 0) & (gains >= -self.energy * (1 + _DRIFT) - _DRIFT)
        gains[~believed] = np.inf
        return gains

    def step(self, row: int, place: int) -> None:
        """Make the step with these numbers in `gains`."""
        self.change(np.array([place]), STEPS[[row]])

    def change(self, pairs: Ints, steps: Ints) -> None:
        """Add steps (c,) to the jumps of the patch's pairs with those local numbers, each at most once."""
        try:
            self._update_for_change(pairs, steps)
        except np.linalg.LinAlgError:
            self.energy = np.nan  # which is not an energy, so that everything is solved anew
        self.p[self.patch.pairs[pairs]] += steps
        self._settle()

    def _update_for_change(self, pairs: Ints, steps: Ints) -> None:
        """Update energy, angles and inverse after a change of jumps."""
        self._fresh = False
        push, gain = self._push_of(pairs, steps)
        touched = np.nonzero(push)[0]
        moved = self._inverse[:, touched] @ push[touched]
        self.energy += gain - float(push[touched] @ moved[touched])
        self._x += moved
        places, added = self._couplings(pairs, steps)
        if len(places):
            # With C = `added`, H + C has the inverse G - G C (1 + G C)^-1 G.
            columns = self._inverse[:, places]
            small = added @ np.linalg.inv(np.eye(len(places)) + columns[places] @ added)
            here = self._x[places]
            self.energy += float(here @ small @ here)
            self._x -= columns @ (small @ here)
            self._update(-1.0, columns @ small, columns)

    def _solve(self) -> None:
        """Compute inverse, angles and energy from the jumps and from the held angles."""
        places = self.patch.unknowns
        energy = residuals_at(self.patch.instance, self.p)
        rows = energy.normal_matrix[places]
        outside = self._around.copy()
        outside[places] = 0.0
        right = energy.right_side[places] - rows @ outside
        held = list(self._held)
        right[held] += _HOLD * np.array(list(self._held.values()))
        system = rows[:, places].toarray()
        system[np.diag_indices(len(places))] += self._soft
        system[held, held] += _HOLD
        inverse = np.linalg.inv(system)
        self._inverse = np.asfortranarray((inverse + inverse.T) / 2)
        self._x = self._inverse @ right
        self._x += self._inverse @ (right - system @ self._x)
        if not np.isfinite(self._x).all():
            raise np.linalg.LinAlgError("the angles of a patch are not finite")
        self.energy = self._defined_energy()
        self._fresh = True

    def _settle(self) -> None:
        """Keep the bounds; solve anew if the updates have lost the energy, then keep the bounds again."""
        for _ in range(2):
            with suppress(np.linalg.LinAlgError):
                self._keep_bounds()
                if self._matches_definition():
                    return
            self._solve()

    def _matches_definition(self) -> bool:
        """Whether the updates give the energy of the angles; from now on the energy is the defined one."""
        followed, self.energy = self.energy, self._defined_energy()
        return bool(abs(followed - self.energy) <= _DRIFT * (1 + self.energy))

    def _defined_energy(self) -> float:
        """The energy of the present angles with all penalties."""
        held = self._x[list(self._held)] - list(self._held.values())
        pulls = float(self._soft @ (self._x * self._x)) + _HOLD * float(held @ held)
        return self.defined_energy(self._x) + pulls

    def _push_of(self, pairs: Ints, steps: Ints) -> tuple[Floats, float]:
        """The change of b, shape (2k,), and the change of c - 2 x'b."""
        terms, q = self.patch.terms.select(pairs), HALF * steps.astype(np.float64)
        a = terms.residual_a(self._x, self.p[self.patch.pairs[pairs]])
        push, pull = np.zeros(len(self._x)), terms.weighted(2 * q)
        np.subtract.at(push, terms.first, pull)
        np.add.at(push, terms.second, pull)
        # c changes by the sum of w (2 q^2 + 4 q (pi/2 p)).
        return push, float(np.sum(terms.weighted(2 * q * q + 4 * q * a)))

    def _couplings(self, pairs: Ints, steps: Ints) -> tuple[Ints, Floats]:
        """The unknowns beta whose couplings turn, shape (c,), and the additions to H there, shape (c, c)."""
        odd = pairs[(steps & 1) == 1]
        turned = self.patch.terms.select(odd)
        ends = np.concatenate([turned.first, turned.second])
        places, where = np.unique(ends, return_inverse=True)
        first, second = where[: len(odd)], where[len(odd) :]
        added = np.zeros((len(places), len(places)))
        signs = turned.weighted(parity_sign(self.p[self.patch.pairs[odd]]))
        added[first, second] = added[second, first] = 4 * signs
        return places + len(self.patch.pixels), added

    def _update(self, factor: float, left: Floats, right: Floats) -> None:
        self._inverse = dgemm(factor, left, right, beta=1.0, c=self._inverse, trans_b=1, overwrite_c=1)

    def _keep_bounds(self) -> None:
        """Hold angles that pass their bounds, the worst first, and release those that move inwards."""
        for _ in range(_MOST_HOLDS):
            past = np.maximum(self._x - self._upper, self._lower - self._x)
            past[list(self._held)] = 0.0
            worst = int(np.argmax(past))
            if past[worst] > _OUTSIDE:
                upper = self._x[worst] > self._upper[worst]
                self._held[worst] = float((self._upper if upper else self._lower)[worst])
                self._pull(worst, self._held[worst], _HOLD)
                continue
            leaving = next((k for k, bound in self._held.items() if self._leans_in(k, bound)), None)
            if leaving is None:
                return
            self._pull(leaving, self._held.pop(leaving), -_HOLD)

    def _leans_in(self, place: int, bound: float) -> bool:
        inwards = -1.0 if bound == self._upper[place] else 1.0
        return bool(inwards * (self._x[place] - bound) > 0)

    def _pull(self, place: int, goal: float, weight: float) -> None:
        """Add weight (x - goal)^2 to the energy."""
        column = self._inverse[:, [place]]
        stiffer = 1 + weight * column[place, 0]
        if not stiffer > 0:
            raise np.linalg.LinAlgError("rounding has made the inverse of a patch indefinite")
        share = weight / stiffer
        off = goal - self._x[place]
        self.energy += share * off * off
        self._x += column[:, 0] * (share * off)
        self._update(-share, column, column)


class IntegerLandscape:
    """The least energy of orthogonal crosses at integers p (r,) that change step by step."""

    patience: ClassVar = 1

    def __init__(self, terms: OrthogonalEnergy, p: Ints) -> None:
        """Start at integers p."""
        self.terms, self.p = terms, p.copy()
        self._residual = terms.residuals(terms.fit_angles(p), p)
        self.energy = terms.total(self._residual)

    @property
    def bounded_energy(self) -> float:
        """The energy by definition: no angle has bounds, residuals have limits with prescribed indices."""
        return self.energy if self.terms.sums is None else self.terms.least_total(self.p)

    @property
    def offsets(self) -> Floats:
        """The turn of labels of each row, (r,), in radians."""
        return self.terms.constant + HALF * self.p

    def at(self, jumps: Ints) -> IntegerLandscape:
        """The landscape at other integers, computed anew."""
        return IntegerLandscape(self.terms, jumps)

    def gains(self) -> Floats:
        """Change of the energy for the better step of each integer, (1, r)."""
        return self.terms.gains(self._residual)[None]

    def step(self, _: int, place: int) -> None:
        """Make the better step of an integer."""
        self.change(np.array([place]), self.terms.better_steps(self._residual[[place]]))

    def change(self, rows: Ints, steps: Ints) -> None:
        """Add steps (c,) to the integers with those numbers, each at most once, if they keep all sums."""
        if not self.terms.keeps_sums(rows, steps):
            return
        self._residual = self.terms.step_residuals(self._residual, rows, steps)
        self.p = self.p.copy()  # others may keep the integers so far
        self.p[rows] += steps
        self.energy = self.terms.total(self._residual)

    def save_state(self) -> tuple[Ints, Floats, float]:
        """A state for `restore`."""
        return self.p.copy(), self._residual, self.energy

    def restore(self, state: tuple[Ints, Floats, float]) -> None:
        """Restore a saved state."""
        self.p, self._residual, self.energy = state[0].copy(), *state[1:]
