"""The region that a drawing encloses, for sketches without a mask."""

from __future__ import annotations

from typing import Final

import numpy as np

from ..instance.angles import cosine, line_of, sine
from ..instance.domain import Bools, Floats
from .cover import LEAST_WEIGHT, CurvePixels, Frame
from .curves import Curves

GAPS: Final = (0.03, 0.06, 0.12)  # shares of the longer side: gaps that count as closed, tried in turn
ENCLOSED: Final = 0.25  # least share of the strokes' convex hull that a closed drawing fills
CRUMB: Final = 0.01  # least share of a region for a separate part; a grazing stroke cuts off less
HELD: Final = 2.0  # least stroke length, in pixel sides, in a separate part: a stroke's loose end has less
STEP: Final = 3.0  # pixels over which a stroke is compared with the outline
THICKER: Final = 1.25  # width of the thickest strokes of a picture relative to typical ones
THICK: Final = 2  # pixels of a stroke between two areas
_OVERSHOOT: Final = 0.25  # of the length of a line: a longer part of it is no mere overshoot
_DEEP: Final = 2.0  # pixels from the border of an area: an end that is nearer runs through it
_NUDGE: Final = 1e-9  # of a pixel: the limit of exactly 30 degrees is decided equally on every processor


def find_inside(strokes: Bools) -> Bools:
    """The pixels [height, width] of strokes, or not reached from outside through their gaps.

    The narrowest of GAPS for which the drawing encloses something decides. An open drawing, which encloses
    almost nothing at any of them, gets the full rectangle.
    """
    hull = convex_area(strokes)
    for gap in GAPS:
        region = enclosed_region(strokes, gap)
        if drop_narrow_parts(region).sum() >= ENCLOSED * hull:
            return region
    return np.ones_like(strokes)


def drop_narrow_parts(region: Bools) -> Bools:
    """The region without parts that are narrower than three pixels, such as ends of strokes."""
    from scipy import ndimage

    return np.asarray(ndimage.binary_opening(region, np.ones((3, 3))))


def convex_area(pixels: Bools) -> float:
    """The area of the convex hull of some pixels."""
    from scipy.spatial import ConvexHull

    rows = np.flatnonzero(pixels.any(axis=1))
    first = pixels[rows].argmax(axis=1)
    last = pixels.shape[1] - pixels[rows, ::-1].argmax(axis=1)
    corners = [np.stack([rows + down, side], axis=1) for down in (0, 1) for side in (first, last)]
    return float(ConvexHull(np.concatenate(corners)).volume)


def keep_parts_with_strokes(region: Bools, weight: Floats) -> Bools:
    """The 4-connected parts of a region that contain curvature lines; other parts have no data.

    weight: [height, width], w of the strokes. The part with most strokes is always kept.
    """
    from scipy import ndimage

    label, count = ndimage.label(region)
    size = np.bincount(label.ravel(), minlength=count + 1)
    directed = region & (weight >= LEAST_WEIGHT)
    held = np.bincount(label.ravel(), np.where(directed, weight, 0.0).ravel(), minlength=count + 1)
    is_part = (held >= HELD) & (size >= max(4, CRUMB * region.sum()))
    is_part[np.argmax(held)] = held.max() > 0
    is_part[0] = False
    return np.asarray(is_part[label])


