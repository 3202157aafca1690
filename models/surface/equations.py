"""The energy that a surface over crosses minimises, with its slope and curvature, and the descent."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from scipy import sparse

from ..instance.grid import Floats
from ..processes.deadline import Over
from ..smooth.systems import factored
from .stencils import Crosses, Stencils, scaled

CONJUGACY: Final = 0.1  # from 0.01 to 10 the surfaces of docs/surface.md differ by tenths of a degree
FORGIVEN: Final = 0.007  # cosine of the angle in space from which a cross counts less and less
_ROUNDS: Final = 60  # of the descent by Levenberg and Marquardt; 5 to 25 are usual
_TRIALS: Final = 12  # increases of the damping in a round
_FALL: Final = 2e-4  # least share of the energy that a round has to remove before another one
_DAMPING: Final = 1e-2
_LEAST: Final = 1e-9
_UP: Final = 5.0
_DOWN: Final = 8.0


@dataclass(frozen=True)
class Weights:
    """Weights of a surface's energy besides the equations of its crosses, as in `Equations`."""

    even: float
    facing: float
    forgiven: float = np.inf


@dataclass(frozen=True, eq=False)
class Rows:
    """Squares that are linear in the heights: sum of (matrix z - goal)^2."""

    matrix: Any
    goal: Floats


@dataclass(frozen=True, eq=False)
class Equations:
    """The energy of heights z (N,) over the crosses at n pixels.

    With g = grad z, sums over pixels, blocks of 2 x 2 pixels and pairs of neighbours:

        right angles   r = (u.v + (u.g)(v.g)) / sqrt((1 + (u.g)^2)(1 + (v.g)^2)),  s^2 log(1 + r^2 / s^2)
        conjugacy      CONJUGACY n / 2 ((u . d_v g)^2 + (v . d_u g)^2)
        even           even n |N_i - N_j|^2 of unit normals
        facing         facing log(1 + |g|^2), which is -2 log N_z

    r is the cosine of the angle between both lines in space; s is `forgiven`. extra: more squares, of hints.
    """

    stencils: Stencils
    crosses: Crosses
    weights: Weights
    extra: Sequence[Rows] = ()

    @cached_property
    def _lines(self) -> tuple[Floats, Floats]:
        return self.crosses.lines

    @cached_property
    def _along(self) -> tuple[Any, Any]:
        """The matrices (n, N) of the slopes along u and v."""
        first, second = (_along(self.stencils.slopes, line) for line in self._lines)
        return first, second

    @cached_property
    def conjugacy(self) -> Any:
        """The matrix (2b, N) of u . d_v g, then of v . d_u g, at the centres of blocks."""
        # Derivatives there are central: at a steep border, one-sided ones would cause large errors.
        blocks = self.stencils.blocks
        count = blocks.shape[1]
        at = (np.tile(np.arange(count), 4), blocks.ravel())
        mean = sparse.csr_array((np.full(4 * count, 0.25), at), shape=(count, self.stencils.grid.size))
        u, v = self.crosses.averaged(mean).lines
        return sparse.vstack([self._second(u, v), self._second(v, u)])

    def _second(self, line: Floats, other: Floats) -> Any:
        """The matrix (b, N) of line . d_other g."""
        return sum(
            scaled(_along(self.stencils.changes, other) @ slope, line[:, axis])
            for axis, slope in enumerate(self.stencils.slopes)
        )

    @cached_property
    def _squares(self) -> tuple[Rows, Any]:
        """All squares that are linear, and the matrix (N, N) of their sum."""
        size = self.stencils.grid.size
        conjugacy = np.sqrt(CONJUGACY * size / 2) * self.conjugacy
        twist = np.sqrt(self.weights.even * size / 10) * self.stencils.twist
        matrix = sparse.vstack([conjugacy, twist, *(rows.matrix for rows in self.extra)]).tocsr()
        plain = np.zeros(conjugacy.shape[0] + twist.shape[0])
        goal = np.concatenate([plain, *(rows.goal for rows in self.extra)])
        return Rows(matrix, goal), matrix.T @ matrix

    def right_angles(self, z: Floats) -> Floats:
        """The cosines r (n,) of the angles in space between both lines."""
        u, v = self._lines
        a, b = (along @ z for along in self._along)
        return np.asarray((np.sum(u * v, axis=1) + a * b) / np.sqrt((1 + a * a) * (1 + b * b)))

    def energy(self, z: Floats) -> float:
        """The energy of heights."""
        linear, _ = self._squares
        cosine, scale = self.right_angles(z), self.weights.forgiven
        plain = np.isinf(scale)
        loss = np.sum(cosine**2) if plain else scale**2 * np.sum(np.log1p((cosine / scale) ** 2))
        normals = normals_of(self.stencils, z)
        uneven = sum(normal @ (self.stencils.unevenness @ normal) for normal in normals)
        return float(
            loss
            + np.sum((linear.matrix @ z - linear.goal) ** 2)
            + self.weights.even * normals.shape[1] * uneven
            - 2 * self.weights.facing * np.sum(np.log(normals[2]))
        )

    def model(self, z: Floats) -> tuple[Floats, Any]:
        """Half the slope (N,) of the energy at z, and half its curvature (N, N) by Gauss and Newton."""
        linear, squares = self._squares
        down, angles = self._of_angles(z)
        even, bend = self._of_normals(z)
        upright = self.weights.facing * normals_of(self.stencils, z)[2] ** 2
        to_slopes = sparse.vstack(self.stencils.slopes).tocsr()
        facing = np.concatenate([upright, upright])
        inner = angles + bend + sparse.diags_array(facing)
        slope = to_slopes.T @ (down + even + facing * (to_slopes @ z))
        slope += linear.matrix.T @ (linear.matrix @ z - linear.goal)
        return slope, to_slopes.T @ (inner @ to_slopes) + squares

    def _of_angles(self, z: Floats) -> tuple[Floats, Any]:
        """Slope (2n,) and curvature (2n, 2n) of the right angles by dz/dx, then dz/dy, of all pixels."""
        u, v = self._lines
        cosine = self.right_angles(z)
        a, b = (along @ z for along in self._along)
        long_a, long_b = 1 + a * a, 1 + b * b
        both = np.sqrt(long_a * long_b)
        change = u.T * (b / both - cosine * a / long_a) + v.T * (a / both - cosine * b / long_b)
        weighed = change / (1 + (cosine / self.weights.forgiven) ** 2)
        every = np.arange(len(cosine))
        return (weighed * cosine).ravel(), _in_blocks(weighed[:, None] * change, every, every, len(every))

    def _of_normals(self, z: Floats) -> tuple[Floats, Any]:
        """The same of the unevenness of the normals."""
        normals, change = normals_of(self.stencils, z), changes_of_normals(self.stencils, z)
        weight = self.weights.even * normals.shape[1]
        uneven = self.stencils.unevenness.tocoo()
        row, column = uneven.coords
        pulls = weight * (self.stencils.unevenness @ normals.T).T
        blocks = np.einsum("cak,cbk->abk", change[:, :, row], change[:, :, column])
        slope: Floats = np.einsum("cak,ck->ak", change, pulls).ravel()
        return slope, _in_blocks(weight * uneven.data * blocks, row, column, normals.shape[1])


