"""The pixel grid as index arrays [row, column], row 0 at the top; x = column, y = -row (y up)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from ..errors import InstanceError, NoStrokeError
from .domain import Bools, Domain, Ints, Rings

REFERENCE: Final = 24  # pixels of the longer side of the grid on which weights are coefficients
_FARTHEST: Final = 1e100  # coordinates whose squares are finite numbers


@dataclass(frozen=True, eq=False)
class Grid(Domain):
    """Pixels of a mask [height, width], numbered row by row, and their ordered neighbour pairs.

    mask: pixels to solve for, row 0 at the top. pixel_size: side of a pixel in units of the sketch, 1e-100 to
    1e100. origin: sketch coordinates (x, y) of the top left corner of pixel [0, 0], y downwards.
    """

    mask: Bools
    pixel_size: float = 1.0
    origin: tuple[float, float] = (0.0, 0.0)

    kind: ClassVar[str] = "pixel"
    reference: ClassVar[int] = REFERENCE
    kappa: ClassVar[None] = None

    def check(self) -> None:
        """Raise InstanceError for a mask without pixels, too large a grid, or an impossible place."""
        if self.mask.ndim != 2 or not self.mask.any():
            raise NoStrokeError("the mask has no pixel to solve for; draw something white in it")
        if self.side > 9999:
            raise InstanceError(
                f"the grid is {self.width} x {self.height}; at most 9999 pixels per side are allowed"
            )
        if not 1 / _FARTHEST <= self.pixel_size <= _FARTHEST:
            raise InstanceError(
                f"pixel_size is {self.pixel_size}; it must be between {1 / _FARTHEST:g} and {_FARTHEST:g}"
            )
        if not all(abs(value) <= _FARTHEST for value in self.origin):
            raise InstanceError(
                f"origin is {self.origin}; it must be two numbers between {-_FARTHEST:g} and {_FARTHEST:g}"
            )

    @property
    def side(self) -> int:
        """Pixels of the longer side."""
        return max(self.height, self.width)

    @property
    def summary(self) -> str:
        """Width, height, pixels, and parts if there are more than one."""
        parts = f" in {self.parts} separate parts" if self.parts > 1 else ""
        return f"{self.width} x {self.height}, {self.size} pixels{parts}"

    @property
    def facts(self) -> dict[str, Any]:
        """Height, width, and numbers of pixels, pairs and parts."""
        return {
            "height": self.height,
            "width": self.width,
            "pixels": self.size,
            "pairs": len(self.first),
            "parts": self.parts,
            "pixel_size": self.pixel_size,
        }

    def places(self, points: Ints) -> Ints:
        """Row and column of each of some pixels, shape (k, 2)."""
        return np.stack([self.rows[points], self.columns[points]], axis=1)

    def content(self) -> tuple[list[int], list[float], list[NDArray[Any]]]:
        """Height and width, pixel size and origin, and the mask."""
        return [self.height, self.width], [self.pixel_size, *self.origin], [np.packbits(self.mask)]

    @property
    def height(self) -> int:
        """Number of rows."""
        return int(self.mask.shape[0])

    @property
    def width(self) -> int:
        """Number of columns."""
        return int(self.mask.shape[1])

    @cached_property
    def _places(self) -> tuple[Ints, Ints]:
        row, column = np.nonzero(self.mask)
        return row.astype(np.int32), column.astype(np.int32)

    @property
    def rows(self) -> Ints:
        """Row of each pixel, shape (n,)."""
        return self._places[0]

    @property
    def columns(self) -> Ints:
        """Column of each pixel, shape (n,)."""
        return self._places[1]

    @property
    def size(self) -> int:
        """Number of pixels n."""
        return len(self.rows)

    @cached_property
    def number(self) -> Ints:
        """Number of each pixel, shape [height, width], -1 outside the mask."""
        number = np.full(self.mask.shape, -1, dtype=np.int32)
        number[self.mask] = np.arange(self.size, dtype=np.int32)
        return number

    def numbers_at(self, rows: Ints, columns: Ints) -> Ints:
        """Number of the pixel at each place, -1 outside the mask; in `number`, large grids need gigabytes."""
        key = rows.astype(np.int64) * self.width + columns
        at = np.minimum(np.searchsorted(self._keys, key), self.size - 1)
        inside = (columns >= 0) & (columns < self.width) & (self._keys[at] == key)
        return np.where(inside, at, -1).astype(np.int32)

    def numbers_of(self, pixels: Ints) -> Ints:
        """Number of each pixel [row, column], (s,). Raises InstanceError for one outside the mask."""
        if pixels.size == 0:
            return np.zeros(0, dtype=np.int32)
        if pixels.ndim != 2 or pixels.shape[1] != 2:
            raise InstanceError(
                f"stroke_pixels has shape {pixels.shape}; give [row, column] for each stroke pixel"
            )
        number = self.numbers_at(*pixels.T)
        if (number < 0).any():
            row, column = pixels[int(np.argmax(number < 0))]
            raise InstanceError(
                f"stroke pixel [{row}, {column}]: is outside the mask ({int((number < 0).sum())} in all)"
            )
        return number

    @cached_property
    def _keys(self) -> NDArray[np.int64]:
        return self.rows.astype(np.int64) * self.width + self.columns

    @cached_property
    def _pairs(self) -> tuple[Ints, Ints, Bools]:
        upper = self.numbers_at(self.rows - 1, self.columns)
        right = self.numbers_at(self.rows, self.columns + 1)
        neighbour = np.stack([upper, right], axis=1)
        first, side = np.nonzero(neighbour >= 0)
        return first.astype(np.int32), neighbour[first, side], side == 0

    @property
    def first(self) -> Ints:
        """Pixel i of each pair (i, j) of E, shape (m,); pairs are ordered by i, upper before right."""
        return self._pairs[0]

    @property
    def second(self) -> Ints:
        """Pixel j of each pair: the upper (row - 1) or the right (column + 1) neighbour of i."""
        return self._pairs[1]

    @property
    def upward(self) -> Bools:
        """True where j is the upper neighbour of i, False where it is the right one."""
        return self._pairs[2]

    @cached_property
    def pair_number(self) -> tuple[Ints, Ints]:
        """Number of each pixel's pair with its upper and with its right neighbour, (n,) each, -1 for none."""
        upper, right = np.full((2, self.size), -1, dtype=np.int32)
        index = np.arange(len(self.first), dtype=np.int32)
        for table, chosen in ((upper, self.upward), (right, ~self.upward)):
            table[self.first[chosen]] = index[chosen]
        return upper, right

    @cached_property
    def quads(self) -> Ints:
        """The 2 x 2 pixels inside the mask, shape (q, 4): their pairs on a counter-clockwise walk (y up).

        Columns: bottom (left to right), right side (upwards), top (stored left to right, walked in reverse),
        left side (stored upwards, walked in reverse).
        """
        upper, right = self.pair_number
        corner = np.nonzero((upper >= 0) & (right >= 0))[0]
        bottom, left = right[corner], upper[corner]
        side, top = upper[self.second[bottom]], right[self.second[left]]
        walk = np.stack([bottom, side, top, left], axis=-1)
        return walk[(walk >= 0).all(axis=-1)]

    @cached_property
    def vertices(self) -> tuple[Ints, Ints]:
        """Vertices [row, column] (k, 2), and the vertex at each corner of each pixel (n, 4), row by row.

        Pixels that meet only in a corner each have their own vertex there.
        """
        down, right = np.array([0, 0, 1, 1]), np.array([0, 1, 0, 1])
        row, column = self.rows[:, None] + down, self.columns[:, None] + right
        inside = np.pad(self.mask, 1)
        # Pixels round the corner: the one diagonally across, and the two at its sides.
        across = inside[row + down, column + right]
        beside = inside[row + down, column + 1 - right] | inside[row + 1 - down, column + right]
        apart = across & ~beside & (right == 1)
        key = 2 * (row.astype(np.int64) * (self.width + 1) + column) + apart
        vertices, corners = np.unique(key, return_inverse=True)
        places = np.stack(np.divmod(vertices // 2, self.width + 1), axis=1)
        return places.astype(np.int32), corners.reshape(key.shape).astype(np.int32)

    @property
    def ring_vertices(self) -> Ints:
        """The common corner of the four pixels of each of `quads`, (r,), by its number in `vertices`."""
        return np.asarray(self.vertices[1][self.first[self.quads[:, 0]], 1])

    @cached_property
    def rings(self) -> Rings:
        """The ring around the common corner of the four pixels of each of `quads`."""
        start = np.arange(0, 4 * len(self.quads) + 1, 4, dtype=np.int32)
        sign = np.tile(np.array([1, 1, -1, -1], dtype=np.int32), len(self.quads))
        return Rings(start, self.quads.ravel(), sign, np.zeros(len(self.quads)))
