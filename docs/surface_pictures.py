"""Pictures of surfaces, for docs/surface.md: strokes, normal map, shaded surface in a row.

`python docs/make.py surfaces` draws docs/pictures/surface_known.png and surface_samples.png anew.

A row is a surface; a known true surface is shaded next to it. All rows have the same lamp.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import crossfield as cf
import numpy as np
from crossfield.export.shading.colours import colour_normals, shade_by_light, to_eight_bit
from crossfield.export.shading.raster import View, raster, view_of_grid
from crossfield.export.surfaces.files import draw_strokes, lay_over
from crossfield.export.surfaces.outline import find_outline
from crossfield.models.instance.domain import Floats
from crossfield.models.sketch.samples import SAMPLES
from crossfield.models.smooth.bend import surface_field
from crossfield.models.surface.surface import Surface
from diagrams import drawing_of
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

CELL: Final = 2.1
"""Inches of a picture's longer side."""
DOTS: Final = 110
WORDS: Final = 15
"""Points of words, which are legible on a phone."""
LINE: Final = 0.38
"""Inches of a line of words."""
HEADINGS: Final = ("strokes", "normal map", "shaded", "true surface")
SIZE: Final = 48


@dataclass(frozen=True, eq=False)
class Row:
    """A surface of a picture. title: text above it.

    truth: the true normals (n, 3), where they are known.
    """

    title: str
    surface: Surface
    truth: Floats | None = None


def draw_rows(rows: list[Row], path: Path) -> Path:
    """Draw a PNG with a row for each surface, and return its path."""
    cells = [_cells(row, _view(row)) for row in rows]
    columns = max(map(len, cells))
    heights = [CELL * max(cell.shape[0] / max(cell.shape[:2]) for cell in line) for line in cells]
    size = (columns * (CELL + 0.15), sum(heights) + LINE * (len(rows) + 1))
    figure = Figure(figsize=size, dpi=DOTS, facecolor="white")
    top = size[1] - LINE
    for line, row, height in zip(cells, rows, heights, strict=True):
        middle = 1 - (size[1] - top + LINE / 2) / size[1]
        figure.text(0.08 / size[0], middle, row.title, va="center", fontsize=WORDS, weight="bold")
        for number, cell in enumerate(line):
            left = number * (CELL + 0.15) + 0.075
            axes = figure.add_axes(
                (left / size[0], (top - LINE - height) / size[1], CELL / size[0], height / size[1])
            )
            axes.imshow(cell, interpolation="hanning", interpolation_stage="rgba")
            axes.set_axis_off()
        top -= height + LINE
    for number, heading in enumerate(HEADINGS[:columns]):
        middle = number * (CELL + 0.15) + 0.075 + CELL / 2
        place = (middle / size[0], 1 - LINE / 2 / size[1])
        figure.text(*place, heading, ha="center", va="center", fontsize=WORDS)
    stream = io.BytesIO()
    figure.savefig(stream, metadata={"Software": None})
    with Image.open(stream) as picture:
        picture.convert("RGB").save(path, optimize=True)
    return path


def _view(row: Row) -> View:
    """Twice as fine as the picture is."""
    instance = row.surface.instance
    return view_of_grid(instance, max(1, round(2 * CELL * DOTS / max(instance.mask.shape))))


def _cells(row: Row, view: View) -> list[NDArray[np.uint8]]:
    """The pictures of a row, uint8 (h, w, 4) each, in a view of the grid."""
    instance = row.surface.instance
    drawing = drawing_of(instance, instance.name if row.truth is None else None)
    outline = find_outline(instance, drawing) if row.truth is None else None
    shaded = raster(instance, row.surface.normals, view, outline=outline)
    faint = to_eight_bit(np.ones((*shaded.opacity.shape, 4)) * (0.94, 0.94, 0.94, 1.0))
    faint[..., 3] = to_eight_bit(shaded.opacity)
    cells = [
        lay_over(draw_strokes(instance, drawing, view), faint),
        to_eight_bit(colour_normals(shaded)),
        to_eight_bit(shade_by_light(shaded)),
    ]
    if row.truth is None:
        return cells
    return [*cells, to_eight_bit(shade_by_light(raster(instance, row.truth, view)))]


def known_rows() -> list[Row]:
    """Surfaces with a known answer, from the bend fields of their strokes, on the side of the truth."""
    rows = []
    for name in (name for name, entry in SAMPLES.items() if entry.kind == "analytic"):
        true = cf.analytic(name, SIZE)
        first = cf.surface(surface_field(true.instance))
        error, _, estimate = min(
            (mean_angle(side.normals, true.normals), number, side)
            for number, side in enumerate((first, first.flipped()))
        )
        rows.append(Row(f"{name}, {error:.1f}° off", estimate, true.normals))
    return rows


def mean_angle(first: Floats, second: Floats) -> float:
    """Mean angle in degrees between unit normals (n, 3)."""
    return float(np.degrees(np.arccos(np.clip((first * second).sum(axis=1), -1, 1))).mean())


def sample_rows() -> list[Row]:
    """The drawn samples with the surfaces over their bend fields."""
    drawn = [name for name, entry in SAMPLES.items() if entry.kind == "sketch"]
    return [Row(name, cf.surface(surface_field(cf.sample(name, SIZE)))) for name in drawn]


def draw_pictures() -> None:
    """Draw both pictures."""
    folder = Path(__file__).resolve().parent / "pictures"
    draw_rows(known_rows(), folder / "surface_known.png")
    draw_rows(sample_rows(), folder / "surface_samples.png")
