"""Doubts about a drawing: warnings that it may have been misread, each with a place and a remedy."""

from __future__ import annotations

from typing import Final

import numpy as np

from ..instance.domain import Bools
from .cover import Frame
from .outline import THICK, largest_part

_BLOCK: Final = 4  # side in pixels of a block filled by strokes; no sample has one from 16 pixels on
CROWDED: Final = 0.1  # least share of the solved pixels in blocks filled by strokes that causes a warning
LOOSE: Final = 0.08  # least share of stroke pixels that bound nothing, which causes a warning


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
    loose = walls & ~bounding & ~ndimage.binary_opening(walls, eight)
    if region.all() or loose.sum() < LOOSE * walls.sum():
        return None
    return (
        f"{loose.sum()} of {walls.sum()} stroke pixels bound no area, most of them round "
        f"{_describe_middle(largest_part(loose, eight), frame)}: what they should enclose is left out; "
        "close the outline there or give a mask"
    )


def describe_crowding(filled: Bools, mask: Bools, frame: Frame) -> str | None:
    """The largest place filled by strokes, which leave no room between them."""
    from scipy import ndimage

    crowded = ndimage.binary_opening(filled & mask, np.ones((_BLOCK, _BLOCK)))
    most = largest_part(crowded)
    if most.sum() < max(CROWDED * mask.sum(), 1):
        return None
    return (
        f"strokes leave no room between them round {_describe_middle(most, frame)}, "
        f"all in all on {crowded.sum() / mask.sum():.0%} of the pixels to solve for, where they give no "
        "direction; choose a larger size, or draw fewer lines and no solid ink there"
    )


def describe_overshot_parts(lost: Bools, frame: Frame) -> str | None:
    """Areas that `find_overshoots` leaves out."""
    if not lost.any():
        return None
    return (
        f"the area round {_describe_middle(lost, frame)} is left out, as only ends of curvature lines reach "
        "into it; if it belongs to the surface, draw a line of its own there"
    )


def _describe_middle(pixels: Bools, frame: Frame) -> str:
    """The middle of some pixels as text."""
    row, column = (frame.pixel * (places.mean() + 0.5) for places in np.nonzero(pixels))
    return f"({frame.x + column:.4g}, {frame.y + row:.4g})"
