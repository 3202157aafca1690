"""A cross field: two lines at every pixel, the jumps between neighbours, and their meaning."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, Literal

import numpy as np

from ..arguments import float_array, whole_numbers
from ..errors import InputError, InstanceError
from ..instance.angles import HALF, MOST_ANGLE, QUARTER, line_difference
from ..instance.domain import Bools, Floats, Ints
from ..instance.instance import Instance
from ..instance.terms import parity_sign, quarter_turns
from ..previews import Pictured
from .jumps import best_jumps, label_of, step_labels
from .measures import Energy, Singularities

AbsoluteNorm = Literal[1, "mixed"]
"""Norms in which pairs count with absolute values."""

Norm = Literal[2, AbsoluteNorm]
"""Squares throughout (2), absolute values throughout (1), or absolute values of the smoothness with squares
of stroke and skew terms (mixed).
"""

NORMS: Final[tuple[Norm, ...]] = (2, 1, "mixed")
"""Every norm."""

_DEGENERATE: Final = np.radians(2.5)  # lines closer than 5 degrees count as one: |beta| > pi/4 - _DEGENERATE
_FAR: Final = np.radians(10)  # a stroke that deviates more than this from both lines counts as not followed
_EQUAL: Final = 1e-9  # radians; lines 45 degrees apart are not narrow
_TIE: Final = 1e-3  # relative to pi/4: what |A| may exceed it by before another jump is the nearest one
_ROUNDING: Final = 1e-12  # quarter turns by which a label may miss its window


def check_norm(norm: Any) -> None:
    """Raise InputError unless the value is a norm."""
    if isinstance(norm, bool) or not isinstance(norm, (int, np.integer, str)) or norm not in NORMS:
        raise InputError(f"norm is {norm!r}; give 1, 2 or 'mixed'")


@dataclass(frozen=True, eq=False)
class CrossField(Pictured):
    """Angles of crosses and jumps between neighbours, on the grid of an instance with n pixels and m pairs.

    Line u is at alpha + beta and line v at alpha + pi/2 - beta, in radians counter-clockwise from +x with y
    up. A jump relates the labels of a pair's first and second pixel (docs/mathematics.md, 2 and 3).

    Parameters
    ----------
    instance
        The instance.
    alpha, beta
        Direction and skew of each cross, shape (n,), in the order of `instance.domain`.
    p
        Jump of each pair, integers of shape (m,).

    Raises
    ------
    InstanceError
        If a shape does not fit the grid, or a value is not an angle up to 1e6 radians.

    """

    instance: Instance
    alpha: Floats
    beta: Floats
    p: Ints

    def __post_init__(self) -> None:
        """Store read-only copies, and check shapes and values."""
        n, m = self.instance.domain.size, len(self.instance.domain.first)
        arrays: list[tuple[str, np.ndarray[Any, Any], int]] = [
            ("alpha", float_array(self.alpha, "alpha", InstanceError), n),
            ("beta", float_array(self.beta, "beta", InstanceError), n),
            ("p", whole_numbers(self.p, "p"), m),
        ]
        for name, value, size in arrays:
            if value.shape != (size,):
                raise InstanceError(
                    f"{name} has shape {value.shape}, but {self.instance.name} needs ({size},)"
                )
            if not (np.abs(value) <= (np.inf if name == "p" else MOST_ANGLE)).all():
                raise InstanceError(f"{name} holds something other than angles up to {MOST_ANGLE:g} radians")
            if name == "beta" and self.instance.orthogonal and value.any():
                raise InstanceError(
                    f"beta is not 0 everywhere, but crosses on {self.instance.name} are orthogonal"
                )
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        energy, singular = self.energy().total, len(self.singularities.index)
        return f"<CrossField on {self.instance.summary}: energy {energy:.6g}, singularities {singular}>"

    @classmethod
    def from_lines(cls, instance: Instance, u_angle: Floats, v_angle: Floats) -> CrossField:
        """Field of the crosses whose lines have given angles, with the best jumps.

        The lines need not be at right angles. Turns by pi and the order of the two lines do not matter: the
        label is the one in the window of the instance's gauge. Under `strokes` its u is the line nearer to
        the stroke. Under `box` it may be the other line, whose distance the energy then counts
        (docs/mathematics.md, 4). Both lines may coincide, where abs(beta) = pi/4. Where crosses are
        orthogonal, beta becomes 0.

        Parameters
        ----------
        instance
            The instance.
        u_angle, v_angle
            Angles of the two lines, shape (n,), the points in the order of `instance.domain`. Radians
            counter-clockwise from +x, with y up.

        Raises
        ------
        InputError
            For another shape, such as vectors, and for values that are not finite or exceed 1e6.

        """
        alpha, beta = label_of(*_check_lines(instance, u_angle, v_angle))
        steps = _steps_into_windows(instance, alpha, beta, inside=True)
        alpha = np.clip(alpha + HALF * steps, instance.alpha_lower, instance.alpha_upper)
        beta = np.clip(parity_sign(steps) * beta, -QUARTER, QUARTER)
        if instance.orthogonal:
            beta = np.zeros_like(beta)
        return cls(instance, alpha, beta, best_jumps(instance, alpha, beta))

    def on_instance(self, instance: Instance) -> CrossField:
        """The field on this instance: itself, or its crosses where only the gauge is another one.

        Its energy may then differ, as of `field_in_windows`. Raises InstanceError for another instance.
        """
        if self.instance.sha256 == instance.with_gauge(self.instance.gauge).sha256 != instance.sha256:
            return field_in_windows(instance, self.alpha, self.beta, self.p)
        self.check_instance(instance)
        return self

    def check_instance(self, instance: Instance) -> None:
        """Raise InstanceError unless the field is on this instance, with its prescribed indices."""
        if self.instance.sha256 != instance.sha256:
            raise InstanceError(
                f"the field is on another instance ({self.instance.summary}), not on this one "
                f"({instance.summary}); give a field of the same sketch, size, gauge and weights"
            )
        if (rings := instance.prescribed_rings) is None:
            return
        beyond = np.round(self.residual_a / HALF * (1 - _TIE))  # jumps that do not join nearest lines
        off = rings.sums(self.p - beyond) - rings.turns
        if off.any():
            vertex, wanted = np.asarray(instance.indices)[np.argmax(off != 0)]
            raise InstanceError(
                f"the field has index {wanted - off[off != 0][0]:.0f}/4 at vertex {vertex}, but {wanted}/4"
                f" is prescribed ({np.count_nonzero(off)} such vertices); search and prove find such fields"
            )

    @property
    def u_angle(self) -> Floats:
        """Angle of line u, alpha + beta, in radians; shape (n,)."""
        return self.alpha + self.beta

    @property
    def v_angle(self) -> Floats:
        """Angle of line v, alpha + pi/2 - beta, in radians; shape (n,)."""
        return self.alpha + HALF - self.beta

    @cached_property
    def u(self) -> Floats:
        """Unit vectors (x, y), y up, of line u; shape (n, 2)."""
        return np.stack([np.cos(self.u_angle), np.sin(self.u_angle)], axis=-1)

    @cached_property
    def v(self) -> Floats:
        """Unit vectors (x, y), y up, of line v; shape (n, 2)."""
        return np.stack([np.cos(self.v_angle), np.sin(self.v_angle)], axis=-1)

    @property
    def residual_a(self) -> Floats:
        """A = alpha_i - alpha_j + kappa + pi/2 p of each pair, shape (m,)."""
        return self.instance.pair_terms.residual_a(self.alpha, self.p)

    @property
    def residual_b(self) -> Floats:
        """B = (-1)^p beta_i - beta_j of each pair, shape (m,)."""
        return self.instance.pair_terms.residual_b(self.beta, self.p)

    @property
    def residual_r(self) -> Floats:
        """R = alpha + beta - theta of each stroke pixel, shape (s,)."""
        return self.instance.stroke_terms.residuals(self.alpha, self.beta)

    def energy(self, norm: Norm = 2) -> Energy:
        """The energy in a norm, as three sums and their total.

        The sums run over 2 (phi(A) + phi(B)) of each pair, w_strokes w phi(R) of each stroke pixel, and
        w_beta phi(beta) of each pixel (docs/mathematics.md, 5). phi is the square (2), the absolute value
        (1), or the absolute value at pairs and the square elsewhere (mixed). Raises InputError for another
        norm.
        """
        check_norm(norm)
        return energy_of(self.instance, self.alpha, self.beta, self.p, norm)

    @cached_property
    def pixel_energy(self) -> Floats:
        """Smooth 2-norm energy per pixel, each pair shared by its two pixels; shape (n,)."""
        domain = self.instance.domain
        share = self.instance.pair_terms.costs(self.alpha, self.beta, self.p) / 2
        ends, halves = np.concatenate([domain.first, domain.second]), np.concatenate([share, share])
        return np.bincount(ends, halves, domain.size).astype(np.float64)

    @cached_property
    def singularities(self) -> Singularities:
        """Rings whose index, (defect - sum of kappa + pi/2 p along the ring) / 2 pi, is not zero."""
        instance = self.instance
        quarters = quarter_turns(instance.domain.rings, instance.pair_terms.offset(self.p))
        at = np.nonzero(quarters)[0]
        return Singularities(instance, at.astype(np.int32), quarters[at] / 4)

    @cached_property
    def degenerate(self) -> Bools:
        """True where both lines are the same to within 5 degrees; shape (n,)."""
        return np.asarray(np.abs(self.beta) > QUARTER - _DEGENERATE)

    @property
    def angle_between(self) -> Floats:
        """Angle between the two lines, in [0, pi/2] radians; shape (n,)."""
        return line_difference(self.u_angle, self.v_angle)

    @property
    def stroke_deviation(self) -> Floats:
        """Angle between each stroke and the nearer line, in [0, pi/2] radians; shape (s,)."""
        at, theta = self.instance.stroke_index, self.instance.theta
        return np.minimum(*(line_difference(angle[at], theta) for angle in (self.u_angle, self.v_angle)))

    def facts(self) -> dict[str, float | int]:
        """Measures of the field by name, as reports list them: energies, lines, singularities, skew.

        The mean and the 90 % quantile of `stroke_deviation`; the share of the strokes where it exceeds 10
        degrees, and of the pixels whose lines are less than 45 degrees apart.
        """
        deviation = self.stroke_deviation if len(self.instance.theta) else np.zeros(1)
        return {
            "energy_2_norm": self.energy(2).total,
            "energy_1_norm": self.energy(1).total,
            "stroke_deviation_mean_degrees": float(np.degrees(deviation.mean())),
            "stroke_deviation_90_percent_degrees": float(np.degrees(np.quantile(deviation, 0.9))),
            "strokes_beyond_10_degrees": float(np.mean(deviation > _FAR)),
            "lines_under_45_degrees": float(np.mean(self.angle_between < QUARTER - _EQUAL)),
            "singularities": len(self.singularities.index),
            "degenerate_pixels": int(self.degenerate.sum()),
            "mean_abs_beta_degrees": float(np.degrees(np.abs(self.beta).mean())),
        }

    def cross_error(self, u_angle: Floats, v_angle: Floats) -> Floats:
        """Angle between the crosses of the field and others at each pixel, shape (n,), in radians.

        The mean of the two line differences, for the better of the two assignments of lines
        (docs/mathematics.md, 9). u_angle, v_angle: of the lines of the others, as in `from_lines`, which
        raises the same errors.
        """
        u, v = _check_lines(self.instance, u_angle, v_angle)
        straight = line_difference(self.u_angle, u) + line_difference(self.v_angle, v)
        crossed = line_difference(self.u_angle, v) + line_difference(self.v_angle, u)
        return np.minimum(straight, crossed) / 2

    def with_best_jumps(self) -> CrossField:
        """The field with the jump of least energy on each pair, within the instance's p_min and p_max."""
        jumps = best_jumps(self.instance, self.alpha, self.beta)
        return CrossField(self.instance, self.alpha, self.beta, jumps)

    def image(self, values: np.ndarray[Any, Any], fill: float = np.nan) -> Floats:
        """Values (n,) of the pixels, or one for all, as a picture [height, width], `fill` outside the mask.

        Raises InputError for another shape.
        """
        size = self.instance.domain.size
        if np.ndim(values) and np.shape(values) != (size,):
            raise InputError(f"values has shape {np.shape(values)}; give one value for each of {size} pixels")
        picture = np.full(self.instance.mask.shape, fill)
        picture[self.instance.mask] = values
        return picture


