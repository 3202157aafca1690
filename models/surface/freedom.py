"""Choices that crosses leave open: the side of each part, and its depth where rulings are straight."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy import ndimage

from ..instance.angles import HALF
from ..instance.domain import Bools, Floats
from ..instance.instance import Instance
from .equations import normals_of
from .hints import Hint
from .stencils import GridLevel

_STRAIGHT: Final = np.radians(4.5)  # turn of the straighter line of most crosses below which depth is open
_MOST: Final = 2 / 3  # of the crosses
_SPAN: Final = 0.15  # of the longer side, to either side of a cross, over which its lines turn
_KNOWN: Final = 0.1  # least share of the pixels from which both ends of both lines lie inside
LARGE: Final = 0.05  # share of the mask from which the choices of a part are named
_TURN: Final = np.radians(20)  # between the normal of a hint that is shown and that of the surface


@dataclass(frozen=True)
class Freedom:
    """A choice that the crosses leave open.

    Parameters
    ----------
    kind
        `side`: inside out, the part has the same crosses. `depth`: flatter and deeper surfaces have them.
    part, pixels
        Number of the part of the mask, from 1 in reading order, and the number of its pixels.
    place
        Coordinates (x, y) in the drawing: deep inside the part, or where it is steep there.
    hint
        The normal of another surface with the same crosses at the place; None for a side.

    """

    kind: str
    part: int
    pixels: int
    place: tuple[float, float]
    hint: Hint | None = None

    def __str__(self) -> str:
        """The choice as a sentence."""
        x, y = self.place
        if self.kind == "side":
            return f"the part at ({x:g}, {y:g}) has the same crosses inside out"
        return f"one family of lines is straight: flatter and deeper surfaces fit too, as at ({x:g}, {y:g})"

    @property
    def option(self) -> str:
        """An option of `crossfield shade` that decides it."""
        if self.hint is None:
            return f"--concave {self.place[0]:g},{self.place[1]:g}"
        return "--hint " + ",".join(f"{number:g}" for number in self.hint.in_degrees.values())

    def document(self) -> dict[str, Any]:
        """The choice as JSON, with angles in degrees."""
        where = {"part": self.part, "pixels": self.pixels, "x": self.place[0], "y": self.place[1]}
        hint = self.hint and self.hint.in_degrees
        return {"kind": self.kind, **where, "hint": hint, "option": self.option, "text": str(self)}


def find_deepest(inside: Bools) -> tuple[int, int]:
    """Row and column of the pixel of a picture that is farthest from the border of its mask."""
    row, column = np.unravel_index(_depth(inside).argmax(), inside.shape)
    return int(row), int(column)


def place_of(instance: Instance, row: int, column: int) -> tuple[float, float]:
    """The middle of a pixel in the coordinates of the drawing, to four digits."""
    x, y = instance.origin + instance.pixel_size * (np.array([column, row]) + 0.5)
    return float(f"{x:.4g}"), float(f"{y:.4g}")


def find_open_depth(level: GridLevel, z: Floats) -> Hint | None:
    """Another normal where the surface is steep, if one line of most crosses goes straight on.

    Cylinders, cones and other surfaces with straight rulings have flatter and deeper ones with the same
    crosses. The misfit of such changes does not show it: errors of drawn crosses make it large.
    """
    angles = [np.arctan2(*line.T[::-1]) for line in level.crosses.lines]
    turns = np.stack([_turns(level, np.stack(angles), angle) for angle in angles])
    turns = turns.min(axis=0)[np.isfinite(turns).all(axis=0)]
    if len(turns) < _KNOWN * level.grid.size or np.quantile(turns, _MOST) > _STRAIGHT:
        return None
    grid, (x, y, toward) = level.grid, normals_of(level.stencils.gradient(z))
    depth = _depth(grid.mask)[grid.mask]
    at = int(np.argmin(np.where(depth >= depth.max() / 2, toward, 1.0)))
    slant, tilt = np.arccos(toward[at]), np.arctan2(y[at], x[at])
    slant, tilt = np.degrees([slant - _TURN if slant > 1.5 * _TURN else slant + _TURN, tilt]).round() % 360
    row, column = np.add(level.corner, (grid.rows[at], grid.columns[at]))
    return Hint(int(row), int(column), float(np.radians(slant)), float(np.radians(tilt)))


def _turns(level: GridLevel, angles: Floats, angle: Floats) -> Floats:
    """How much the lines of the crosses turn along a line of each, from one end to the other; (n,).

    angles: of both lines, (2, n). angle: of the line that is followed. Infinite where it leaves the mask.
    """
    grid, turns, known = level.grid, [], np.ones(level.grid.size, dtype=bool)
    step = _SPAN * max(grid.mask.shape) * np.stack([-np.sin(angle), np.cos(angle)])
    number = np.pad(grid.number, int(np.abs(step).max(initial=0)) + 1, constant_values=-1)
    middle = np.stack([grid.rows, grid.columns]) + (number.shape[0] - grid.height) // 2
    for place in (middle + step, middle - step):
        pixel = number[tuple(np.rint(place).astype(int))]
        turn = (angles[:, pixel] - angle + HALF) % np.pi - HALF
        turns.append(np.where(np.abs(turn[0]) < np.abs(turn[1]), *turn))
        known &= pixel >= 0
    return np.where(known, np.abs(turns[0] - turns[1]), np.inf)


def _depth(inside: Bools) -> Floats:
    """The distance of each pixel of a picture from the border of its mask."""
    return np.asarray(ndimage.distance_transform_edt(np.pad(inside, 1))[1:-1, 1:-1])
