"""Trust in a surface: how well its crosses fit it, and what they do not determine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from scipy import linalg

from ..field.field import CrossField
from ..instance.domain import Floats
from ..smooth.sparse_systems import factor_matrix
from .equations import Equations, Rows, Weights, changes_of_normals
from .stencils import Crosses, GridLevel, Stencils, corners_of_blocks, scale_rows

OFF: Final = np.radians(10)  # lines whose angle in space deviates more from a right angle do not fit
UNFIT: Final = 0.25  # share of misfit crosses from which a surface is doubted (docs/surface.md)
SPOTS: Final = 4  # singular spots that a surface may show: an ellipsoid has four umbilics
FLAT: Final = np.radians(10)  # mean slant below which a surface is called flat
LOOSE: Final = 0.01  # firmness below which the crosses do not determine the surface: see `firmness`

_PLAIN: Final = Weights(even=0.0, facing=0.0)
_VECTORS: Final = 4
_ROUNDS: Final = 12  # the least value has two of six digits
_PULL: Final = 1e-7  # of the normals, so that directions without cost do not make the system singular
_TWIST: Final = 1e-3


def right_angle_deviation(field: CrossField, heights: Floats) -> Floats:
    """Deviation from a right angle between each cross's lines on the surface, in [0, pi/2] radians; (n,)."""
    stencils = Stencils(field.instance.grid)
    cosine = Equations(stencils, Crosses.of(field), _PLAIN).right_angles(heights[stencils.used])
    return np.arcsin(np.minimum(np.abs(cosine), 1.0))


def confidence_of(field: CrossField, off: Floats) -> Floats:
    """1 / (1 + (off / OFF)^2) at each pixel, and 0 at the four pixels of a singular spot; shape (n,)."""
    spots = field.singularities
    singular = np.zeros(field.instance.mask.shape, dtype=bool)
    for quad in corners_of_blocks(singular):
        quad[spots.row, spots.column] = True
    return np.where(singular[field.instance.mask], 0.0, 1 / (1 + (off / OFF) ** 2))


def doubts_of(field: CrossField, off: Floats, slant: Floats) -> tuple[str, ...]:
    """Sentences with reasons not to trust a surface. slant: of its normals, radians (n,)."""
    unfit, spots = float(np.mean(off > OFF)), len(field.singularities.index)
    conditions = {
        f"{unfit:.0%} of the crosses are more than {np.degrees(OFF):g} degrees off right angles on it: "
        "no one surface has all these curvature lines. Probably some strokes are not curvature lines; "
        "otherwise hidden lines are drawn": unfit > UNFIT,
        f"the crosses turn round {spots} singular spots, more than a smooth surface shows": spots > SPOTS,
        f"it is nearly flat, {np.degrees(slant.mean()):.1f} degrees on average: "
        "lines that cross at right angles everywhere do not determine a shape": slant.mean() < FLAT,
    }
    return tuple(doubt for doubt, holds in conditions.items() if holds)


def freedom_of(firm: float, *, hinted: bool) -> tuple[str, ...]:
    """Sentences that describe other surfaces with the same crosses."""
    sentences = [] if hinted else ["inside out it has the same crosses: see whether it bulges the right way"]
    if firm < LOOSE:
        sentences.append(
            "other surfaces fit as well, steeper or leaning otherwise: "
            f"{describe_firmness(firm)}; a hint settles it"
        )
    return tuple(sentences)


def describe_firmness(firm: float) -> str:
    """Sentence that describes a firmness."""
    return (
        "when its normals turn by 10 degrees, the angles between its lines change by "
        f"{10 * firm:.2f} degrees or more"
    )


def firmness(level: GridLevel, z: Floats, extra: Sequence[Rows] = ()) -> float:
    """Least change of the equations when the normals turn: radians per radian, both rms.

    It is 0 along a family of surfaces with the same crosses, and for masks that are too small.
    """
    if level.grid.size < 2 * _VECTORS:
        return 0.0
    # The least eigenvalue of the curvature relative to that of the normals, by inverse iteration.
    twist = level.stencils.twist
    _, curvature = Equations(level.stencils, level.crosses, _PLAIN, extra).model(z)
    curvature = curvature + _TWIST * (twist.T @ twist)
    change, slopes = changes_of_normals(level.stencils, z), level.stencils.slopes
    turns = [scale_rows(slopes[0], part[0]) + scale_rows(slopes[1], part[1]) for part in change]
    turning = sum(turn.T @ turn for turn in turns)
    solve = factor_matrix(curvature + _PULL * turning, level.stencils.order)
    vectors = np.random.default_rng(0).standard_normal((level.stencils.count, _VECTORS))
    least = np.zeros(_VECTORS)
    for _ in range(_ROUNDS):
        vectors = solve(turning @ vectors)
        small = vectors.T @ (curvature @ vectors), vectors.T @ (turning @ vectors)
        least, turn = linalg.eigh(*small)
        vectors = vectors @ turn
    return float(np.sqrt(max(least[0], 0.0)))
