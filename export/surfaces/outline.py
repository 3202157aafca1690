"""The outline of a surface along the strokes of its drawing, finer than the pixels of the grid.

Strokes separate the page into cells. A cell that the mask fills is inside up to the middle of its strokes,
and one that it hardly touches is outside. Any other cell, as through a gap in the outline, is divided by the
mask.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy import ndimage

from ...models.instance.instance import Instance
from ..pictures.layers import strokes_sheet
from ..pictures.svg import render_sheet
from ..pictures.underlay import Underlay
from ..shading.raster import Outline, depth_inside, grid_box, view_of_box

_SIDE: Final = 1024  # pixels of the longer side of the picture on which cells are found, at most
_SHARP: Final = 20  # pixels of that picture along a pixel of the grid, at most
_MARGIN: Final = 0.25  # of the longer side of the grid round it, so that the paper outside is one large cell
_WIDTH: Final = 0.25  # pixels of the grid that strokes are wide there: smaller gaps are closed
_LEAST: Final = 2.0  # pixels of that picture that strokes are wide, so that they have no gaps
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
    thick = max(_WIDTH, _LEAST * max(view.pixel) / instance.pixel_size)
    sheet = strokes_sheet(instance, view.box, drawing, thick)
    ink = render_sheet(sheet, view.width, view.height)[..., 3] > 127
    mask = depth_inside(instance, view) > 0
    side = np.array(view.pixel[::-1]) / instance.pixel_size
    away, depth = (ndimage.distance_transform_edt(area, side) for area in (~mask, mask))
    cells, count = ndimage.label(~ink)
    size, near, deep = (
        np.bincount(cells[area], minlength=count + 1) for area in (cells >= 0, away <= _NEAR, depth > _DEEP)
    )
    full, divided = near >= _FULL * size, deep > 0
    inside = np.where(full[cells], away <= _FAR, mask & divided[cells])
    nearest = ndimage.distance_transform_edt(ink, return_distances=False, return_indices=True)
    return Outline(view, ndimage.gaussian_filter(np.where(inside[*nearest], 1.0, -1.0), _BLUR))