def find_overshoots(curves: Curves, pixels: CurvePixels, area: Bools, frame: Frame) -> Bools:
    """The pixels [height, width] of an area that only ends of curvature lines reach.

    Such an end lies inside of a part of the area, and most of its line in other parts. pixels: of the lines.
    """
    from scipy import ndimage

    label, count = ndimage.label(area)
    owner, row, column = pixels
    piece, place, size = np.unique(
        owner * (count + 1) + label[row, column], return_inverse=True, return_counts=True
    )
    step = np.diff(curves.curve, prepend=-1, append=-1) != 0
    at = np.concatenate([curves.points[step[:-1], 0], curves.points[step[1:], 3]])
    pixel = np.floor((at - (frame.x, frame.y)) / frame.pixel).astype(int)
    x, y = pixel.clip(0, np.array(area.shape[::-1]) - 1).T
    deep = (ndimage.distance_transform_edt(area) >= _DEEP)[y, x]
    ends = np.tile(curves.curve[step[:-1]], 2)[deep] * (count + 1) + label[y, x][deep]
    is_end = np.isin(piece, ends) & (size < _OVERSHOOT * np.bincount(owner)[piece // (count + 1)])
    passed = np.zeros((2, *area.shape), dtype=bool)
    passed[is_end[place].astype(int), row, column] = True
    return np.asarray(passed[1] & ~passed[0])


def find_strokes_along_outline(region: Bools, direction: Floats, width: float) -> Bools:
    """The pixels [height, width] at the border of a region whose strokes, of this width, run along it.

    direction: [height, width, 2], double-angle vectors (y up). A stroke is followed by STEP pixels to both
    sides. It runs along the border if, on at least one side, its distance from the outside changes by at most
    half of that: 30 degrees. A region without an outside, as in an open drawing, has no border.
    """
    from scipy import ndimage

    if region.all():
        return np.zeros_like(region)
    pad = int(STEP) + 1
    padded = np.pad(region, pad)
    # Half a pixel from the centres of the pixels to the edges between inside and outside.
    inside, outside = (ndimage.distance_transform_edt(side) - 0.5 for side in (padded, ~padded))
    depth = np.where(padded, inside, -outside)
    at = np.argwhere(region & (depth[pad:-pad, pad:-pad] <= 1.5 + THICKER * width))
    theta = line_of(direction[tuple(at.T)])
    way = STEP * np.stack([-sine(theta), cosine(theta)], axis=1)
    here = depth[tuple((at + pad).T)]
    change = [
        np.abs(ndimage.map_coordinates(depth, (at + pad + side * way).T, order=1) - here) for side in (-1, 1)
    ]
    along = np.zeros_like(region)
    along[tuple(at.T)] = np.minimum(*change) <= STEP / 2 + _NUDGE
    return along


def enclosed_region(strokes: Bools, gap: float) -> Bools:
    """The region that a disc, of a share `gap` of the longer side, cannot reach without touching a stroke."""
    from scipy import ndimage

    radius = max(1.0, gap * max(strokes.shape) / 2)
    pad = int(np.ceil(radius)) + 2
    walls = np.pad(strokes, pad)
    free = ndimage.distance_transform_edt(~walls) > radius
    label, _ = ndimage.label(free)
    outside = ndimage.distance_transform_edt(label != label[0, 0]) <= radius
    region = ~outside | walls
    region &= ~_find_slits(region & ~walls, free, walls)
    return np.asarray(region[pad:-pad, pad:-pad])


def _find_slits(inside: Bools, free: Bools, walls: Bools) -> Bools:
    """The gaps between limbs: large parts of the inside that are open, and nowhere as wide as the disc.

    free: where the disc fits. Rooms that only their mouths close are wider than these. The strokes along a
    slit bound other parts of the inside, unlike strokes of a hatching.
    """
    from scipy import ndimage

    eight = np.ones((3, 3), dtype=bool)
    label, _ = ndimage.label(~walls)
    label, count = ndimage.label(inside & (label == label[0, 0]))
    slit = np.bincount(label.ravel(), minlength=count + 1) >= max(4, CRUMB * inside.sum())
    slit[label[free]] = False
    slit[0] = False
    beside = np.where(ndimage.binary_dilation(walls, eight), label, 0)
    beyond = ndimage.binary_dilation(inside & ~slit[label], eight, iterations=THICK + 1)
    bounding, every = (np.bincount(some.ravel(), minlength=count + 1) for some in (beside[beyond], beside))
    slit &= 2 * bounding > every
    return np.asarray(slit[label])


def largest_part(mask: Bools, neighbours: Bools | None = None) -> Bools:
    """The connected part of a mask with most pixels, the first of equal ones.

    neighbours: [3, 3], which pixels touch the middle one; without it those at its four sides.
    """
    from scipy import ndimage

    label, _ = ndimage.label(mask, neighbours)
    return np.asarray(label == 1 + np.argmax(np.bincount(label.ravel(), minlength=2)[1:]))
