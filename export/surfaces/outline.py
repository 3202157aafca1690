"""The outline of a surface along the strokes of its drawing, finer than the pixels of the grid.

Strokes separate the page into cells. A cell that the mask fills is inside up to the middle of its strokes,
and one that it hardly touches is outside. Any other cell, as through a gap in the outline, is divided by the
mask.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy import ndimage

from ...models.instance.domain import Bools
from ...models.instance.instance import Instance
from ...models.sketch.cover import Frame, pixels_along
from ..pictures.layers import strokes_sheet
from ..pictures.svg import render_sheet
from ..pictures.underlay import Underlay
from ..shading.raster import Outline, View, depth_inside, grid_box, view_of_box

_SIDE: Final = 1024  # pixels of the longer side of the picture on which cells are found, at most
_SHARP: Final = 20  # pixels of that picture along a pixel of the grid, at most
_MARGIN: Final = 0.25  # of the longer side of the grid round it, so that the paper outside is one large cell
_WIDTH: Final = 0.25  # pixels of the grid that strokes are wide there: smaller gaps are closed
_LEAST: Final = 2.0  # pixels of that picture that strokes are wide, so that they have no gaps
_FLAT: Final = 0.1  # pixels of that picture from a curve to its segments
_FULL: Final = 0.6  # least share of a cell near the mask that makes it inside
_BLUR: Final = 2.0  # pixels of that picture over which the outline is smoothed
_DEEP: Final = 1.0  # pixels of the grid from the border of the mask: a cell with none so deep is outside
_NEAR: Final = 1.5  # pixels of the grid from the mask
_FAR: Final = 4.0  # pixels of the grid from the mask beyond which nothing is inside


def find_outline(instance: Instance, drawing: Underlay) -> Outline:
    """The outline along the strokes of a drawing."""
    x, y, width, height = grid_box(instance)
    margin = _MARGIN * max(width, height)
    longer = round(_SHARP * (1 + 2 * _MARGIN) * max(instance.mask.shape))
    view = view_of_box((x - margin, y - margin, width + 2 * margin, height + 2 * margin), min(_SIDE, longer))
    thick = max(_WIDTH * instance.pixel_size / max(view.pixel), _LEAST)
    ink = _find_ink(instance, drawing, view, thick / 2)
    mask = depth_inside(instance, view) > 0
    side = np.array(view.pixel[::-1]) / instance.pixel_size
    # Distances that are compared with whole pixels of the grid need only some pixels of the picture.
    step = int(thick)
    few = mask[step // 2 :: step, step // 2 :: step]
    at = np.ix_(
        *(np.minimum(np.arange(n) // step, m - 1) for n, m in zip(mask.shape, few.shape, strict=True))
    )
    away, depth = (ndimage.distance_transform_edt(area, step * side)[at] for area in (~few, few))
    cells, count = ndimage.label(~ink)
    size, near, deep = (
        np.bincount(cells[area], minlength=count + 1) for area in (cells >= 0, away <= _NEAR, depth > _DEEP)
    )
    full, divided = near >= _FULL * size, deep > 0
    inside = np.where(full[cells], away <= _FAR, mask & divided[cells])
    nearest = ndimage.distance_transform_edt(ink, return_distances=False, return_indices=True)
    return Outline(view, ndimage.gaussian_filter(np.where(inside[*nearest], 1.0, -1.0), _BLUR))


def _find_ink(instance: Instance, drawing: Underlay, view: View, reach: float) -> Bools:
    """The pixels of a view with ink, or within a reach of a curve."""
    if drawing.ink is not None:
        return render_sheet(strokes_sheet(instance, view.box, drawing), view.width, view.height)[..., 3] > 127
    segments = (drawing.segments(_FLAT * min(view.pixel)) - view.box[:2]) / view.pixel
    line = pixels_along(segments, Frame(0.0, 0.0, 1.0, view.height, view.width))
    across = np.arange(-int(reach), int(reach) + 1)
    return np.asarray(ndimage.binary_dilation(line, np.hypot(across, across[:, None]) <= reach))
