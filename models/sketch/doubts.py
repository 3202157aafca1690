"""Doubts about a drawing: warnings that it may have been misread, each with a place and a remedy."""

from __future__ import annotations

from typing import Final

import numpy as np

from ..instance.angles import line_difference, line_of
from ..instance.grid import Bools, Floats
from .cover import Box, Cover, Frame
from .outline import THICK, convex_area, drop_narrow_parts

BLOCK: Final = 4  # side in pixels of a block filled by strokes; no sample has one from 16 pixels on
CROWDED: Final = 0.1  # least share of the solved pixels in blocks filled by strokes that causes a warning
LOOSE: Final = 0.08  # least share of stroke pixels that bound nothing, which causes a warning
BOX: Final = 0.93  # least share of a box's border along three directions, and of its area in its convex hull
_BINS: Final = 36
_WIDE: Final = 3  # bins of directions, 15 degrees, that count as one
_BESIDE: Final = 0.45  # least share of the box in the strokes beside an area between the box and the body
_TOUCHES: Final = 4  # most strokes that end at a box round a body; lines across a sheet end at its border
OFF: Final = 0.01  # least share of the solved pixels more than a pixel off the page that causes a warning


def describe_open_drawing(region: Bools) -> str | None:
    """A region that is the whole rectangle because the drawing encloses nothing."""
    if not region.all():
        return None
    return "the strokes enclose nothing, so the whole rectangle is solved; close the outline or give a mask"


def describe_loose_strokes(walls: Bools, region: Bools, frame: Frame) -> str | None:
    """Many stroke pixels that bound nothing although others do."""
    from scipy import ndimage

    eight = np.ones((3, 3), dtype=bool)
    bounding = ndimage.binary_dilation(region & ~walls, eight, iterations=THICK)
    label, count = ndimage.label(walls & ~bounding & ~ndimage.binary_opening(walls, eight), eight)
    size = np.bincount(label.ravel(), minlength=count + 1)
    size[0] = 0
    if region.all() or size.sum() < LOOSE * walls.sum():
        return None
    return (
        f"{size.sum()} of {walls.sum()} stroke pixels bound no area, most of them round "
        f"{_describe_middle(label == np.argmax(size), frame)}: what they should enclose is left out; "
        "close the outline there or give a mask"
    )


def describe_box(walls: Bools, region: Bools, strokes: Cover) -> str | None:
    """An outermost outline that is a box of straight lines round another outline."""
    from scipy import ndimage

    shape, theta = drop_narrow_parts(region, 5), line_of(strokes.direction)
    border = walls & shape & ndimage.binary_dilation(~shape, border_value=1)
    if region.all() or not border.any() or _share_of_main_directions(theta[border]) < BOX:
        return None
    if shape.sum() < BOX * convex_area(shape):
        return None
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
        return None
    return (
        f"a box of straight lines encloses another outline, and the {room} pixels between them are solved "
        "for; if it is a construction line, remove it or give a mask"
    )


def _share_of_main_directions(theta: Floats) -> float:
    """The share of lines close to the three most frequent directions, each found without the earlier ones."""
    rest = np.bincount((theta / np.pi * _BINS).astype(np.intp) % _BINS, minlength=_BINS)
    for _ in range(3):
        near = np.arange(_WIDE) + np.argmax(sum(np.roll(rest, -step) for step in range(_WIDE)))
        rest[near % _BINS] = 0
    return 1 - float(rest.sum()) / max(len(theta), 1)


def describe_crowding(filled: Bools, mask: Bools, frame: Frame) -> str | None:
    """The largest place filled by strokes, which leave no room between them."""
    from scipy import ndimage

    label, count = ndimage.label(ndimage.binary_opening(filled & mask, np.ones((BLOCK, BLOCK))))
    size = np.bincount(label.ravel(), minlength=count + 1)
    size[0] = 0
    if size.max() < max(CROWDED * mask.sum(), 1):
        return None
    return (
        f"strokes leave no room between them round {_describe_middle(label == np.argmax(size), frame)}, "
        f"all in all on {size.sum() / mask.sum():.0%} of the pixels to solve for, where they give no "
        "direction; choose a larger size, or draw fewer lines and no solid ink there"
    )


def describe_off_page(mask: Bools, frame: Frame, page: Box | None) -> str | None:
    """Pixels of a mask that lie off the page (x, y, width, height) of the drawing."""
    if page is None:
        return None
    inside = []
    for edges, start, side in zip(frame.edges, page[1::-1], page[:1:-1], strict=True):
        middle = (edges[:-1] + edges[1:]) / 2
        inside.append((middle >= start - frame.pixel) & (middle <= start + side + frame.pixel))
    off = 1 - mask[np.ix_(*inside)].sum() / mask.sum()
    if off < OFF:
        return None
    return f"{off:.0%} of the pixels to solve for lie off the page, where no mask reaches; enlarge the page"


def _describe_middle(pixels: Bools, frame: Frame) -> str:
    """The middle of some pixels as text."""
    row, column = np.nonzero(pixels)
    return _describe_point(
        np.array([frame.x, frame.y]) + frame.pixel * (np.array([column.mean(), row.mean()]) + 0.5)
    )


def _describe_point(point: Floats) -> str:
    """A point (x, y) as text."""
    return f"({point[0]:.4g}, {point[1]:.4g})"
