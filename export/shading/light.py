"""A surface in the light of a distant lamp: Lambert's law and light from all sides."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from ...models.errors import InputError
from ...models.instance.grid import Floats
from .raster import Raster

CLAY: Final = (0.80, 0.77, 0.73)
"""Share of red, green and blue light that the surface reflects."""
_AMBIENT: Final = 0.04  # light from all sides, on any surface
_VIEWER: Final = 0.10  # light from the viewer
_LAMP: Final = 0.95
_FILL: Final = 0.08  # from the side opposite to the lamp, so that forms in its shade are visible


@dataclass(frozen=True)
class Light:
    """Position of a distant lamp.

    azimuth: radians counter-clockwise from the right, as the tilt of a normal; by default upper left.
    elevation: radians above the plane of the drawing, 0 to pi/2, which is straight from the viewer.
    Raises InputError for another elevation and for values that are not finite.
    """

    azimuth: float = np.radians(130.0)
    elevation: float = np.radians(38.0)

    def __post_init__(self) -> None:
        """Check both angles."""
        if not (np.isfinite(self.azimuth) and 0 <= self.elevation <= np.pi / 2 + 1e-9):
            raise InputError(
                f"a lamp cannot be at azimuth {np.degrees(self.azimuth):g}, elevation "
                f"{np.degrees(self.elevation):g} degrees; its elevation is between 0 and 90"
            )

    @property
    def direction(self) -> Floats:
        """Unit vector (3,) from the surface to the lamp, x right, y up, z towards the viewer."""
        flat = np.cos(self.elevation)
        return np.array([flat * np.cos(self.azimuth), flat * np.sin(self.azimuth), np.sin(self.elevation)])

    @property
    def opposite(self) -> Light:
        """The lamp on the other side, lower."""
        return Light(self.azimuth + np.pi, self.elevation / 2)


UPPER_LEFT: Final = Light()
"""The default lamp."""


def lit(raster: Raster, light: Light = UPPER_LEFT, colour: tuple[float, float, float] = CLAY) -> Floats:
    """Red, green, blue and opacity (h, w, 4) in [0, 1], encoded for screens (sRGB), of a dull surface.

    The reflected light of the lamp is the cosine between its direction and the normal, 0 in its own shade.
    """
    lamp = np.maximum(raster.normals @ light.direction, 0.0)
    fill = np.maximum(raster.normals @ light.opposite.direction, 0.0)
    energy = _AMBIENT + _VIEWER * raster.normals[..., 2] + _LAMP * lamp + _FILL * fill
    return with_opacity(energy[..., None] * np.array(colour), raster)


def with_opacity(energy: Floats, raster: Raster) -> Floats:
    """Energies of light (h, w, 3), from 0 to 1, encoded for screens, with the opacity as fourth value."""
    light = np.clip(energy, 0.0, 1.0)
    encoded = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.concatenate([encoded, raster.opacity[..., None]], axis=-1)