def energy_of(instance: Instance, alpha: Floats, beta: Floats, p: Ints, norm: Norm = 2) -> Energy:
    """The energy of angles (n,) and jumps (m,) in a norm, wherever they are."""
    of_pairs = np.square if norm == 2 else np.abs
    size = np.abs if norm == 1 else np.square
    return Energy(
        smooth=float(instance.pair_terms.costs(alpha, beta, p, of_pairs).sum()),
        strokes=float(instance.stroke_terms.costs(alpha, beta, size).sum()),
        beta=instance.skew_coefficient * float(size(beta).sum()),
    )


def field_in_windows(instance: Instance, alpha: Floats, beta: Floats, p: Ints) -> CrossField:
    """The same crosses with every alpha in its window of the gauge and |beta| <= pi/4, or clipped to that.

    Each pair gets its best jump, unless indices are prescribed; without clipping the energy does not rise.
    """
    alpha, beta, p = step_labels(
        instance.domain, alpha, beta, p, _steps_into_windows(instance, alpha, beta, inside=False)
    )
    clipped = CrossField(
        instance,
        np.clip(alpha, instance.alpha_lower, instance.alpha_upper),
        np.clip(beta, -QUARTER, QUARTER),
        np.clip(p, instance.p_min, instance.p_max),
    )
    best = clipped.with_best_jumps() if instance.indices is None else clipped
    return best if best.energy().total < clipped.energy().total else clipped


