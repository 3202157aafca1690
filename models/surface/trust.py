"""Trust in a surface: how well its crosses fit it."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy import ndimage

from ..field.field import CrossField
from ..instance.domain import Floats
from ..instance.instance import Instance
from .equations import Equations, Weights
from .freedom import find_deepest, place_of
from .stencils import Crosses, Stencils, corners_of_blocks

OFF: Final = np.radians(10)  # lines whose angle in space deviates more from a right angle do not fit
_PLAIN: Final = Weights(even=0.0, facing=0.0)


def right_angle_deviation(field: CrossField, heights: Floats) -> Floats:
    """Deviation from a right angle between each cross's lines on the surface, in [0, pi/2] radians; (n,)."""
    stencils = Stencils(field.instance.grid)
    slopes = stencils.gradient(heights[stencils.used])
    cosine = Equations(stencils, Crosses.of(field), _PLAIN).right_angles(slopes)
    return np.arcsin(np.minimum(np.abs(cosine), 1.0))


def confidence_of(field: CrossField, off: Floats) -> Floats:
    """1 / (1 + (off / OFF)^2) at each pixel, and 0 at the four pixels of a singular spot; shape (n,)."""
    spots = field.singularities
    singular = np.zeros(field.instance.mask.shape, dtype=bool)
    for quad in corners_of_blocks(singular):
        quad[spots.row, spots.column] = True
    return np.where(singular[field.instance.mask], 0.0, 1 / (1 + (off / OFF) ** 2))


def describe_support(field: CrossField, off: Floats) -> dict[str, str]:
    """The support of a surface, and the places where it is a guess. off: as from `right_angle_deviation`."""
    instance = field.instance
    free = np.ones(instance.mask.shape, dtype=bool)
    free[tuple(instance.stroke_pixels.T)] = False
    away, unfit = ndimage.distance_transform_edt(free)[instance.mask], off > OFF
    far, far_at = away.max(), _describe_place(instance, *np.argwhere(instance.mask)[np.argmax(away)])
    sentences = {
        "drawn": f"{1 - np.mean(away > 0):.0%} of the pixels of the grid lie on a stroke, which gives the "
        "direction of one line",
        "guessed": f"all other crosses continue the strokes, farthest at {far_at}, {far:.1f} pixels "
        f"({far * instance.pixel_size:.3g} units of the drawing) from a stroke; more lines there help most",
        "fitting": f"on {1 - unfit.mean():.0%} of the pixels the two lines meet on the surface within "
        f"{np.degrees(OFF):g} degrees of a right angle, as curvature lines do",
    }
    if round(unfit.mean(), 2) > 0:  # else all pixels fit, as stated
        picture = instance.mask.copy()
        picture[instance.mask] = unfit
        place = _describe_place(instance, *find_deepest(picture))
        sentences["not fitting"] = f"above all round {place}; distrust normals there"
    return sentences


def _describe_place(instance: Instance, row: int, column: int) -> str:
    """The middle of a pixel in the coordinates of the drawing."""
    x, y = place_of(instance, row, column)
    return f"({x:g}, {y:g})"
