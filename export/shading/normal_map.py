"""Normals as colours: (n + 1)/2, red to the right, green up, blue towards the viewer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...models.instance.grid import Floats
from ...models.surface.surface import Surface
from .raster import Raster, raster, scale_of

Bytes = NDArray[np.uint8]


def normal_map(surface: Surface, scale: int = 1) -> Bytes:
    """Red, green, blue and opacity, uint8 (h, w, 4), in the manner of OpenGL and Blender (green up).

    scale: 1: one texel for each pixel of the grid, its own normal, opaque in the mask alone; more: normals in
    between, and a smooth outline. Outside it looks at the viewer. Raises InputError for another scale.
    """
    if scale_of(surface, scale) > 1:
        return eight_bit(coloured(raster(surface, scale)))
    mask = surface.instance.mask
    normals = np.zeros((*mask.shape, 3))
    normals[..., 2] = 1.0
    normals[mask] = surface.normals
    return eight_bit(coloured(Raster(normals, mask.astype(np.float64))))


def coloured(found: Raster) -> Floats:
    """Red, green, blue and opacity (h, w, 4) in [0, 1] of the normals."""
    return np.concatenate([(found.normals + 1) / 2, found.opacity[..., None]], axis=-1)


def eight_bit(values: Floats) -> Bytes:
    """Numbers in [0, 1] as the nearest of 256."""
    return np.round(255 * values).astype(np.uint8)