def normals_of(stencils: Stencils, z: Floats) -> Floats:
    """The unit normals of the pixels, with their parts x, y and z one below the other: shape (3, n)."""
    x, y = (slope @ z for slope in stencils.slopes)
    return np.asarray(np.stack([-x, -y, np.ones_like(x)]) / np.sqrt(1 + x * x + y * y))


def changes_of_normals(stencils: Stencils, z: Floats) -> Floats:
    """Derivatives of the parts of the normals by dz/dx and dz/dy at the same pixel: shape (3, 2, n)."""
    x, y = (slope @ z for slope in stencils.slopes)
    changes: Floats = np.array([[-1 - y * y, x * y], [x * y, -1 - x * x], [-x, -y]])
    changes *= (1 + x * x + y * y) ** -1.5
    return changes


def _in_blocks(values: Floats, row: Any, column: Any, size: int) -> Any:
    """The matrix (2n, 2n) of 2 x 2 blocks (n, n) with values (2, 2, k) at these places; n = size."""
    places = [
        np.concatenate([each + size * block[axis] for block in np.ndindex(2, 2)])
        for axis, each in enumerate((row, column))
    ]
    return sparse.csr_array((values.ravel(), tuple(places)), shape=(2 * size, 2 * size))


def descended(equations: Equations, z: Floats, over: Over) -> tuple[float, Floats]:
    """Minimise from heights z, until there is hardly any gain; return the energy reached and its heights."""
    energy, damping = equations.energy(z), _DAMPING
    for _ in range(_ROUNDS):
        if over():
            break
        slope, curvature = equations.model(z)
        diagonal = sparse.diags_array(curvature.diagonal())
        for _ in range(_TRIALS):
            tried = z - factored(curvature + damping * diagonal)(slope)
            reached = equations.energy(tried)
            if reached < energy:
                break
            damping *= _UP
        else:
            break
        fallen, z, energy = energy - reached, tried, reached
        damping = max(damping / _DOWN, _LEAST)
        if fallen <= _FALL * (energy + fallen):
            break
    return energy, z


def _along(matrices: tuple[Any, Any], line: Floats) -> Any:
    """The derivative along a line of directions (k, 2), from those by x and y."""
    return scaled(matrices[0], line[:, 0]) + scaled(matrices[1], line[:, 1])
