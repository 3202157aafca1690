"""The energy of docs/mathematics.md, 3 to 6 and 12, from the data of an instance alone, pair by pair.

Shares no code with the package: a second opinion on frames, pairs, windows, energies and optima.
"""

from __future__ import annotations

import itertools
import math
from functools import cached_property
from typing import Any, Final

import crossfield as cf
import numpy as np
from bounded_least_squares import least_in_bounds
from scipy.optimize import LinearConstraint, linprog

HALF: Final = math.pi / 2
MOST_JUMPS: Final = 81
"""Combinations of jumps up to which `least` tries them all."""


class Formulas:
    """What the formulas say about an instance: pairs with kappa and omega, strokes, windows."""

    def __init__(self, instance: cf.Instance) -> None:
        """Take the mask or the triangles, the strokes and the weights."""
        self.instance = instance
        on_mesh = hasattr(instance.domain, "faces")
        self.size, self.pairs = _faces(instance.domain) if on_mesh else _pixels(instance.domain.mask)
        self.omega = [1.0] * len(self.pairs) if instance.pair_weights is None else [*instance.pair_weights]
        theta = instance.theta
        if instance.gauge == "box":
            theta = np.where(theta >= 3 * math.pi / 4 - 1e-9, theta - math.pi, theta)
        self.strokes = [
            *zip(instance.stroke_index.tolist(), theta.tolist(), instance.w.tolist(), strict=True)
        ]
        self.lower = np.zeros(self.size)
        if instance.gauge == "strokes":
            for point, angle, _ in self.strokes:
                self.lower[point] = angle - math.pi / 4
        self.upper = self.lower + HALF

    @cached_property
    def jumps(self) -> list[range]:
        """The useful jumps of each pair."""
        ranges = []
        for i, j, kappa in self.pairs:
            least = self.lower[i] - self.upper[j] + kappa
            greatest = self.upper[i] - self.lower[j] + kappa
            low, high = math.floor(-2 * greatest / math.pi + 1e-9), math.ceil(-2 * least / math.pi - 1e-9)
            ranges.append(range(low, high + 1))
        return ranges

    def energy(self, field: cf.CrossField, norm: Any) -> tuple[float, float, float]:
        """Smoothness, strokes and skew of a field in a norm."""
        of_pairs, other = (abs if norm != 2 else _square), (abs if norm == 1 else _square)
        alpha, beta = field.alpha.tolist(), field.beta.tolist()
        smooth = 0.0
        for (i, j, kappa), omega, p in zip(self.pairs, self.omega, field.p.tolist(), strict=True):
            a = alpha[i] - alpha[j] + kappa + HALF * p
            b = (-1) ** (p % 2) * beta[i] - beta[j]
            smooth += 2 * omega * (of_pairs(a) + of_pairs(b))
        strokes = sum(w * other(alpha[i] + beta[i] - theta) for i, theta, w in self.strokes)
        skew = sum(map(other, beta))
        return smooth, self.instance.stroke_coefficient * strokes, self.instance.skew_coefficient * skew

    def least(self, norm: int, most: int = MOST_JUMPS) -> float | None:
        """The least energy of all fields in the norm 1 or 2, by every jump; None where they are many.

        None, too, where indices are prescribed.
        """
        if self.instance.indices is not None or math.prod(map(len, self.jumps)) > most:
            return None
        return min(self.least_at(p, norm) for p in itertools.product(*self.jumps))

    def least_at(self, jumps: tuple[int, ...], norm: int) -> float:
        """The least energy at given jumps, by least squares with bounds, or by a linear program."""
        rows, goal, weight = self._residuals(jumps)
        skew = np.full(self.size, 0.0 if self.instance.orthogonal else math.pi / 4)
        low, high = np.concatenate([self.lower, -skew]), np.concatenate([self.upper, skew])
        if norm == 2:
            high = np.maximum(high, low + 1e-12)  # lsq_linear takes no interval of length 0
            return least_in_bounds(rows, goal, weight, (low, high))[1]
        one = np.eye(len(rows))
        both = LinearConstraint(np.vstack([np.hstack([rows, -one]), np.hstack([-rows, -one])]))
        return float(
            linprog(
                np.concatenate([np.zeros(rows.shape[1]), weight]),
                both.A,
                np.concatenate([goal, -goal]),
                bounds=[*zip(low, high, strict=True), *[(0, None)] * len(rows)],
            ).fun
        )

    def _residuals(self, jumps: tuple[int, ...]) -> tuple[Any, Any, Any]:
        """Rows, goals and weights: every residual is row (alpha, beta) - goal."""
        n, found = self.size, []
        for (i, j, kappa), omega, p in zip(self.pairs, self.omega, jumps, strict=True):
            found.append(({i: 1, j: -1}, -kappa - HALF * p, 2 * omega))
            found.append(({n + i: (-1) ** (p % 2), n + j: -1}, 0.0, 2 * omega))
        for i, theta, w in self.strokes:
            found.append(({i: 1, n + i: 1}, theta, self.instance.stroke_coefficient * w))
        found += [({n + i: 1}, 0.0, self.instance.skew_coefficient) for i in range(n)]
        rows = np.zeros((len(found), 2 * n))
        for row, (entries, _, _) in zip(rows, found, strict=True):
            row[[*entries]] = [*entries.values()]
        return rows, np.array([goal for _, goal, _ in found]), np.array([weight for *_, weight in found])


def _square(value: float) -> float:
    return value * value


def _pixels(mask: Any) -> tuple[int, list[tuple[int, int, float]]]:
    """Number of pixels; each with its upper, then with its right neighbour."""
    number = {place: count for count, place in enumerate(map(tuple, np.argwhere(mask).tolist()))}
    pairs = [
        (i, number[place], 0.0)
        for (row, column), i in number.items()
        for place in ((row - 1, column), (row, column + 1))
        if place in number
    ]
    return len(number), pairs


def _faces(mesh: cf.Mesh) -> tuple[int, list[tuple[int, int, float]]]:
    """Number of faces; each with the neighbour at every edge that it has from lower to higher vertex."""
    faces, owner = mesh.faces.tolist(), {}
    for face, corners in enumerate(faces):
        for k in range(3):
            owner[corners[k], corners[(k + 1) % 3]] = face
    pairs = []
    for (low, high), i in owner.items():
        if low < high and (high, low) in owner:
            j = owner[high, low]
            edge = mesh.vertices[high] - mesh.vertices[low]
            turn = angle_in(mesh.vertices[faces[j]], edge) - angle_in(mesh.vertices[faces[i]], edge)
            pairs.append((i, j, math.pi - (math.pi - turn + 1e-9) % math.tau + 1e-9))  # in (-pi, pi]
    return len(faces), pairs


def angle_in(corners: Any, vector: Any) -> float:
    """Angle of a vector from the first edge of a triangle, counter-clockwise."""
    size = np.abs(corners - corners[0]).max()
    first, other, vector = (corners[1] - corners[0]) / size, (corners[2] - corners[0]) / size, vector / size
    normal = np.cross(first, other)
    across = np.cross(normal, first) / np.linalg.norm(normal)
    return math.atan2(vector @ across, vector @ first)
