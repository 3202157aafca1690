"""A surface on a finer raster: smooth normals inside of a smooth outline.

A `View` states which part of the drawing a picture shows, and in how many pixels.

Normals are interpolated by cubic B-splines over the pixels of the mask. The outline is where the splines of
the mask itself are one half. A wider blur smooths its stairs. It may move the outline by half a pixel, and by
less where the mask or a gap in it is thin.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from ...models.errors import InputError
from ...models.input_limits import MAX_PIXELS, MAX_SIDE
from ...models.instance.domain import Bools, Floats
from ...models.instance.instance import Instance

SIDE: Final = 1024  # pixels, about, of the longer side of a picture of a page unless a side is given
_BLUR: Final = 2.0  # pixels of the grid over which stairs are smoothed
_MOVED: Final = 0.33  # at most, of the share of a place that is inside
_MOVED_THIN: Final = 0.12  # where the mask or a gap is one or two pixels thin
_SLOPE: Final = 2 / 3  # change of the inside share from a pixel to the next across a straight outline
_BLURRED_SLOPE: Final = 1 / (_BLUR * np.sqrt(2 * np.pi))
_DRAWN: Final = 0.4  # pixels from the border to strokes on it, which pass through the middles of pixels
_TIP: Final = 8  # most pixels of a tip; larger thin regions are parts
_BUMP: Final = 2  # most pixels of a bump, one pixel wide, that smoothing may remove; longer ones are lines
_RAISED: Final = 0.5  # added to the mask on lines: a diagonal one alone would reach one half only
ALL: Final = slice(None)
_REACH: Final = 2  # pixels of the grid to each side that a cubic B-spline has


Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class View:
    """A part of the drawing, and the size of a picture of it in pixels.

    box: x, y, width and height in the units of the drawing, y down.
    """

    box: Box
    width: int
    height: int

    @property
    def pixel(self) -> tuple[float, float]:
        """Width and height of a pixel of the picture, in the units of the drawing."""
        return self.box[2] / self.width, self.box[3] / self.height

    def around(self, box: Box) -> View:
        """The pixels of this picture, continued beyond its edges if need be, that cover a box."""
        start, corner, step = np.array(self.box[:2]), np.array(box[:2]), np.array(self.pixel)
        low = np.floor((corner - start) / step)
        count = np.ceil((corner + box[2:] - start) / step) - low
        (x, y), (wide, high) = (start + low * step).tolist(), (count * step).tolist()
        return View((x, y, wide, high), int(count[0]), int(count[1]))


def grid_box(instance: Instance) -> Box:
    """x, y, width and height of the grid in the units of the drawing."""
    height, width = instance.mask.shape
    return (*instance.origin, instance.pixel_size * width, instance.pixel_size * height)


def view_of_grid(instance: Instance, scale: int) -> View:
    """The whole grid, with `scale` pixels of the picture along each pixel of the grid."""
    height, width = instance.mask.shape
    return View(grid_box(instance), width * scale, height * scale)


def view_of_box(box: Box, side: int | None = None) -> View:
    """A picture of a box with `side` pixels along its longer side. Raises InputError.

    By default a unit has a whole number of pixels, for about SIDE in all: a box of whole units fits exactly.
    """
    longer = max(box[2:])
    side = round(longer * round(SIDE / longer)) or SIDE if side is None else side
    width, height = (max(1, round(side * extent / longer)) for extent in box[2:])
    if side < 1 or max(width, height) > MAX_SIDE or width * height > MAX_PIXELS:
        raise InputError(
            f"a picture cannot have {side} pixels on its longer side; give 1 to {MAX_SIDE}, and at most "
            f"{MAX_PIXELS // 10**6} million pixels in all"
        )
    return View(box, width, height)


@dataclass(frozen=True, eq=False)
class Raster:
    """Unit normals (..., 3) of a picture, x right, y up, z towards the viewer, and the depth (...) inside.

    The depth is the distance from the outline in pixels of the picture, exact near it; positive inside.
    """

    normals: Floats
    depth: Floats

    @property
    def opacity(self) -> Floats:
        """The part of each pixel inside of the outline (...)."""
        return np.clip(0.5 + self.depth, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class Outline:
    """An outline finer than the pixels of the grid: where a level [h, w] at the pixels of a view is 0.

    Inside, the level is positive.
    """

    view: View
    level: Floats


def raster(
    instance: Instance, normals: Floats, view: View, rows: slice = ALL, outline: Outline | None = None
) -> Raster:
    """The normals of a surface, (n, 3) at the pixels of the grid, in some rows of a view.

    outline: of the surface, which replaces that of the mask.
    """
    from scipy import ndimage

    mask = np.pad(instance.mask, _REACH)
    spread = _interpolation(_padded_grid(instance), view, rows)
    image = np.zeros((*mask.shape, 3))
    image[mask] = normals
    image[~mask] = _normalise(ndimage.gaussian_filter(image, (_BLUR, _BLUR, 0), mode="constant")[~mask])
    unit = _normalise(np.stack([spread(part)[1:-1] for part in np.moveaxis(image, -1, 0)], axis=-1))
    return Raster(unit, depth_inside(instance, view, rows, outline))


def depth_inside(instance: Instance, view: View, rows: slice = ALL, outline: Outline | None = None) -> Floats:
    """Depth (h, w) of some rows of a view, as in `Raster`. outline: replaces that of the mask."""
    if outline is None:
        spread = _interpolation(_padded_grid(instance), view, rows)
        depth = _depth_in_mask(np.pad(instance.mask, _REACH), border_width(instance), spread)
    else:
        outside = outline.level.min()
        depth = _interpolation(outline.view, view, rows)(outline.level - outside) + outside
    depth = np.pad(depth, ((0, 0), (1, 1)), mode="edge")
    depth /= np.maximum(np.hypot(*np.gradient(depth)), 1e-9)
    return depth[1:-1, 1:-1]


def _padded_grid(instance: Instance) -> View:
    """The grid with a border as wide as a spline reaches, with one pixel for each of its own."""
    pixel, (height, width) = instance.pixel_size, np.add(instance.mask.shape, 2 * _REACH).tolist()
    x, y = (start - _REACH * pixel for start in instance.origin)
    return View((x, y, width * pixel, height * pixel), width, height)


def _normalise(vectors: Floats) -> Floats:
    """The vectors (..., 3) with length 1; towards the viewer where there is none."""
    length = np.sqrt(np.einsum("...i,...i->...", vectors, vectors))
    unit: Floats = vectors / np.maximum(length, 1e-9)[..., None]
    unit[length <= 1e-9] = (0.0, 0.0, 1.0)
    return unit


def _interpolation(values: View, view: View, rows: slice) -> Callable[[Floats], Floats]:
    """The function that interpolates values [h, w], 0 beyond them, at the pixels of some rows of a view.

    It adds a row above and below.
    """
    (wide, high), (step_x, step_y) = view.pixel, values.pixel
    numbers = np.arange(view.height)[rows]
    down = (
        view.box[1] - values.box[1] + (np.arange(numbers[0] - 1, numbers[-1] + 2, dtype=float) + 0.5) * high
    )
    right = view.box[0] - values.box[0] + (np.arange(view.width, dtype=float) + 0.5) * wide
    up, across = _splines(values.height, down / step_y - 0.5), _splines(values.width, right / step_x - 0.5)
    reached = np.unique(up.indices)
    used = slice(reached[0], reached[-1] + 1) if len(reached) else slice(0)
    up = up[:, used]
    return lambda image: np.asarray(up @ (across @ image[used].T).T)


def _depth_in_mask(mask: Bools, strokes: float, spread: Callable[[Floats], Floats]) -> Floats:
    """A level that is 0 on the smooth outline of a mask and positive inside.

    strokes: part of the border that carries strokes, as from `border_width`. spread: interpolates.
    """
    from scipy import ndimage

    lines = _lines(mask)
    thin = spread(
        (_find_thin_parts(mask) | ndimage.binary_dilation(lines, np.ones((3, 3)))).astype(np.float64)
    )
    within = _DRAWN * strokes * (1 - thin)
    solid = mask.astype(np.float64)
    blurred = ndimage.gaussian_filter(solid, _BLUR, mode="constant")
    narrow = spread(solid + _RAISED * lines) - _SLOPE * within
    wide = spread(blurred) - _BLURRED_SLOPE * within
    most = _MOVED + thin * (_MOVED_THIN - _MOVED)
    return np.asarray(narrow + np.clip(wide - narrow, -most, most) - 0.5)


def _splines(count: int, place: Floats) -> Any:
    """The cubic B-splines of `count` pixels at places (m,) in pixels, a sparse matrix (m, count)."""
    from scipy import sparse

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
