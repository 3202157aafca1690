"""Pictures of the entries of matrices as SVG in the reader's light or dark mode; same input, same bytes.

A cell of a picture stands for a square of entries of a large matrix; cells with more entries are darker.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...models.instance.grid import Bools
from .marks import FAMILIES, PAPER, STROKE, Area, Label, Lines, Mark, cover_by_boxes, segments, straight_line
from .web import CUT, EDGE, SIDE, marks_picture, text_width

Places = NDArray[np.int64]

CELLS: Final = 160  # cells on the longer side of a picture, at most

_EDGE: Final = 8.0  # around names
_BELOW: Final = 5.0  # the name of a last row of few is lower than the row
_LINE: Final = 11.0  # units from one name to the next, at least
_LEVELS: Final = 4


@dataclass(frozen=True)
class MatrixParts:
    """Rows or columns of a matrix by kind: names, and how many there are of each."""

    names: tuple[str, ...]
    counts: tuple[int, ...]

    @cached_property
    def total(self) -> int:
        """The number of all rows or columns."""
        return sum(self.counts)

    @property
    def summary(self) -> str:
        """All parts with their counts: `90 alpha, 90 beta`."""
        parts = zip(self.names, self.counts, strict=True)
        return ", ".join(f"{count:,} {name}".replace(",", "\u202f") for name, count in parts)


@dataclass(frozen=True)
class SparsityPattern:
    """The entries of a matrix: their rows and columns, shape (k,), and which stand in nonlinear terms."""

    down: MatrixParts
    across: MatrixParts
    rows: Places
    columns: Places
    curved: Bools

    @property
    def entries(self) -> int:
        """The number of entries."""
        return len(self.rows)

    @cached_property
    def bin(self) -> int:
        """Rows, and columns, that one cell of a picture stands for."""
        return -(-max(self.down.total, self.across.total, 1) // CELLS)


def sparsity_picture(pattern: SparsityPattern) -> bytes:
    """The picture of a pattern: cells of linear and of nonlinear entries, cut into its parts, with names."""
    height, width = (-(-parts.total // pattern.bin) for parts in (pattern.down, pattern.across))
    unit = SIDE / max(height, width)
    right, bottom = width * unit, height * unit
    scale = unit / pattern.bin
    above, beside = _place_names(pattern.across, scale), _place_names(pattern.down, scale)
    cuts = [(scale * at, 0.0, scale * at, bottom) for at in accumulate(pattern.across.counts[:-1])]
    cuts += [(0.0, scale * at, right, scale * at) for at in accumulate(pattern.down.counts[:-1])]
    frame = straight_line(np.array([(0, 0), (right, 0), (right, bottom), (0, bottom), (0, 0)]))
    marks: list[Mark] = [
        Area(PAPER, np.array([[0.0, 0.0, right, bottom]])),
        *_cell_areas(pattern, height, width, unit),
        Lines(CUT, 0.7, segments(cuts)),
        Lines(EDGE, 0.7, [frame]),
        *(Label(name, at, -4, turned=-60) for at, name in above),
        *(Label(name, -4, at + 3.5, "end") for at, name in beside),
    ]
    left = _EDGE + max(text_width(name) for _, name in beside)
    top = _EDGE + 0.9 * max(text_width(name) for _, name in above)
    end = max(right + _BELOW, *(at + 0.5 * text_width(name) + _EDGE for at, name in above))
    return marks_picture(-left, -top, end, bottom + _BELOW, marks)


def _cell_areas(pattern: SparsityPattern, height: int, width: int, unit: float) -> list[Area]:
    """Cells by kind and strength."""
    areas = []
    for colour, chosen in ((FAMILIES[0], ~pattern.curved), (STROKE, pattern.curved)):
        counts = np.zeros((height, width), dtype=np.int64)
        np.add.at(counts, (pattern.rows[chosen] // pattern.bin, pattern.columns[chosen] // pattern.bin), 1)
        # The square root keeps a cell with one entry of a thousand visible.
        level = np.ceil(_LEVELS * np.sqrt(counts / max(int(counts.max(initial=1)), 1))).astype(int)
        areas += [
            Area(colour, unit * cover_by_boxes(level == grade), grade / _LEVELS)
            for grade in np.unique(level[level > 0])
        ]
    return areas


def _place_names(parts: MatrixParts, scale: float) -> list[tuple[float, str]]:
    """The middle of each part and its name, where there is room from one name to the next."""
    placed: list[tuple[float, str]] = []
    for name, count, end in zip(parts.names, parts.counts, accumulate(parts.counts), strict=True):
        at = (end - count / 2) * scale
        if not placed or at - placed[-1][0] >= _LINE:
            placed.append((at, name))
    return placed