def _steps_into_windows(instance: Instance, alpha: Floats, beta: Floats, *, inside: bool) -> Ints:
    """The step of each label, (n,), into its window; on an edge, the one nearer to the stroke.

    If not inside, the label of a stroke may leave its window for the least clipping and misfit.
    """
    steps = np.ceil((instance.alpha_lower - alpha) / HALF - _ROUNDING).astype(np.int32)
    at, target = instance.stroke_index, instance.target
    # The label in the window, the next one, which also fits on an edge, and the one with u at the stroke.
    faithful = 2 * np.round((target - alpha[at] - beta[at]) / np.pi).astype(np.int32)
    candidates = np.stack([steps[at], steps[at] + 1, faithful][: 2 if inside else 3])
    moved = alpha[at] + HALF * candidates
    shifted = np.clip(moved, instance.alpha_lower[at], instance.alpha_upper[at])
    misfit = np.abs(shifted + np.clip(parity_sign(candidates) * beta[at], -QUARTER, QUARTER) - target)
    clipped = np.abs(moved - shifted)
    if inside:
        cost = np.stack([misfit[0], np.where(clipped[1] <= 2 * HALF * _ROUNDING, misfit[1], np.inf)])
    else:
        cost = clipped + misfit
    steps[at] = candidates[np.argmin(np.round(cost, 12), axis=0), np.arange(len(at))]
    return steps


def _check_lines(instance: Instance, u_angle: Any, v_angle: Any) -> tuple[Floats, Floats]:
    """The angles of the two lines of each point, (n,) each. Raises InputError."""
    u, v, size = float_array(u_angle, "u_angle"), float_array(v_angle, "v_angle"), instance.domain.size
    for name, angles in (("u_angle", u), ("v_angle", v)):
        if angles.shape != (size,):
            raise InputError(
                f"{name} has shape {angles.shape}, but {instance.name} has {size} pixels; "
                "give an angle for each"
            )
        wrong = ~(np.abs(angles) <= MOST_ANGLE)
        if wrong.any():
            raise InputError(
                f"{name} of pixel {int(np.argmax(wrong))} is {angles[wrong][0]}, which is not an angle; "
                f"give radians up to {MOST_ANGLE:g}"
            )
    return u, v
