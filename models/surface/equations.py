"""The energy that a surface over crosses minimises, with its slope and curvature, and the descent."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..instance.domain import Bools, Floats, Ints
from ..instance.least_squares import Residuals
from ..instance.sparse_systems import SimilarSystems, solve_banded
from ..processes.deadline import IsOver
from .stencils import SLOPES, Crosses, Stencils, scale_rows

CONJUGACY: Final = 0.1  # from 0.01 to 10 the surfaces of docs/surface.md differ by tenths of a degree
FORGIVEN: Final = 0.007  # cosine of the angle in space from which a cross counts less and less
_ROUNDS: Final = 300  # of the descent by Levenberg and Marquardt; 5 to 25 are usual
_TRIALS: Final = 12  # increases of the damping in a round
_FALL: Final = 2e-4  # least share of the energy that a round has to remove before another one
_FALL_OF_FEW: Final = 1e-8  # where a handful of pixels follows a curved valley in rounds of a millisecond
_FEW: Final = 100  # unknowns
_DAMPING: Final = 1e-2
_LEAST: Final = 1e-9
_RESIDUAL: Final = 0.05  # relative, of a system that is not solved as a band
_NARROW: Final = 160  # columns of a mask whose systems are solved as bands; wider ones take much memory
_STEPS: Final = 12  # of conjugate gradients, which take as long as a factorisation
_MEETING: Final = 2  # rows or columns between two heights that meet in a square
_PAIRS: Final = np.kron(SLOPES, SLOPES).T  # of two slopes, for each pair of corners
_UP: Final = 5.0
_DOWN: Final = 8.0


@dataclass(frozen=True)
class Weights:
    """Weights of a surface's energy besides the equations of its crosses, as in `Equations`."""

    even: float
    facing: float
    forgiven: float = np.inf


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
    extra: Sequence[Residuals] = ()

    @cached_property
    def _lines(self) -> Floats:
        """Unit vectors (2, 2, n) along u and v."""
        u, v = self.crosses.lines
        return np.stack([u.T, v.T])

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

    def _second(self, line: Floats, along: Floats) -> Any:
        """The matrix (b, N) of line . d_other g."""
        return sum(
            scale_rows(_along(self.stencils.changes, along) @ slope, line[:, axis])
            for axis, slope in enumerate(self.stencils.slopes)
        )

    @cached_property
    def _even(self) -> Any:
        """The matrix of the linear squares without goals: conjugacy and twist."""
        size = self.stencils.grid.size
        conjugacy = np.sqrt(CONJUGACY * size / 2) * self.conjugacy
        return sparse.vstack([conjugacy, np.sqrt(self.weights.even * size / 10) * self.stencils.twist])

    @cached_property
    def _linear(self) -> Residuals:
        """All residuals that are linear."""
        plain = np.zeros(self._even.shape[0])
        return Residuals.join([Residuals(self._even, plain, np.ones_like(plain)), *self.extra])

    @cached_property
    def _sum(self) -> BlockSum:
        """The sum of squares without goals, and of blocks of pixels and of neighbours in both orders."""
        grid, corners = self.stencils.grid, self.stencils.corners
        every = np.arange(grid.size, dtype=np.int32)
        first = np.concatenate([every, grid.first, grid.second])
        second = np.concatenate([every, grid.second, grid.first])
        constant = self._even.T @ self._even
        return BlockSum.of(constant, corners[:, first], corners[:, second], self.stencils.used)

    def right_angles(self, slopes: Floats) -> Floats:
        """The cosines r (n,) of the angles in space between both lines, by slopes (2, n)."""
        u, v = self._lines
        a, b = (np.sum(line * slopes, axis=0) for line in (u, v))
        return np.asarray((np.sum(u * v, axis=0) + a * b) / np.sqrt((1 + a * a) * (1 + b * b)))

    def energy(self, z: Floats) -> float:
        """The energy of heights."""
        slopes, scale = self.stencils.gradient(z), self.weights.forgiven
        cosine = self.right_angles(slopes)
        plain = np.isinf(scale)
        loss = np.sum(cosine**2) if plain else scale**2 * np.sum(np.log1p((cosine / scale) ** 2))
        normals = normals_of(slopes)
        uneven = np.sum(normals.T * (self.stencils.unevenness @ normals.T))
        return float(
            loss
            + self._linear.energy(z)
            + self.weights.even * normals.shape[1] * uneven
            - 2 * self.weights.facing * np.sum(np.log(normals[2]))
        )

    def model(self, z: Floats) -> tuple[Floats, Any]:
        """Half the slope (N,) of the energy at z, and half its curvature (N, N) by Gauss and Newton."""
        slopes = self.stencils.gradient(z)
        normals = normals_of(slopes)
        down, angles = self._of_angles(slopes)
        even, blocks = self._of_normals(slopes, normals)
        facing = self.weights.facing * normals[2] ** 2
        blocks[:, :, : len(facing)] += angles + facing * np.eye(2)[..., None]
        parts = down + even + facing * slopes
        extra = (hint.normal_matrix for hint in self.extra)
        linear = self._linear.normal_matrix @ z - self._linear.right_side
        return linear + self.stencils.spread(parts), sum(extra, self._sum.matrix(blocks))

    def _of_angles(self, slopes: Floats) -> tuple[Floats, Floats]:
        """Slope (2, n) and curvature (2, 2, n) of the right angles by dz/dx and dz/dy of each pixel."""
        u, v = self._lines
        cosine = self.right_angles(slopes)
        a, b = (np.sum(line * slopes, axis=0) for line in (u, v))
        long_a, long_b = 1 + a * a, 1 + b * b
        both = np.sqrt(long_a * long_b)
        change = u * (b / both - cosine * a / long_a) + v * (a / both - cosine * b / long_b)
        weighed = change / (1 + (cosine / self.weights.forgiven) ** 2)
        return weighed * cosine, weighed[:, None] * change

    def _of_normals(self, slopes: Floats, normals: Floats) -> tuple[Floats, Floats]:
        """Slope (2, n) of uneven normals, and curvature (2, 2, k) at the k places of `_sum`."""
        grid, uneven = self.stencils.grid, self.stencils.unevenness
        weight, change = self.weights.even * grid.size, changes_of_normals(slopes)
        first, second = change.take(grid.first, axis=2), change.take(grid.second, axis=2)
        diagonal = weight * uneven.diagonal() * np.sum(change[:, :, None] * change[:, None], axis=0)
        beside = -weight * np.sum(first[:, :, None] * second[:, None], axis=0)
        slope = weight * np.sum(change * (uneven @ normals.T).T[:, None], axis=0)
        return slope, np.concatenate([diagonal, beside, beside.swapaxes(0, 1)], axis=2)


