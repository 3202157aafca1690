"""A surface on a finer raster: smooth normals inside of a smooth outline.

Normals are interpolated by cubic B-splines over the pixels of the mask. The outline is where the splines of
the mask itself are one half. A wider blur smooths its stairs. It may move the outline by half a pixel, and by
less where the mask or a gap in it is thin.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from ...models.errors import InputError
from ...models.input_limits import MAX_PIXELS
from ...models.instance.domain import Bools, Floats
from ...models.instance.instance import Instance

SIDE: Final = 1000  # pixels, about, of a picture's longer side unless a scale is given
_BLUR: Final = 2.0  # pixels of the grid over which stairs are smoothed
_MOVED: Final = 0.33  # at most, of the share of a place that is inside
_MOVED_THIN: Final = 0.12  # where the mask or a gap is one or two pixels thin
_SLOPE: Final = 2 / 3  # change of the inside share from a pixel to the next across a straight outline
_BLURRED_SLOPE: Final = 1 / (_BLUR * np.sqrt(2 * np.pi))
_DRAWN: Final = 0.4  # pixels from the border to strokes on it, which pass through the middles of pixels
_TIP: Final = 8  # most pixels of a tip; larger thin regions are parts
_BUMP: Final = 2  # most pixels of a bump, one pixel wide, that smoothing may remove; longer ones are lines
_RAISED: Final = 0.5  # added to the mask on lines: a diagonal one alone would reach one half only
_REACH: Final = 2  # pixels of the grid to each side that a cubic B-spline has


@dataclass(frozen=True, eq=False)
class Raster:
    """Unit normals (h, w, 3), x right, y up, z towards the viewer, and opacity (h, w), of a picture."""

    normals: Floats
    opacity: Floats


def raster(instance: Instance, normals: Floats, scale: int | None = None) -> Raster:
    """The normals of a surface, (n, 3) at the pixels of the grid, at a scale as in `choose_scale`."""
    from scipy import ndimage

    scale = choose_scale(instance, scale)
    mask = np.pad(instance.mask, _REACH)
    image = np.zeros((*mask.shape, 3))
    image[mask] = normals
    up, across = (_splines(count, scale)[_REACH * scale : -_REACH * scale] for count in mask.shape)

    def spread(values: Floats) -> Floats:
        return np.asarray(up @ (across @ values.T).T)

    summed = np.stack([spread(part) for part in np.moveaxis(image, -1, 0)], axis=-1)
    length = np.linalg.norm(summed, axis=-1, keepdims=True)
    viewer = np.array([0.0, 0.0, 1.0])
    unit = np.where(length > 1e-9, summed / np.maximum(length, 1e-9), viewer)
    lines = _lines(mask)
    thin = spread(
        (_find_thin_parts(mask) | ndimage.binary_dilation(lines, np.ones((3, 3)))).astype(np.float64)
    )
    within = _DRAWN * border_width(instance) * (1 - thin)
    solid = mask.astype(np.float64)
    blurred = ndimage.gaussian_filter(solid, _BLUR, mode="constant")
    narrow = spread(solid + _RAISED * lines) - _SLOPE * within
    wide = spread(blurred) - _BLURRED_SLOPE * within
    most = _MOVED + thin * (_MOVED_THIN - _MOVED)
    # The part of each pixel inside of the outline, where the level is one half.
    depth = np.pad(narrow + np.clip(wide - narrow, -most, most) - 0.5, 1, mode="edge")
    steepness = np.hypot(*np.gradient(depth))
    opacity = np.clip(0.5 + depth / np.maximum(steepness, 1e-9), 0.0, 1.0)
    return Raster(unit, opacity[1:-1, 1:-1])


def choose_scale(instance: Instance, scale: int | None) -> int:
    """Picture pixels per pixel of the grid, by default for a longer side of SIDE. Raises InputError."""
    height, width = instance.mask.shape
    if scale is None:
        return max(1, round(SIDE / int(max(height, width))))
    if scale < 1 or height * width * scale**2 > MAX_PIXELS:
        raise InputError(
            f"the scale {scale} makes no picture of {width} x {height} pixels: it has to be 1 or more, "
            f"and the picture no more than {MAX_PIXELS // 10**6} million pixels; choose another scale"
        )
    return scale


def _splines(count: int, scale: int) -> Any:
    """The cubic B-splines of `count` pixels at the centres of `count * scale` finer ones, a sparse matrix."""
    from scipy import sparse

    place = (np.arange(count * scale) + 0.5) / scale - 0.5
    near = np.floor(place)[:, None].astype(np.int64) + np.arange(1 - _REACH, 1 + _REACH)
    off = np.abs(place[:, None] - near)
    weight = np.where(off < 1, 2 / 3 - off**2 + off**3 / 2, np.maximum(2 - off, 0.0) ** 3 / 6)
    row = np.broadcast_to(np.arange(len(place))[:, None], near.shape)
    there = (near >= 0) & (near < count)
    entries = (weight[there], (row[there], near[there]))
    return sparse.csr_array(entries, shape=(len(place), count))


def _find_thin_parts(mask: Bools) -> Bools:
    """Pixels in or next to a part of the mask, or a gap in it, too thin for 3 x 3 pixels, but not a tip."""
    from scipy import ndimage

    block = np.ones((3, 3), dtype=bool)
    wide = np.pad(mask, 3)
    changed = (ndimage.binary_opening(wide, block) != wide) | (ndimage.binary_closing(wide, block) != wide)
    part, _ = ndimage.label(changed, block)
    long = np.bincount(part.ravel()) > _TIP
    return np.asarray(ndimage.binary_dilation(changed & long[part], block)[3:-3, 3:-3])


def _lines(mask: Bools) -> Bools:
    """Pixels of parts of the mask that are one pixel wide: in no block of 2 x 2, and longer than a bump."""
    from scipy import ndimage

    single = mask & ~ndimage.binary_opening(mask, np.ones((2, 2)))
    part, _ = ndimage.label(single, np.ones((3, 3)))
    return np.asarray(single & (np.bincount(part.ravel()) > _BUMP)[part])


def border_width(instance: Instance) -> float:
    """The part of the pixels at the border of the mask that carry strokes, 0 to 1."""
    from scipy import ndimage

    mask = np.pad(instance.mask, 1)
    border = (mask & ~ndimage.binary_erosion(mask))[1:-1, 1:-1]
    return float(border[tuple(instance.stroke_pixels.T)].sum() / border.sum())
