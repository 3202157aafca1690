"""Colours of a surface: in the light of a lamp, and its normals as colours.

A lamp follows Lambert's law, with light from all sides. Normals are the colours (n + 1)/2: red to the right,
green up, blue towards the viewer.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...models.errors import InputError
from ...models.instance.domain import Floats
from .raster import Raster

Bytes = NDArray[np.uint8]

CLAY: Final = (0.80, 0.77, 0.73)  # share of red, green and blue light that the surface reflects
_AMBIENT: Final = 0.04  # light from all sides, on any surface
_VIEWER: Final = 0.10  # light from the viewer
_LAMP: Final = 0.95
_FILL: Final = 0.08  # from the side opposite to the lamp, so that forms in its shade are visible


Lamp = tuple[float, float]
"""Direction of a distant lamp in radians: azimuth, counter-clockwise from the right, and elevation above the
plane of the drawing, 0 to pi/2.
"""
UPPER_LEFT: Final[Lamp] = (np.radians(130.0), np.radians(38.0))


def direction_to(lamp: Lamp) -> Floats:
    """Unit vector (3,) from the surface to a lamp, x right, y up, z towards the viewer.

    Raises InputError for an elevation out of range, and for angles that are not finite.
    """
    azimuth, elevation = lamp
    if not (np.isfinite(azimuth) and 0 <= elevation <= np.pi / 2 + 1e-9):
        raise InputError(
            f"a lamp cannot be at azimuth {np.degrees(azimuth):g}, elevation {np.degrees(elevation):g} "
            "degrees; its elevation is between 0 and 90"
        )
    flat = np.cos(elevation)
    return np.array([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)])


def shade_by_light(raster: Raster, light: Lamp = UPPER_LEFT) -> Floats:
    """Red, green, blue and opacity (h, w, 4) in [0, 1], encoded for screens (sRGB), of a dull surface."""
    lamp = np.maximum(raster.normals @ direction_to(light), 0.0)
    opposite = light[0] + np.pi, light[1] / 2
    fill = np.maximum(raster.normals @ direction_to(opposite), 0.0)
    energy = _AMBIENT + _VIEWER * raster.normals[..., 2] + _LAMP * lamp + _FILL * fill
    light_back = np.clip(energy[..., None] * np.array(CLAY), 0.0, 1.0)
    encoded = np.where(light_back <= 0.0031308, 12.92 * light_back, 1.055 * light_back ** (1 / 2.4) - 0.055)
    return np.concatenate([encoded, raster.opacity[..., None]], axis=-1)


def colour_normals(picture: Raster) -> Floats:
    """Red, green, blue and opacity (h, w, 4) in [0, 1] of the normals, as in OpenGL (green up)."""
    return np.concatenate([(picture.normals + 1) / 2, picture.opacity[..., None]], axis=-1)


def to_eight_bit(values: Floats) -> Bytes:
    """Numbers in [0, 1] rounded to one of 256 values."""
    return np.round(255 * values).astype(np.uint8)
