"""The region that a drawing encloses, for sketches without a mask."""

from __future__ import annotations

from typing import Final

import numpy as np

from ..instance.angles import cosine, line_difference, line_of, sine
from ..instance.grid import Bools, Floats
from .cover import Cover, Frame

GAPS: Final = (0.03, 0.06, 0.12)  # shares of the longer side: gaps that count as closed, tried in turn
ENCLOSED: Final = 0.25  # least share of the strokes' convex hull that a closed drawing fills
CRUMB: Final = 0.01  # least share of a region for a separate part; a grazing stroke cuts off less
HELD: Final = 2.0  # least stroke length, in pixel sides, in a separate part: a stroke's loose end has less
STEP: Final = 3.0  # pixels over which a stroke is compared with the outline
THICKER: Final = 1.25  # width of the thickest strokes of a picture relative to typical ones
BLOCK: Final = 4  # side in pixels of a block filled by strokes; no sample has one from 16 pixels on
CROWDED: Final = 0.1  # least share of the solved pixels in blocks filled by strokes that causes a warning
LOOSE: Final = 0.08  # least share of stroke pixels that bound nothing, which causes a warning
BOX: Final = 0.93  # least share of a box's border along three directions, and of its area in its convex hull
_THICK: Final = 2  # pixels of a stroke between two areas
_BINS: Final = 36
_WIDE: Final = 3  # bins of directions, 15 degrees, that count as one
_BESIDE: Final = 0.45  # least share of the box in the strokes beside an area between the box and the body
_TOUCHES: Final = 4  # most strokes that end at a box round a body; lines across a sheet end at its border
OFF: Final = 0.01  # least share of the solved pixels more than a pixel off the page that causes a warning
_NUDGE: Final = 1e-9  # of a pixel: the limit of exactly 30 degrees is decided equally on every processor


def inside_outline(strokes: Bools) -> Bools:
    """The pixels [height, width] of strokes, or not reached from outside through their gaps.

    The narrowest of GAPS for which the drawing encloses something decides. An open drawing, which encloses
    almost nothing at any of them, gets the full rectangle.
    """
    hull = _convex_area(strokes)
    for gap in GAPS:
        region = enclosed(strokes, gap)
        if _as_wide(region, 3).sum() >= ENCLOSED * hull:
            return region
    return np.ones_like(strokes)


def _as_wide(region: Bools, least: int) -> Bools:
    """The region without parts that are narrower than so many pixels, such as ends of strokes."""
    from scipy import ndimage

    return np.asarray(ndimage.binary_opening(region, np.ones((least, least))))


def _convex_area(pixels: Bools) -> float:
    """The area of the convex hull of some pixels."""
    from scipy.spatial import ConvexHull

    row, column = np.nonzero(pixels)
    corners = np.concatenate([np.stack([row + a, column + b], axis=1) for a in (0, 1) for b in (0, 1)])
    return float(ConvexHull(corners).volume)


def parts_with(region: Bools, weight: Floats) -> Bools:
    """The 4-connected parts of a region that contain curvature lines; other parts have no data.

    weight: [height, width], w of the stroke pixels, else 0. The part with most strokes is always kept.
    """
    from scipy import ndimage

    label, count = ndimage.label(region)
    size = np.bincount(label.ravel(), minlength=count + 1)
    held = np.bincount(label.ravel(), np.where(region, weight, 0.0).ravel(), minlength=count + 1)
    kept = (held >= HELD) & (size >= max(4, CRUMB * region.sum()))
    kept[np.argmax(held)] = held.max() > 0
    kept[0] = False
    return np.asarray(kept[label])


def along_outline(region: Bools, direction: Floats, width: float) -> Bools:
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


def boundless(region: Bools) -> tuple[str, ...]:
    """A warning if the region is the whole rectangle because the drawing encloses nothing, or none."""
    if not region.all():
        return ()
    return (
        "the strokes enclose nothing, so the whole rectangle is solved; close the outline or give a mask",
    )


def unbounded(walls: Bools, region: Bools, frame: Frame) -> tuple[str, ...]:
    """A warning if many stroke pixels bound nothing although others do, or none."""
    from scipy import ndimage

    eight = np.ones((3, 3), dtype=bool)
    bounding = ndimage.binary_dilation(region & ~walls, eight, iterations=_THICK)
    label, count = ndimage.label(walls & ~bounding & ~ndimage.binary_opening(walls, eight), eight)
    size = np.bincount(label.ravel(), minlength=count + 1)
    size[0] = 0
    if region.all() or size.sum() < LOOSE * walls.sum():
        return ()
    warning = (
        f"{size.sum()} of {walls.sum()} stroke pixels bound no area, most of them round "
        f"{_middle(label == np.argmax(size), frame)}: what they should enclose is left out; "
        "close the outline there or give a mask"
    )
    return (warning,)


