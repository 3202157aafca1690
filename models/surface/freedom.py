"""Choices that crosses leave open: the side of each part, and its depth where rulings are straight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse.linalg import ArpackError, eigsh

from ..instance.domain import Bools, Floats
from ..instance.instance import Instance
from ..instance.least_squares import Residuals
from .equations import Equations, Weights, changes_of_normals, normals_of
from .hints import Hint
from .stencils import GridLevel, scale_rows

SOFT: Final = 0.016  # change of the cosine of crosses per radian of normals (rms) below which depth is open
_WHOLE: Final = 0.5  # least share of the part in which normals change
_LOCAL: Final = 3e-4  # weight of uneven changes of normals, which rules out those of single pixels
_TWIST: Final = 1e-4  # weight of what slopes do not determine
_PULL: Final = 1e-7  # weight of heights, whose mean is free
_MODES: Final = 4  # changes that are looked at, softest first
LARGE: Final = 0.05  # share of the mask from which the choices of a part are named
_TURN: Final = np.tan(np.radians(20))  # between the normal of a hint that is shown and that of the surface


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
        Coordinates (x, y) in the drawing: deep inside the part, or where the normals differ most.
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
        return f"flatter and deeper surfaces have the same crosses, and differ most at ({x:g}, {y:g})"

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


def find_open_depth(level: GridLevel, z: Floats, extra: Sequence[Residuals]) -> Hint | None:
    """Another normal where normals change most, if a change of the whole part hardly changes the misfit.

    The changes of heights with the least misfit per change of normals are eigenvectors of the linearised
    equations, without the terms that decide only what crosses leave open. extra: as for `Equations`.
    """
    stencils = level.stencils
    if stencils.count <= 2 * _MODES:
        return None
    _, misfit = Equations(stencils, level.crosses, Weights(even=0.0, facing=0.0), extra).model(z)
    changes = [
        sum(scale_rows(slope, by) for slope, by in zip(stencils.slopes, part, strict=True))
        for part in changes_of_normals(stencils, z)
    ]
    uneven = sum(change.T @ (stencils.unevenness @ change) for change in changes)
    fixed = _TWIST * stencils.twist.T @ stencils.twist + _PULL * sparse.eye_array(stencils.count)
    square = sum(change.T @ change for change in changes)
    start = np.ones(stencils.count)
    try:
        gain, modes = eigsh(square, _MODES, (misfit + _LOCAL * uneven + fixed).tocsc(), v0=start)
    except ArpackError:
        return None  # as for equations without a distinct softest change
    for mode in modes.T[gain >= SOFT**-2][::-1]:
        turn = np.stack([change @ mode for change in changes])
        size = np.sum(turn**2, axis=0)
        if size.sum() ** 2 >= _WHOLE * len(size) * np.sum(size**2):
            return _turned_hint(level, normals_of(stencils, z), turn)
    return None


def _turned_hint(level: GridLevel, normals: Floats, turn: Floats) -> Hint:
    """The normal turned in the direction (3, n) where it is longest, away from the border, to the viewer."""
    grid, size = level.grid, np.linalg.norm(turn, axis=0)
    depth = _depth(grid.mask)[grid.mask]
    at = int(np.argmax(np.where(depth >= depth.max() / 2, size, 0.0)))
    step = turn[:, at] / size[at]
    x, y, z = normals[:, at] + _TURN * (step if step[2] >= 0 else -step)
    row, column = np.add(level.corner, np.array([grid.rows[at], grid.columns[at]]) << level.halved)
    slant, tilt = np.degrees([np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)]).round() % 360
    return Hint(int(row), int(column), float(np.radians(slant)), float(np.radians(tilt)))


def _depth(inside: Bools) -> Floats:
    """The distance of each pixel of a picture from the border of its mask."""
    return np.asarray(ndimage.distance_transform_edt(np.pad(inside, 1))[1:-1, 1:-1])
