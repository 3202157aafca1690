"""The energy of orthogonal crosses as a function of their jumps, and its change by one jump.

Every pair and stroke is a row with the residual r = M alpha + c + pi/2 z and an integer z: the jump of a
pair, or the quarter turns between a stroke and the label of its cross. M is the incidence matrix of a graph
whose edges are the rows. Strokes lead to one further vertex, the ground, whose angle is 0. At the best angles
the energy is sum omega r^2. A step of z_k by 1 or -1 changes it by omega_k (pi^2/4 (1 - omega_k R_k) + x)
with x = pi r_k or -pi r_k, where R_k is the effective resistance between the ends of row k.

Where an instance prescribes indices, some sums of integers are fixed, and no residual exceeds pi/4.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Final, Self

import numpy as np
from scipy import sparse

from ..errors import InstanceError
from ..field.field import CrossField, field_in_windows
from ..field.jumps import step_labels
from ..instance.angles import HALF, QUARTER, SLACK
from ..instance.cycles import Forest, grow_forest
from ..instance.domain import Bools, Floats, Ints
from ..instance.instance import Instance
from ..instance.least_squares import RightAngles
from ..instance.mesh import Mesh
from ..processes.deadline import IsOver, never

_MOST_LIMITS: Final = 1000  # residuals that are held at their limits
MOST_DENSE: Final = 6000
"""Points up to which the inverse of the matrix is kept: 288 MB."""


def lowered(total: float, share: float = 1e-9) -> float:
    """The energy below which another one counts as lower: less by `share` of 1 + total may be rounding."""
    return total - share * (1 + total) if total < np.inf else total


def takes_integers(instance: Instance) -> bool:
    """Whether fields of an instance begin with these integers: its crosses are orthogonal, or on a mesh."""
    return instance.orthogonal or isinstance(instance.domain, Mesh)


@dataclass(frozen=True, eq=False)
class OrthogonalEnergy(RightAngles):
    """The energy of crosses with beta = 0 at given integers z (r,): those of pairs, then of strokes.

    sums: sparse matrix (k, r) whose products with integers have the values `turns`, (k,), along the rings of
    prescribed indices; None where there are none.
    """

    sums: Any = None
    turns_along: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int32))

    @classmethod
    def of(cls, instance: Instance) -> Self:
        """The energy of an instance as if all its crosses were orthogonal, with its prescribed indices."""
        energy, rings = super().of(instance), instance.prescribed_rings
        if rings is None:
            return energy
        shape = (len(rings.turns), len(energy.first))
        sums = sparse.csr_array((rings.sign, rings.pair, rings.start), shape=shape).tocsc()
        return replace(energy, sums=sums, turns_along=rings.turns)

    @cached_property
    def is_held(self) -> Bools:
        """Whether each row is along a ring of a prescribed index, so that it cannot change alone, (r,)."""
        if self.sums is None:
            return np.zeros(len(self.first), dtype=bool)
        return np.asarray(np.diff(self.sums.indptr) > 0)

    def keeps_sums(self, rows: Ints, steps: Ints) -> bool:
        """Whether steps (c,) of the integers of rows, each at most once, keep all prescribed sums."""
        return not self.is_held[rows].any() or not (self.sums[:, rows] @ steps).any()

    def with_sums(self, z: Ints) -> Ints:
        """The integers with the prescribed sums; what a ring lacks goes the shortest way to a free ring."""
        if self.sums is None:
            return z
        z, lacking, (ends, forest) = z.copy(), self.turns_along - self.sums @ z, self._ways
        lacking = np.append(lacking, 0)
        for depth in range(forest.depth.max(), 0, -1):
            ring = np.nonzero(forest.depth == depth)[0]
            row, lack = forest.pair[ring], lacking[ring]
            forward = ends[0, row] == ring
            z[row] += np.where(forward, lack, -lack)
            np.add.at(lacking, np.where(forward, ends[1, row], ends[0, row]), lack)
        return z

    def with_charges(self, z: Ints, walks: sparse.csr_array, charges: Floats) -> Ints:
        """The integers (r,) next to z (r,) that give closed walks these charges (k,), in quarter turns.

        walks (k, r): signs of the rows along them.
        """
        turns = np.round(charges - walks @ (self.constant / HALF)).astype(np.int32)
        return replace(self, sums=walks.tocsc(), turns_along=turns).with_sums(z)

    @cached_property
    def _ways(self) -> tuple[Ints, Forest]:
        """The rings that a row is along, forwards and backwards, (2, r), and a forest towards free rings."""
        free, steps = len(self.turns_along), self.sums.tocoo()
        ends = np.full((2, len(self.first)), free, dtype=np.int32)
        ends[(steps.data < 0).astype(np.intp), steps.col] = steps.row
        rows = np.nonzero(self.is_held)[0].astype(np.int32)
        forest = grow_forest(free + 1, ends[0, rows], ends[1, rows], [free])
        return ends, replace(forest, pair=np.append(rows, -1)[forest.pair])

    def restrict(self, points: Ints, alpha: Floats) -> tuple[OrthogonalEnergy, Ints]:
        """The energy of the rows at some points, the angles of all others fixed; and these rows' numbers."""
        number = np.full(self.size + 1, len(points), dtype=np.int32)
        number[points] = np.arange(len(points), dtype=np.int32)
        first, second, fixed = number[self.first], number[self.second], alpha.copy()
        fixed[points] = 0.0
        rows = np.nonzero(np.minimum(first, second) < len(points))[0].astype(np.int32)
        constant = self.residuals(fixed, 0)[rows]
        patch = OrthogonalEnergy.between(len(points), first[rows], second[rows], constant, self.weight[rows])
        return patch if self.sums is None else replace(patch, sums=self.sums[:, rows]), rows

    def force(self, weight: Floats, z: Ints) -> Floats:
        """M' diag(weight) (c + pi/2 z), (n,)."""
        return np.asarray(self.matrix.T @ (weight * (self.constant + HALF * z)))

    def fit_angles(self, z: Ints) -> Floats:
        """The angles of least energy for integers z, (n,)."""
        return np.asarray(-self.solve_system(self.force(self.weight, z)))

    def fit_in_limits(self, z: Ints) -> Floats | None:
        """As `fit_angles`, with residuals of held rows and strokes of at most pi/4 if indices are prescribed.

        None if there are no such angles, or if more than 1,000 residuals are at their limits. An active-set
        method: the multipliers of all limits that were exceeded so far are a least-squares problem without
        negative numbers (Lawson and Hanson 1974).
        """
        free, sides = self.fit_angles(z), np.zeros(len(z))
        alpha, limited = free, self.is_held | (self.second == self.size)
        while self.sums is not None:
            residual = self.residuals(alpha, z)
            beyond = np.where(limited & (np.abs(residual) > QUARTER + SLACK), np.sign(residual), 0.0)
            if not beyond.any():
                break
            new = beyond * (sides == 0)
            sides += new
            rows = np.nonzero(sides)[0]
            if not new.any() or len(rows) > _MOST_LIMITS:
                return None
            from scipy.optimize import nnls  # takes long to load, and few fields come here

            normals = sparse.diags_array(sides[rows]) @ self.matrix[rows]
            moves = self.solve_system(normals.T.toarray())
            root = np.linalg.cholesky(normals @ moves + 1e-12 * np.eye(len(rows)))
            excess = sides[rows] * self.residuals(free, z)[rows] - QUARTER
            alpha = free - moves @ nnls(root.T, np.linalg.solve(root, excess))[0]
        return alpha

    def residuals(self, alpha: Floats, z: Ints | int) -> Floats:
        """The residual of each row in radians, (r,), of the angles alpha (n,)."""
        return self.at(alpha) + HALF * z

    def total(self, residual: Floats) -> float:
        """The sum of omega r^2."""
        return float(self.weight @ (residual * residual))

    def least_total(self, z: Ints) -> float:
        """The energy of integers z at their best angles; inf if these have no residuals within the limits."""
        alpha = self.fit_in_limits(z)
        return np.inf if alpha is None else self.total(self.residuals(alpha, z))

    def turns(self, alpha: Floats) -> Floats:
        """The real z at which each residual is 0, (r,); rounded, because errors must not decide ties."""
        turns: Floats = np.round(-self.residuals(alpha, 0) / HALF, 9)
        return turns

    def nearest(self, alpha: Floats) -> Ints:
        """The minimum-energy integers at given angles, (r,), changed to the prescribed sums."""
        return self.with_sums(np.round(self.turns(alpha)).astype(np.int32))

    @cached_property
    def _inverse(self) -> Floats:
        """The inverse of the matrix with a row and a column of zeros for the ground."""
        inverse = np.zeros((self.size + 1, self.size + 1))
        inverse[:-1, :-1] = self.solve_system(np.eye(self.size))
        return inverse

    @cached_property
    def stiffness(self) -> Floats:
        """Energy of a quarter turn in each row alone, over pi^2/4: omega (1 - omega R), (r,)."""
        diagonal, between = np.diagonal(self._inverse), self._inverse[self.first, self.second]
        resistance = diagonal[self.first] + diagonal[self.second] - 2 * between
        return np.maximum(self.weight * (1 - self.weight * resistance), 0.0)

    def gains(self, residual: Floats) -> Floats:
        """Change of the energy by the better step of each integer, (r,), as of `better_steps`; inf if held.

        residual: that of the best angles for the present integers; angles follow the step.
        """
        change: Floats = HALF * HALF * self.stiffness - 2 * HALF * self.weight * np.abs(residual)
        return np.where(self.is_held, np.inf, change)

    def better_steps(self, residual: Floats) -> Ints:
        """The better step of each integer, 1 or -1: against the sign of its residual."""
        return np.where(residual > 0, -1, 1).astype(np.int32)

    def step_residuals(self, residual: Floats, rows: Ints, steps: Ints) -> Floats:
        """The residuals of the best angles after steps of some integers, from those before them, (r,).

        rows: numbers of the rows, each once, (k,). steps: what is added to their integers, (k,).
        """
        force = HALF * steps * self.weight[rows]
        drop = force @ self._inverse[self.first[rows]] - force @ self._inverse[self.second[rows]]
        changed: Floats = residual - drop[self.first] + drop[self.second]
        changed[rows] += HALF * steps
        return changed

    def descend(self, z: Ints, is_over: IsOver = never) -> Ints:
        """Change single integers, the one of greatest gain first, until none lowers the energy.

        With more than 6,000 points, round all to the best angles in turn. Gains lose their digits where
        weights differ by many orders of magnitude. So a change has to lower the energy of the residuals,
        which always is one of some angles, and no integers come twice.
        """
        z, residual = z.copy(), self.residuals(self.fit_angles(z), z)
        total, failed = self.total(residual), np.zeros(len(z), dtype=bool)
        while len(z) and self.size <= MOST_DENSE and not is_over():
            change = np.where(failed, 0.0, self.gains(residual))
            row = np.argmin(change, keepdims=True).astype(np.int32)
            if total + change[row[0]] >= lowered(total):
                break
            step = self.better_steps(residual[row])
            moved = self.step_residuals(residual, row, step)
            reached = self.total(moved)
            failed[row] = reached >= lowered(total)
            if not failed[row]:
                z[row] += step
                residual, total, failed[:] = moved, reached, False
        while self.size > MOST_DENSE and not is_over():
            steps = np.where(self.is_held, 0.0, np.round(np.round(residual / HALF, 9)))
            nearest = z - steps.astype(np.int32)
            moved = self.residuals(self.fit_angles(nearest), nearest)
            if self.total(moved) >= lowered(total):
                break
            z, residual, total = nearest, moved, self.total(moved)
        return z


def integers_of(field: CrossField) -> Ints:
    """The integers z of a field: its jumps, and 0 for strokes, whose label they determine."""
    return np.append(field.p, np.zeros(len(field.instance.theta), dtype=np.int32))


def field_of(instance: Instance, z: Ints, energy: OrthogonalEnergy) -> CrossField:
    """The field of integers z, (r,), with their best angles, within the windows of the instance.

    Windows change jumps and angles where a stroke deviates from its cross by more than pi/4, and under the
    gauge `box`. Otherwise the field has least energy for its jumps. Raises InstanceError if residuals of at
    most pi/4 do not reach the prescribed indices.
    """
    if (fitted := energy.fit_in_limits(z)) is None:
        raise InstanceError(
            f"no field was found on {instance.name} with the prescribed indices, as jumps need residuals "
            "above pi/4; prescribe fewer, or give a field with them as the start"
        )
    pairs = len(instance.domain.first)
    steps = np.zeros(instance.domain.size, dtype=np.int32)
    steps[instance.stroke_index] = z[pairs:]
    beta = np.zeros(instance.domain.size)
    alpha, _, p = step_labels(instance.domain, fitted, beta, z[:pairs], steps)
    return field_in_windows(instance, alpha, beta, p)