@dataclass(frozen=True, eq=False)
class BlockSum:
    """A sparse symmetric matrix (N, N) whose entries are a constant and sums over blocks of slopes.

    A block belongs to two pixels; its 2 x 2 numbers count for the slopes of the first and of the second one.
    places: int (16 k,), the entry of each pair of corners of the first and the second of k pairs of pixels.
    """

    constant: Any
    places: NDArray[np.intp]

    @classmethod
    def of(cls, constant: Any, first: Ints, second: Ints, used: Bools) -> BlockSum:
        """Plan the sum of a matrix and of blocks of pixels with these corners, (4, k) each."""
        size, across, (row, column) = constant.shape[0], 2 * _MEETING + 1, np.nonzero(used)

        def key(first_corner: Ints, second_corner: Ints) -> NDArray[np.intp]:
            """Numbers of pairs of corners, in the order of the entries."""
            down, right = (
                row[second_corner] - row[first_corner] + _MEETING,
                column[second_corner] - column[first_corner] + _MEETING,
            )
            return np.asarray(across * (across * first_corner.astype(np.intp) + down) + right)

        old = constant.tocoo()
        whose = np.full(across**2 * size, -1, dtype=np.int32)
        places, kept_places = key(first[:, None], second), key(*old.coords)
        whose[places] = second
        whose[kept_places] = old.coords[1]
        there = whose >= 0
        entry = np.cumsum(there) - 1
        data = np.zeros(entry[-1] + 1)
        data[entry[kept_places]] = old.data
        begin = np.concatenate([[0], entry[across**2 - 1 :: across**2] + 1])
        matrix = sparse.csr_array((data, whose[there], begin), shape=constant.shape)
        return cls(matrix, entry[places].ravel())

    def matrix(self, blocks: Floats) -> Any:
        """The matrix for blocks (2, 2, k)."""
        entries = _PAIRS @ blocks.reshape(4, -1)
        data = self.constant.data + np.bincount(self.places, entries.ravel(), len(self.constant.data))
        return sparse.csr_array((data, self.constant.indices, self.constant.indptr), self.constant.shape)


def normals_of(slopes: Floats) -> Floats:
    """The unit normals (3, n) of the pixels, parts x, y and z one below the other, by slopes (2, n)."""
    x, y = slopes
    return np.asarray(np.stack([-x, -y, np.ones_like(x)]) / np.sqrt(1 + x * x + y * y))


def changes_of_normals(slopes: Floats) -> Floats:
    """Derivatives of the parts of the normals by dz/dx and dz/dy at the same pixel: shape (3, 2, n)."""
    x, y = slopes
    changes: Floats = np.array([[-1 - y * y, x * y], [x * y, -1 - x * x], [-x, -y]])
    changes *= (1 + x * x + y * y) ** -1.5
    return changes


def descend(equations: Equations, z: Floats, is_over: IsOver) -> tuple[float, Floats]:
    """Minimise from heights z, until there is hardly any gain; return the energy reached and its heights."""
    energy, damping = equations.energy(z), _DAMPING
    solver = SimilarSystems(steps=_STEPS)
    is_narrow = equations.stencils.grid.width <= _NARROW
    least_fall = _FALL_OF_FEW if len(z) <= _FEW else _FALL
    for _ in range(_ROUNDS):
        if is_over():
            break
        slope, curvature = equations.model(z)
        diagonal = curvature.diagonal()
        for _ in range(_TRIALS):
            if is_narrow:
                step = solve_banded(curvature, slope, damping * diagonal)
            else:
                step = solver.solve(curvature + sparse.diags_array(damping * diagonal), slope, _RESIDUAL)
            tried = z - step
            reached = equations.energy(tried)
            if reached < energy:
                break
            damping *= _UP
        else:
            break
        fallen, z, energy = energy - reached, tried, reached
        damping = max(damping / _DOWN, _LEAST)
        if fallen <= least_fall * (energy + fallen):
            break
    return energy, z


def _along(matrices: tuple[Any, Any], line: Floats) -> Any:
    """The derivative along a line of directions (k, 2), from those by x and y."""
    return scale_rows(matrices[0], line[:, 0]) + scale_rows(matrices[1], line[:, 1])
