"""The pixel grid as index arrays [row, column], row 0 at the top; x = column, y = -row (y up)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Grid:
    """Pixels of a mask [height, width], numbered row by row, and their ordered neighbour pairs."""

    mask: Bools

    @property
    def height(self) -> int:
        """Number of rows."""
        return int(self.mask.shape[0])

    @property
    def width(self) -> int:
        """Number of columns."""
        return int(self.mask.shape[1])

    @cached_property
    def rows(self) -> Ints:
        """Row of each pixel, shape (n,)."""
        return np.nonzero(self.mask)[0].astype(np.int32)

    @cached_property
    def columns(self) -> Ints:
        """Column of each pixel, shape (n,)."""
        return np.nonzero(self.mask)[1].astype(np.int32)

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

    @cached_property
    def _pairs(self) -> tuple[Ints, Ints, Bools]:
        upper = np.full(self.mask.shape, -1, dtype=np.int32)
        upper[1:] = self.number[:-1]
        right = np.full(self.mask.shape, -1, dtype=np.int32)
        right[:, :-1] = self.number[:, 1:]
        neighbour = np.stack([upper[self.mask], right[self.mask]], axis=1)
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
        """Numbers of each pixel's pairs with the upper and right neighbours, [height, width] each, or -1."""
        upper = np.full(self.mask.shape, -1, dtype=np.int32)
        right = upper.copy()
        index = np.arange(len(self.first), dtype=np.int32)
        for table, chosen in ((upper, self.upward), (right, ~self.upward)):
            pixel = self.first[chosen]
            table[self.rows[pixel], self.columns[pixel]] = index[chosen]
        return upper, right

    @cached_property
    def quads(self) -> Ints:
        """The 2 x 2 pixels inside the mask, shape (q, 4): their pairs on a counter-clockwise walk (y up).

        Columns: bottom (left to right), right side (upwards), top (stored left to right, walked in reverse),
        left side (stored upwards, walked in reverse).
        """
        upper, right = self.pair_number
        bottom, side = right[1:, :-1], upper[1:, 1:]
        top, left = right[:-1, :-1], upper[1:, :-1]
        walk = np.stack([bottom, side, top, left], axis=-1)
        return walk[(walk >= 0).all(axis=-1)]

    @cached_property
    def parts(self) -> int:
        """Number of 4-connected parts of the mask."""
        least = np.arange(self.size)  # the first pixel known to belong to the same part, of each pixel
        while len(between := np.nonzero(least[self.first] != least[self.second])[0]):
            one, other = least[self.first[between]], least[self.second[between]]
            np.minimum.at(least, np.maximum(one, other), np.minimum(one, other))
            while (least[least] != least).any():
                least = least[least]
        return len(np.unique(least))
