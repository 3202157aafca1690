"""Colours of a surface: in the light of a lamp, in the material of a ball, and its normals as colours.

A lamp follows Lambert's law, with light from all sides. The ball is glazed, between a large window and a blue
wall; a surface has the ball's colour at the same normal. Normals are the colours (n + 1)/2: red to the right,
green up, blue towards the viewer.
"""

from __future__ import annotations

from dataclasses import dataclass
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
_BODY: Final = np.array([0.66, 0.19, 0.09])  # glaze
_KEY: Final = np.array([-0.52, 0.60, 0.61])  # direction of the window
_KEY_COLOUR: Final = np.array([1.05, 0.98, 0.88])
_WALL: Final = np.array([0.75, -0.40, 0.53])  # of the wall
_WALL_COLOUR: Final = np.array([0.10, 0.18, 0.34])
_FLOOR: Final = np.array([0.05, 0.04, 0.04])
_ROUND: Final = 0.25  # extent of a window around the ball
_SHINE: Final = 38.0  # sharpness of the gloss
_RIM: Final = 3.0  # sharpness of the light along the border of the ball


@dataclass(frozen=True)
class Light:
    """Position of a distant lamp.

    Parameters
    ----------
    azimuth
        Direction in the plane of the drawing, in radians counter-clockwise from the right; upper left by
        default.
    elevation
        Angle above the plane of the drawing, 0 to pi/2 radians; pi/2 is the viewer's position.

    Raises
    ------
    InputError
        For an elevation out of range, and for values that are not finite.

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
        """A lower lamp on the other side."""
        return Light(self.azimuth + np.pi, self.elevation / 2)


UPPER_LEFT: Final = Light()  # the default lamp


def shade_by_light(
    raster: Raster, light: Light = UPPER_LEFT, colour: tuple[float, float, float] = CLAY
) -> Floats:
    """Red, green, blue and opacity (h, w, 4) in [0, 1], encoded for screens (sRGB), of a dull surface."""
    lamp = np.maximum(raster.normals @ light.direction, 0.0)
    fill = np.maximum(raster.normals @ light.opposite.direction, 0.0)
    energy = _AMBIENT + _VIEWER * raster.normals[..., 2] + _LAMP * lamp + _FILL * fill
    return with_opacity(energy[..., None] * np.array(colour), raster)


def with_opacity(energy: Floats, raster: Raster) -> Floats:
    """Energies of light (h, w, 3), from 0 to 1, encoded for screens, with the opacity as fourth value."""
    light = np.clip(energy, 0.0, 1.0)
    encoded = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.concatenate([encoded, raster.opacity[..., None]], axis=-1)


def matcap(raster: Raster) -> Floats:
    """Red, green, blue and opacity (h, w, 4) in [0, 1], encoded for screens."""
    return with_opacity(ball_normals(raster.normals), raster)


def ball_normals(normals: Floats) -> Floats:
    """Light (..., 3) from the ball to the viewer at these unit normals (..., 3)."""
    key, fill = (vector / np.linalg.norm(vector) for vector in (_KEY, _WALL))
    viewer = np.array([0.0, 0.0, 1.0])
    half = (key + viewer) / np.linalg.norm(key + viewer)
    wrapped = ((normals @ key + _ROUND) / (1 + _ROUND))[..., None]
    soft = np.maximum(wrapped, 0.0) ** 1.5 * _KEY_COLOUR
    side = np.maximum(normals @ fill, 0.0)[..., None] * _WALL_COLOUR
    gloss = np.maximum(normals @ half, 0.0)[..., None] ** _SHINE * _KEY_COLOUR
    rim = np.maximum(1 - normals[..., 2:], 0.0) ** _RIM * (_WALL_COLOUR + 0.25 * soft)
    return np.asarray(_BODY * (soft + side + _FLOOR) + 0.4 * gloss + 0.55 * rim)


def colour_normals(picture: Raster) -> Floats:
    """Red, green, blue and opacity (h, w, 4) in [0, 1] of the normals, as in OpenGL (green up)."""
    return np.concatenate([(picture.normals + 1) / 2, picture.opacity[..., None]], axis=-1)


def to_eight_bit(values: Floats) -> Bytes:
    """Numbers in [0, 1] rounded to one of 256 values."""
    return np.round(255 * values).astype(np.uint8)
