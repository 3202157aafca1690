"""The same sketch on a grid of half the resolution, and its field on the fine grid.

The smooth energy of a field is the same on both grids: differences between neighbours double, and there is a
quarter of the pairs. So the weights of strokes and of beta, which are sums over pixels, become four times
as large, up to the greatest weight of an instance. Pairs have equal weights on the coarse grid, whose field
is a start that the fine grid judges.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from ..field.field import CrossField
from ..instance.instance import MOST_WEIGHT, Instance, round_to_digits
from .box_qp import FreeField

_ALIGNED: Final = 0.5  # least length of a mean double-angle vector: below, strokes that cross share the pixel


def halve_resolution(instance: Instance) -> Instance | None:
    """The instance with 2 x 2 pixels merged into one, strokes by mean double angles; None without strokes."""
    height, width = instance.mask.shape
    even = np.pad(instance.mask, ((0, height % 2), (0, width % 2)))
    squares = even.reshape(even.shape[0] // 2, 2, even.shape[1] // 2, 2)
    mask = np.logical_or.reduce(squares, axis=(1, 3))
    parent = (instance.stroke_pixels[:, 0] // 2) * mask.shape[1] + instance.stroke_pixels[:, 1] // 2
    weight = np.bincount(parent, instance.w, mask.size)
    turn = [np.bincount(parent, instance.w * f(2 * instance.theta), mask.size) for f in (np.cos, np.sin)]
    aligned = np.nonzero(np.hypot(*turn) > _ALIGNED * weight)[0]
    if not len(aligned):
        return None
    grid = replace(instance.grid, mask=mask, pixel_size=round_to_digits(2 * instance.pixel_size))
    return replace(
        instance,
        domain=grid,
        stroke_index=grid.number.ravel()[aligned],
        theta=np.arctan2(turn[1][aligned], turn[0][aligned]) / 2,
        w=weight[aligned] / 4,
        pair_weights=None,
        stroke_coefficient=min(4 * instance.stroke_coefficient, MOST_WEIGHT),
        skew_coefficient=min(4 * instance.skew_coefficient, MOST_WEIGHT),
    )


def copy_to_fine_grid(coarse: CrossField, instance: Instance) -> FreeField:
    """The coarse crosses on the fine grid, with labels whose u is nearest to strokes, and with best jumps."""
    grid = instance.grid
    parent = coarse.instance.grid.numbers_at(grid.rows // 2, grid.columns // 2)
    return FreeField.of(CrossField.from_lines(instance, coarse.u_angle[parent], coarse.v_angle[parent]))