def boxed(walls: Bools, region: Bools, strokes: Cover) -> tuple[str, ...]:
    """A warning if the outermost outline is a box of straight lines round another outline, or none."""
    from scipy import ndimage

    shape, theta = _as_wide(region, 5), line_of(strokes.direction)
    border = walls & shape & ndimage.binary_dilation(~shape, border_value=1)
    if region.all() or not border.any() or _straight(theta[border]) < BOX:
        return ()
    if shape.sum() < BOX * _convex_area(shape):
        return ()
    away, near = ndimage.distance_transform_edt(~border, return_indices=True)
    across = walls & (away > 1) & (away <= 3) & (line_difference(theta, theta[tuple(near)]) > np.pi / 4)
    label, count = ndimage.label(shape & ~walls)
    # Strokes of pictures are some pixels thick, so a pixel of the border belongs to the nearest area.
    nearest = ndimage.distance_transform_edt(label == 0, return_distances=False, return_indices=True)
    beside = np.where(walls, ndimage.maximum_filter(label, size=3), 0)
    of_box, of_all, size = (
        np.bincount(some.ravel(), minlength=count + 1)[1:]
        for some in (label[tuple(nearest)][border], beside, label)
    )
    between, (_, touching) = of_box > _BESIDE * of_all, ndimage.label(across, np.ones((3, 3)))
    room, along = size[between].sum(), of_box[between].sum()
    if touching > _TOUCHES or min(room, 2 * along) < border.sum() or size[~between].sum() < room / 4:
        return ()
    warning = (
        f"a box of straight lines encloses another outline, and the {room} pixels between them are solved "
        "for; if it is a construction line, remove it or give a mask"
    )
    return (warning,)


def _straight(theta: Floats) -> float:
    """The share of lines close to the three most frequent directions, each found without the earlier ones."""
    rest = np.bincount((theta / np.pi * _BINS).astype(np.intp) % _BINS, minlength=_BINS)
    for _ in range(3):
        near = np.arange(_WIDE) + np.argmax(sum(np.roll(rest, -step) for step in range(_WIDE)))
        rest[near % _BINS] = 0
    return 1 - float(rest.sum()) / max(len(theta), 1)


def crowded(filled: Bools, solve: Bools, frame: Frame) -> tuple[str, ...]:
    """A warning about the largest place filled by strokes, which leave no room between them, or none."""
    from scipy import ndimage

    label, count = ndimage.label(ndimage.binary_opening(filled & solve, np.ones((BLOCK, BLOCK))))
    size = np.bincount(label.ravel(), minlength=count + 1)
    size[0] = 0
    if size.max() < max(CROWDED * solve.sum(), 1):
        return ()
    warning = (
        f"strokes leave no room between them round {_middle(label == np.argmax(size), frame)}, all in all on "
        f"{size.sum() / solve.sum():.0%} of the pixels to solve for, where they give no direction; choose a "
        "larger size, or draw fewer lines and no solid ink there"
    )
    return (warning,)


def off_page(solve: Bools, frame: Frame, page: tuple[float, float, float, float] | None) -> tuple[str, ...]:
    """A warning if pixels to solve for lie off the page (x, y, width, height) of the drawing, or none."""
    if page is None:
        return ()
    inside = []
    for edges, start, side in zip(frame.edges, page[1::-1], page[:1:-1], strict=True):
        middle = (edges[:-1] + edges[1:]) / 2
        inside.append((middle >= start - frame.pixel) & (middle <= start + side + frame.pixel))
    off = 1 - solve[np.ix_(*inside)].sum() / solve.sum()
    if off < OFF:
        return ()
    return (
        f"{off:.0%} of the pixels to solve for lie off the page, where no mask reaches; enlarge the page",
    )


def _middle(pixels: Bools, frame: Frame) -> str:
    """The middle of some pixels as text."""
    row, column = np.nonzero(pixels)
    return place(np.array([frame.x, frame.y]) + frame.pixel * (np.array([column.mean(), row.mean()]) + 0.5))


def place(point: Floats) -> str:
    """A point (x, y) as text."""
    return f"({point[0]:.4g}, {point[1]:.4g})"


def enclosed(strokes: Bools, gap: float = GAPS[0]) -> Bools:
    """The region that a disc, of a share `gap` of the longer side, cannot reach without touching a stroke."""
    from scipy import ndimage

    radius = max(1.0, gap * max(strokes.shape) / 2)
    pad = int(np.ceil(radius)) + 2
    walls = np.pad(strokes, pad)
    free = ndimage.distance_transform_edt(~walls) > radius
    label, _ = ndimage.label(free)
    outside = ndimage.distance_transform_edt(label != label[0, 0]) <= radius
    region = ~outside | walls
    region &= ~_slits(region & ~walls, free, walls)
    return np.asarray(region[pad:-pad, pad:-pad])


def _slits(inside: Bools, free: Bools, walls: Bools) -> Bools:
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
    beyond = ndimage.binary_dilation(inside & ~slit[label], eight, iterations=_THICK + 1)
    bounding, every = (np.bincount(some.ravel(), minlength=count + 1) for some in (beside[beyond], beside))
    slit &= 2 * bounding > every
    return np.asarray(slit[label])


def largest_part(mask: Bools) -> Bools:
    """The 4-connected part of a mask with most pixels, the first of equal ones."""
    from scipy import ndimage

    label, _ = ndimage.label(mask)
    return np.asarray(label == 1 + np.argmax(np.bincount(label.ravel(), minlength=2)[1:]))
