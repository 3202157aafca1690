"""Thinning of a shape to lines one pixel wide."""

from __future__ import annotations

import numpy as np

from ..instance.domain import Bools


def thin_shape(shape: Bools) -> Bools:
    """The shape [h, w] thinned to lines one pixel wide, after Zhang and Suen (Commun. ACM 27, 1984)."""
    line = np.pad(shape, 1)
    while True:
        before = int(line.sum())
        for first in (True, False):
            line[1:-1, 1:-1] &= ~_removable_pixels(line, first=first)
        if int(line.sum()) == before:
            return line[1:-1, 1:-1]


def _removable_pixels(line: Bools, *, first: bool) -> Bools:
    """The pixels of a padded shape that one of the two passes of the thinning removes."""
    # Neighbours from the upper one on, clockwise.
    steps = ((0, 1), (0, 2), (1, 2), (2, 2), (2, 1), (2, 0), (1, 0), (0, 0))
    height, width = line.shape
    around = np.stack([line[down : height - 2 + down, right : width - 2 + right] for down, right in steps])
    up, right, down, left = around[::2]
    count = around.sum(axis=0, dtype=np.uint8)
    turns = (~around & np.roll(around, -1, axis=0)).sum(axis=0, dtype=np.uint8)
    sides = (up & right & down) | (right & down & left) if first else (up & right & left) | (up & down & left)
    return np.asarray((count >= 2) & (count <= 6) & (turns == 1) & ~sides)
