"""A surface in the material of a ball: each colour is the ball's colour at the same normal.

The ball is computed, a glazed one between a large window and a blue wall. It shows forms better than a lamp,
because every normal has its own colour.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from ...models.instance.grid import Floats
from .light import with_opacity
from .raster import Raster

_BODY: Final = np.array([0.66, 0.19, 0.09])  # glaze
_KEY: Final = np.array([-0.52, 0.60, 0.61])  # direction of the window
_KEY_COLOUR: Final = np.array([1.05, 0.98, 0.88])
_FILL: Final = np.array([0.75, -0.40, 0.53])  # of the wall
_FILL_COLOUR: Final = np.array([0.10, 0.18, 0.34])
_FLOOR: Final = np.array([0.05, 0.04, 0.04])
_ROUND: Final = 0.25  # extent of a window around the ball
_SHINE: Final = 38.0  # sharpness of the gloss
_RIM: Final = 3.0  # sharpness of the light along the border of the ball


def matcap(raster: Raster) -> Floats:
    """Red, green, blue and opacity (h, w, 4) in [0, 1], encoded for screens."""
    return with_opacity(ball(raster.normals), raster)


def ball(normals: Floats) -> Floats:
    """Light (..., 3) from the ball to the viewer at these unit normals (..., 3)."""
    key, fill = (vector / np.linalg.norm(vector) for vector in (_KEY, _FILL))
    viewer = np.array([0.0, 0.0, 1.0])
    half = (key + viewer) / np.linalg.norm(key + viewer)
    wrapped = ((normals @ key + _ROUND) / (1 + _ROUND))[..., None]
    soft = np.maximum(wrapped, 0.0) ** 1.5 * _KEY_COLOUR
    side = np.maximum(normals @ fill, 0.0)[..., None] * _FILL_COLOUR
    gloss = np.maximum(normals @ half, 0.0)[..., None] ** _SHINE * _KEY_COLOUR
    rim = np.maximum(1 - normals[..., 2:], 0.0) ** _RIM * (_FILL_COLOUR + 0.25 * soft)
    energy: Floats = _BODY * (soft + side + _FLOOR) + 0.4 * gloss + 0.55 * rim
    return energy
