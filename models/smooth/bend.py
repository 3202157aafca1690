"""The bend field: lines of one family change little along the lines of the other family.

Iarussi, Bommes, Bousseau: BendFields: Regularized Curvature Fields from Rough Concept Sketches (ACM
Transactions on Graphics 34, 2015). Curvature lines turn along themselves, as the surface bends; their
direction changes little from one to the next.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import LinearOperator

from ..arguments import check_positive
from ..field.field import CrossField
from ..instance.angles import HALF, QUARTER, wrap
from ..instance.domain import Floats, Ints
from ..instance.grid import Grid
from ..instance.instance import Instance
from ..instance.least_squares import Residuals, two_entry_matrix
from ..instance.sparse_systems import Solve, solve_by_gradients
from ..processes.blas_threads import one_thread
from ..processes.deadline import IsOver, Stop, stop_function
from .polyvector import HOLDS, polyvector_field
from .two_levels import approximate_inverse

_Places = NDArray[np.intp]

HARMONIC: Final = 0.05  # weight of plain smoothness for strokes that tremble by `TREMBLE` or more
TREMBLE: Final = np.radians(1.2)  # about what 3 degrees of noise on strokes cause at 48 pixels
HOLD: Final = 0.25  # factor of the stroke weights; from 0.3 on, 3 degrees of noise show

_LEAST: Final = 0.2  # of `HARMONIC`: smallest deviation from clean strokes
_SIGMA: Final = 1.4826  # standard deviation of a normal error in units of its median size
_ROUNDS: Final = 20  # 2 to 6 are usual
_FIRST: Final = 0.01  # relative residual of the system of the first round, whose step is the longest
_RESIDUAL: Final = 0.05  # of later ones
_STEPS: Final = 50  # of conjugate gradients; 5 to 15 are usual
_FALL: Final = 1e-4  # least share of the energy that a round has to remove before another one
_ROUGH: Final = 0.03  # likewise, of a field in which only the tremble of strokes is measured


@one_thread()
def bend_field(
    start: CrossField, *, harmonic: float | None = None, hold: float = HOLD, stop: Stop | None = None
) -> CrossField:
    """Field of little bend near the lines of `start`, with the best jumps.

    With line angles u, v in radians the energy is the sum of

    - (v . grad u)^2 + (u . grad v)^2 over pixels, where u and v in front of the dots are unit vectors,
    - 2 `harmonic` (du^2 + dv^2) over pairs,
    - `hold` w_strokes w (line - theta)^2 over strokes, and
    - w_beta beta^2 over pixels (docs/mathematics.md, 10).

    The jumps of `start` match the lines of neighbours, and the nearer line of `start` follows a stroke; both
    are fixed. The start therefore determines the singularities. The method `bend` starts from the PolyVector
    field with the hardest hold.

    Each round fixes the unit vectors and minimises over the angles: one sparse system, which conjugate
    gradients solve to a residual of 1 % in the first round and of 5 % in later ones. Their preconditioner
    (two_levels.py) is made for the first round, also if the weight of smoothness changes later. Rounds end
    when the energy hardly decreases, and after 20 rounds at the latest; a round that increases it is
    discarded. Labels are then moved into the windows of the instance, as by `CrossField.from_lines`.
    Deterministic unless `stop` ends it.

    Parameters
    ----------
    start
        The field to begin with.
    harmonic
        Weight of plain smoothness, above 0. None measures the tremble of the strokes in a rough field of
        `HARMONIC`, takes that weight times (tremble / TREMBLE)^2, from 0.01 to 0.05, and goes on from there.
    hold
        Factor of the stroke weights, above 0.
    stop
        A function or an event, asked before each round whether to stop. The field of the rounds so far is
        then returned, and `start` before the first round.

    Raises
    ------
    InputError
        For a weight or factor that is not above 0.

    """
    check_positive("hold", hold)
    if harmonic is not None:
        check_positive("harmonic", harmonic)
    is_over = stop_function(stop)
    if is_over():
        return start
    x = np.concatenate([start.u_angle, start.v_angle])
    bend = _Bend.of(start, HARMONIC if harmonic is None else harmonic, hold)
    inverse = bend.invert(x)
    if harmonic is None:
        x = bend.least(x, inverse, is_over, _ROUGH)
        trembling = tremble(CrossField.from_lines(start.instance, *np.split(x, 2))) / TREMBLE
        bend = _Bend.of(start, HARMONIC * float(np.clip(trembling**2, _LEAST, 1.0)), hold)
    x = bend.least(x, inverse, is_over, _FALL)
    return CrossField.from_lines(start.instance, *np.split(x, 2))


def surface_field(instance: Instance, *, stop: Stop | None = None) -> CrossField:
    """The field from which surfaces are lifted: `bend_field` from the PolyVector field with the hardest hold.

    On known surfaces it has smaller errors than fields of less energy (docs/surface.md).
    """
    return bend_field(polyvector_field(instance, hold=max(HOLDS)), stop=stop)


def tremble(field: CrossField) -> float:
    """Standard deviation of a normal error with the median deviation of strokes from a field, in radians."""
    deviation = field.stroke_deviation
    return _SIGMA * float(np.median(deviation)) if len(deviation) else 0.0


@dataclass(frozen=True, eq=False)
class _Bend:
    """The energy of line angles x = (u, v), (2n,), as squares: bend, and residuals that are linear in x.

    links are the lines, as places in x, that the jumps of m pairs compare: (2m,) of first pixels, and of
    second ones. differences are those of the lines of pairs, (2m,): row e for u of the first pixel of pair e,
    row m + e for its v. Bend has a square for each quadrant (pixel, line, a horizontal and a vertical
    neighbour):
    across (q,) is the place in x of the pixel's other line, sideways and upward (q,) are rows of differences.
    """

    grid: Grid
    links: tuple[Ints, Ints]
    differences: Residuals
    across: _Places
    sideways: _Places
    upward: _Places
    linear: Residuals

    @classmethod
    def of(cls, start: CrossField, harmonic: float, hold: float) -> _Bend:
        """The energy with the jumps and stroke lines of a field."""
        links, differences = _differences(start)
        size, m = start.instance.grid.size, len(start.p)
        pixels = np.arange(size, dtype=np.int32)
        # beta is half of u - v + pi/2.
        skew = Residuals(
            two_entry_matrix(pixels, pixels + size, 2 * size, 0.5, -0.5),
            np.full(size, QUARTER),
            np.full(size, start.instance.skew_coefficient),
        )
        even = replace(differences, weight=np.full(2 * m, 2 * harmonic))
        linear = Residuals.join([even, _stroke_residuals(start, hold), skew])
        return cls(start.instance.grid, links, differences, *_quadrants(start), linear)

    def least(self, x: Floats, inverse: Solve, is_over: IsOver, fall: float) -> Floats:
        """Angles of low energy, in rounds that begin at x and end with one that removes less than `fall`."""
        energy, slope, along = self.at(x)
        for number in range(_ROUNDS):
            if is_over():
                break
            moved = x - self._step(along, slope, inverse, _RESIDUAL if number else _FIRST)
            there = self.at(moved)
            fallen = energy - there[0]
            if fallen > 0:
                x, (energy, slope, along) = moved, there
            if fallen <= fall * energy:
                break
        return x

    def at(self, x: Floats) -> tuple[float, Floats, Any]:
        """The energy at x, half its slope for fixed unit vectors, and the matrix of these."""
        along = self._along(x)
        bend = along @ self.differences.at(x)
        slope = self.differences.matrix.T @ (along.T @ bend) + self.linear.slope(x)
        return float(np.sum(bend**2)) + self.linear.energy(x), slope, along

    def invert(self, x: Floats) -> Solve:
        """The approximate inverse of the system for the unit vectors at x."""
        bend = self._along(x) @ self.differences.matrix
        matrix = bend.T @ bend + self.linear.normal_matrix
        return approximate_inverse(matrix, self.grid, *self.links)

    def _step(self, along: Any, slope: Floats, inverse: Solve, residual: float) -> Floats:
        """Minus the step to about the least energy for fixed unit vectors, by conjugate gradients."""

        def product(v: Floats) -> Floats:
            matrix = self.differences.matrix
            total: Floats = matrix.T @ (along.T @ (along @ (matrix @ v))) + self.linear.normal_matrix @ v
            return total

        system = LinearOperator((len(slope), len(slope)), product, dtype=np.float64)
        return solve_by_gradients(system, slope, residual, steps=_STEPS, inverse=inverse)[0]

    def _along(self, x: Floats) -> Any:
        """The matrix (q, 2m) from differences to derivatives along the other line; a quadrant counts 1/4."""
        count, vectors = len(self.across), np.stack([np.cos(x), np.sin(x)], axis=1) / 2
        parts = vectors[self.across].ravel()
        return sparse.csr_array((parts, *self._structure), shape=(count, len(self.differences.constant)))

    @cached_property
    def _structure(self) -> tuple[_Places, _Places]:
        """Columns and beginnings of rows of the matrix from differences to derivatives."""
        columns = np.stack([self.sideways, self.upward], axis=1).ravel()
        return columns, np.arange(0, len(columns) + 1, 2)


def _differences(field: CrossField) -> tuple[tuple[Ints, Ints], Residuals]:
    """Links and differences of `_Bend`: -(A + B) and -(A - B) of pairs, each of weight 1."""
    grid, size, pairs = field.instance.grid, field.instance.grid.size, len(field.p)
    odd = field.p & 1
    first = np.concatenate([grid.first, grid.first + size])
    second = np.concatenate([grid.second + size * odd, grid.second + size * (1 - odd)])
    terms = field.instance.pair_terms
    offset = np.concatenate([terms.offset(field.p + odd), terms.offset(field.p - odd)])
    matrix = two_entry_matrix(second, first, 2 * size)
    return (first, second), Residuals(matrix, -offset, np.ones(2 * pairs))


def _quadrants(field: CrossField) -> tuple[_Places, _Places, _Places]:
    """Across, sideways and upward of each quadrant, as in `_Bend`."""
    upright = field.instance.grid.upward
    quadrants = []
    for beside in _rows_of(field, ~upright):
        for above in _rows_of(field, upright):
            at = np.nonzero((beside >= 0) & (above >= 0))[0]
            across = (at + field.instance.grid.size) % len(beside)
            quadrants.append((across, beside[at], above[at]))
    across, sideways, upward = (np.concatenate(parts) for parts in zip(*quadrants, strict=True))
    return across, sideways, upward


def _rows_of(field: CrossField, chosen: NDArray[np.bool_]) -> tuple[_Places, _Places]:
    """Rows of differences of the chosen pairs that begin and that end at each line, (2n,) each, or -1."""
    grid, size, pairs = field.instance.grid, field.instance.grid.size, len(field.p)
    at = np.nonzero(chosen)[0]
    begin, end = np.full((2, 2 * size), -1)
    for line in (0, 1):
        partner = line ^ (field.p[at] & 1)
        begin[grid.first[at] + size * line] = at + pairs * line
        end[grid.second[at] + size * partner] = at + pairs * line
    return begin, end


def _stroke_residuals(field: CrossField, hold: float) -> Residuals:
    """The deviation of the nearer line of `field` from each stroke at its nearest angle."""
    instance = field.instance
    at = instance.stroke_index
    lines = np.stack([field.u_angle[at], field.v_angle[at]])
    off = wrap(instance.theta - lines, -HALF, np.pi)
    carrying = np.argmin(np.round(np.abs(off), 9), axis=0)
    angle = (lines + off)[carrying, np.arange(len(at))]
    matrix = sparse.eye_array(2 * instance.grid.size, format="csr")[at + instance.grid.size * carrying]
    return Residuals(matrix, -angle, hold * instance.stroke_terms.weight)
