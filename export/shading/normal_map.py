"""Normals as colours: (n + 1)/2, red to the right, green up, blue towards the viewer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...models.instance.grid import Floats
from ...models.instance.instance import Instance
from .raster import Raster, raster, scale_of

Bytes = NDArray[np.uint8]


def normal_map(instance: Instance, normals: Floats, scale: int = 1) -> Bytes:
    """Red, green, blue and opacity, uint8 (h, w, 4), as in OpenGL and Blender (green up).

    normals: (n, 3) at the pixels. scale: 1: one texel per pixel of the grid, with its own normal, opaque only
    in the mask; more: normals in between, and a smooth outline. Outside it points to the viewer. Raises
    InputError for another scale.
    """
    if scale_of(instance, scale) > 1:
        return eight_bit(coloured(raster(instance, normals, scale)))
    image = np.zeros((*instance.mask.shape, 3))
    image[..., 2] = 1.0
    image[instance.mask] = normals
    return eight_bit(coloured(Raster(image, instance.mask.astype(np.float64))))


def coloured(found: Raster) -> Floats:
    """Red, green, blue and opacity (h, w, 4) in [0, 1] of the normals."""
    return np.concatenate([(found.normals + 1) / 2, found.opacity[..., None]], axis=-1)


def eight_bit(values: Floats) -> Bytes:
    """Numbers in [0, 1] rounded to one of 256 values."""
    return np.round(255 * values).astype(np.uint8)
