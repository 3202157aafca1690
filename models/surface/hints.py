"""Known normals of the surface at single pixels, in addition to the crosses."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import sparse

from ..errors import InputError
from ..instance.angles import HALF
from ..instance.domain import Floats
from ..instance.instance import Instance
from ..instance.least_squares import Residuals
from .stencils import GridLevel

WEIGHT: Final = 0.3  # per pixel of the disc about a hint
_DISC: Final = 0.05  # radius in parts of the root of the number of pixels


@dataclass(frozen=True)
class Hint:
    """Normal of the surface at a pixel.

    Parameters
    ----------
    row, column
        The pixel.
    slant
        Angle between the normal and the direction to the viewer, in [0, pi/2) radians.
    tilt
        Direction in which the normal leans in the picture, in radians counter-clockwise from +x with y up.

    """

    row: int
    column: int
    slant: float
    tilt: float = 0.0

    @property
    def in_degrees(self) -> dict[str, float]:
        """Its four numbers by name, with angles in degrees to four decimals."""
        angles = {name: round(math.degrees(getattr(self, name)), 4) for name in ("slant", "tilt")}
        return {"row": self.row, "column": self.column, **angles}

    @property
    def slopes(self) -> Floats:
        """The slopes (dz/dx, dz/dy) of a surface with this normal."""
        return np.asarray(-np.tan(self.slant) * np.array([np.cos(self.tilt), np.sin(self.tilt)]))


def check_hints(hints: Iterable[Hint], instance: Instance) -> None:
    """Raise InputError unless every hint can be used on the instance."""
    mask = instance.mask
    for hint in hints:
        place = f"the hint at row {hint.row}, column {hint.column}"
        at = (hint.row, hint.column)
        whole_numbers = all(isinstance(coordinate, (int, np.integer)) for coordinate in at)
        inside = whole_numbers and all(
            0 <= coordinate < size for coordinate, size in zip(at, mask.shape, strict=True)
        )
        if not inside or not mask[at]:
            raise InputError(
                f"{place} lies outside the mask of {instance.name}, which has {mask.shape[0]} rows and "
                f"{mask.shape[1]} columns; give a pixel inside"
            )
        if not 0 <= hint.slant < HALF or not np.isfinite(np.tan(hint.slant)):
            raise InputError(
                f"{place} has a slant of {np.degrees(hint.slant):g} degrees; give one from 0 to less than 90"
            )
        if not np.isfinite(hint.tilt):
            raise InputError(f"{place} has the tilt {hint.tilt}, not a direction; give a finite angle")


def find_pixels(places: Iterable[tuple[float, float]], instance: Instance) -> list[tuple[int, int]]:
    """Row and column at places in the drawing. Raises InputError for one outside the mask."""
    pixels = []
    for x, y in places:
        pixel = pixel_at(x, y, instance)
        if pixel is None:
            place = f"the place ({x:g}, {y:g}) lies outside the mask of {instance.name}"
            raise InputError(f"{place}; give one inside, in the coordinates of the drawing")
        pixels.append(pixel)
    return pixels


def pixel_at(x: float, y: float, instance: Instance) -> tuple[int, int] | None:
    """Row and column at a place in the drawing; None outside the mask."""
    column, row = np.floor((np.array([x, y]) - instance.origin) / instance.pixel_size)
    is_on_grid = 0 <= row < instance.grid.height and 0 <= column < instance.grid.width
    return (int(row), int(column)) if is_on_grid and instance.mask[int(row), int(column)] else None


def hint_rows(hint: Hint, level: GridLevel) -> Residuals:
    """The residuals that require the slopes of a hint on average over a disc of pixels of a level."""
    grid, (top, left) = level.grid, level.corner
    away = np.hypot(
        grid.rows - ((hint.row - top) >> level.halved), grid.columns - ((hint.column - left) >> level.halved)
    )
    disc = away <= max(1.0, _DISC * np.sqrt(grid.size))
    count = int(disc.sum())
    matrix = sparse.csr_array(np.stack([disc @ slope for slope in level.stencils.slopes]) / count)
    return Residuals(matrix, -hint.slopes, np.full(2, WEIGHT * count))
