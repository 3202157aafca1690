"""The picture of docs/proofs.md: the crosses left at every level of a proof."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np
from crossfield.export.pictures.draw import fixed_settings
from crossfield.models.instance.angles import HALF
from crossfield.models.instance.domain import Bools, Floats
from crossfield.models.instance.grid import Grid
from crossfield.models.proof.lattice import block_starts
from crossfield.models.proof.record import LevelRecord, Proof
from diagrams import STYLE, V
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

STRIP: Final = HALF**2
"""Area of all crosses, in radians squared."""
COLOURS: Final = "viridis"
CELL: Final = "#2a788e"
COLUMNS: Final = 4


def allowed_cells(level: LevelRecord, pixel: int) -> Bools:
    """The cells of a pixel with four allowed vertices, (alpha, beta)."""
    begin = block_starts(level.alpha_count.astype(np.int64) * level.beta_count)
    shape = (level.alpha_count[pixel], level.beta_count[pixel])
    vertices: Bools = level.allowed[begin[pixel] : begin[pixel + 1]].reshape(shape)
    return vertices[:-1, :-1] & vertices[1:, :-1] & vertices[:-1, 1:] & vertices[1:, 1:]


def remaining_shares(level: LevelRecord) -> Floats:
    """The part of the strip that may hold a better cross of each pixel, shape (n,)."""
    counts = [allowed_cells(level, pixel).sum() for pixel in range(len(level.alpha))]
    return np.minimum(np.array(counts) * level.h**2 / STRIP, 1.0)


def last_levels(proof: Proof) -> list[LevelRecord]:
    """The last level of each spacing."""
    return list({level.h: level for level in proof.levels}.values())


def box_shares(boxes: Floats) -> Floats:
    """The part of the strip in the boxes (n, 4) of a certificate."""
    return (boxes[:, 1] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 2]) / STRIP


def draw_maps(proof: Proof, boxes: Floats, path: Path) -> None:
    """Draw the part left at every pixel for every level, and after the last; one colour scale."""
    levels = last_levels(proof)
    values = [*map(remaining_shares, levels), box_shares(boxes)]
    titles = [
        f"level {number}, {np.degrees(level.h):.2g}° apart\n"
        f"{np.count_nonzero(level.allowed):,} labels, bound {level.bound:.4f}"
        for number, level in enumerate(levels, start=1)
    ]
    titles.append(f"after the last level\nbound {proof.bound:.4f} = energy")
    rows = -(-len(values) // COLUMNS)
    norm = LogNorm(10.0 ** np.floor(np.log10(values[-1].min())), 1.0)
    with fixed_settings(STYLE):
        figure = Figure(figsize=(11.5, 2.75 * rows + 0.2), layout="constrained")
        axes = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
        for place, (array, title) in zip(axes, zip(values, titles, strict=True), strict=False):
            shown = _map(place, proof.field.instance.grid, array, norm)
            place.set_title(title, fontsize=10)
        for place in axes[len(values) :]:
            place.set_axis_off()
        if len(values) < len(axes):
            _gaps(axes[len(values)], proof)
        _strokes(axes[0], proof)
        bar = figure.colorbar(shown, ax=axes, aspect=35, pad=0.02)
        bar.set_label("remaining share of the strip of crosses")
        figure.savefig(path, dpi=110, metadata={"Software": None})


def _gaps(place: Any, proof: Proof) -> None:
    """Draw the distance of every level's bound from the energy."""
    gaps = [100 * (proof.energy - level.bound) / proof.energy for level in last_levels(proof)]
    numbers = range(1, len(gaps) + 1)
    place.set_axis_on()
    place.semilogy(numbers, gaps, "o-", color=CELL, markersize=4)
    for number, gap in zip(numbers, gaps, strict=True):
        place.annotate(f"{gap:.2g} %", (number, gap), (4, 4), textcoords="offset points", fontsize=8)
    place.set_title("gap of each level", fontsize=10)
    place.set_xlabel("level", fontsize=9)
    place.set(xticks=list(numbers), xlim=(0.6, len(gaps) + 1.1), yticks=[])
    place.minorticks_off()
    place.spines[["top", "right", "left"]].set_visible(False)


def _map(place: Any, grid: Grid, values: Floats, norm: LogNorm) -> Any:
    picture = np.full((grid.height, grid.width), np.nan)
    picture[grid.rows, grid.columns] = values
    place.set_axis_off()
    return place.imshow(picture, norm=norm, cmap=COLOURS, interpolation="nearest")


def _strokes(place: Any, proof: Proof) -> None:
    """Mark the pixels with strokes."""
    instance = proof.field.instance
    at = instance.stroke_index
    place.plot(instance.grid.columns[at], instance.grid.rows[at], "o", color=V, markersize=1.8)
