"""Pictures of where matrices have entries, as SVG in the reader's light or dark mode; same input, same bytes.

A matrix with more rows or columns than a picture has cells is binned: a cell stands for a square of its
entries, and is the stronger the more of them there are. So the file of a large one stays small.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...models.instance.grid import Bools
from .panels import FAMILIES, STROKE
from .scheme import label, number, opening, style

Places = NDArray[np.int64]

CELLS: Final = 160
"""Cells on the longer side of a picture, at most."""

_SIDE: Final = 320.0  # units of the longer side
_MARGIN: Final = 44.0  # for names of rows, left, and of columns, above
_LINE: Final = 11.0  # units from one name to the next, at least
_LEVELS: Final = 4
_STYLE: Final = style(
    {
        "ground": ("#ffffff", "#1d2126"),
        "linear": (FAMILIES[0], "#41b3c5"),
        "curved": (STROKE, "#ff7b72"),
        "cut": ("#c3c8ce", "#4a525c"),
        "edge": ("#8b929c", "#7d8590"),
        "name": ("#555e68", "#a3acb6"),
    },
    ("ground", "linear", "curved", "name"),
    ".cut,.edge{fill:none;stroke-width:.7}text{font:10px system-ui,sans-serif}",
)


@dataclass(frozen=True)
class Parts:
    """Rows or columns of a matrix by kind: names, and how many there are of each."""

    names: tuple[str, ...]
    counts: tuple[int, ...]

    @cached_property
    def total(self) -> int:
        """How many there are in all."""
        return sum(self.counts)

    @property
    def told(self) -> str:
        """Them in words: `90 alpha, 90 beta`."""
        each = zip(self.names, self.counts, strict=True)
        return ", ".join(f"{count:,} {name}".replace(",", "\u202f") for name, count in each)


@dataclass(frozen=True)
class Pattern:
    """Where a matrix has entries: their rows and columns, shape (k,), and which stand in nonlinear terms."""

    down: Parts
    across: Parts
    rows: Places
    columns: Places
    curved: Bools

    @property
    def entries(self) -> int:
        """How many entries there are."""
        return len(self.rows)

    @cached_property
    def bin(self) -> int:
        """Rows, and columns, that one cell of a picture stands for."""
        return -(-max(self.down.total, self.across.total, 1) // CELLS)


def sparsity_picture(pattern: Pattern) -> bytes:
    """The picture of a pattern: cells of linear and of nonlinear entries, cut into its parts, with names."""
    height, width = (-(-parts.total // pattern.bin) for parts in (pattern.down, pattern.across))
    unit = _SIDE / max(height, width)
    right, bottom = width * unit, height * unit
    scale = unit / pattern.bin
    frame = f"M0 0H{number(right)}V{number(bottom)}H0z"
    cuts = [f"M{number(at)} 0V{number(bottom)}" for at in _cuts(pattern.across, scale)]
    cuts += [f"M0 {number(at)}H{number(right)}" for at in _cuts(pattern.down, scale)]
    parts = [
        opening(-_MARGIN, -_MARGIN, right + _MARGIN + 2, bottom + _MARGIN + 2),
        _STYLE,
        f'<path class="ground" d="{frame}"/>',
        f'<g transform="scale({unit:.6g})">',
        *_cells(pattern),
        "</g>",
        *([f'<path class="cut" d="{"".join(cuts)}"/>'] if cuts else []),
        f'<path class="edge" d="{frame}"/>',
        *(label(at, -4, name, turned=-60) for at, name in _names(pattern.across, scale)),
        *(label(-4, at + 3.5, name, anchor="end") for at, name in _names(pattern.down, scale)),
        "</svg>",
        "",
    ]
    return "\n".join(parts).encode()


def _cells(pattern: Pattern) -> list[str]:
    """Paths of cells in a row beside each other, by kind and strength."""
    width = -(-pattern.across.total // pattern.bin)
    place = (pattern.rows // pattern.bin).astype(np.int64) * width + pattern.columns // pattern.bin
    found = []
    for name, chosen in (("linear", ~pattern.curved), ("curved", pattern.curved)):
        cells, counts = np.unique(place[chosen], return_counts=True)
        # The square root: a cell with one entry of a thousand is still to be seen.
        level = np.ceil(_LEVELS * np.sqrt(counts / max(int(counts.max(initial=1)), 1))).astype(int)
        for each in range(1, _LEVELS + 1):
            data = _runs(cells[level == each], width)
            faded = f' opacity="{each / _LEVELS:.2f}"' if each < _LEVELS else ""
            if data:
                found.append(f'<path class="{name}"{faded} d="{data}"/>')
    return found


def _runs(cells: Places, width: int) -> str:
    """Path data of sorted cells; neighbours in a row are one rectangle."""
    if not len(cells):
        return ""
    rows, columns = cells // width, cells % width
    begins = np.concatenate([[True], (np.diff(cells) != 1) | (np.diff(rows) != 0)])
    starts = np.flatnonzero(begins)
    lengths = np.diff(np.append(starts, len(cells)))
    return "".join(
        f"M{column} {row}h{length}v1h-{length}z"
        for row, column, length in zip(
            rows[starts].tolist(), columns[starts].tolist(), lengths.tolist(), strict=True
        )
    )


def _cuts(parts: Parts, scale: float) -> list[float]:
    """Where the parts end, but for the last."""
    return [end * scale for end in list(accumulate(parts.counts))[:-1]]


def _names(parts: Parts, scale: float) -> list[tuple[float, str]]:
    """The middle of each part and its name, where there is room from one name to the next."""
    found: list[tuple[float, str]] = []
    for name, count, end in zip(parts.names, parts.counts, accumulate(parts.counts), strict=True):
        at = (end - count / 2) * scale
        if not found or at - found[-1][0] >= _LINE:
            found.append((at, name))
    return found
