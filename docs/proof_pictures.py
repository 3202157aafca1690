"""The picture of the home page: the crosses left at every level of a proof (`python docs/make.py proof`)."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any, Final

import numpy as np
from crossfield.export.pictures.marks import STROKE
from crossfield.models.instance.angles import HALF
from crossfield.models.instance.domain import Bools, Floats
from crossfield.models.instance.grid import Grid
from crossfield.models.processes.limits import Limits
from crossfield.models.proof.certificate import write_certificate
from crossfield.models.proof.checkers import check_certificate
from crossfield.models.proof.descent.record import Proof
from crossfield.models.proof.prove import prove
from crossfield.models.samples.samples import sample
from diagrams import STYLE
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from plots import fixed_settings

STRIP: Final = HALF**2
"""Area of all crosses, in radians squared."""
COLOURS: Final = "viridis"
COLUMNS: Final = 4
WIDE: Final = 4.9
"""Inches, for words that are legible on a phone."""


def remaining_shares(allowed: list[Bools], h: float) -> Floats:
    """The part of the strip that may hold a better cross of each pixel, shape (n,).

    allowed: the labels of each pixel. A cell is left if its four vertices are.
    """
    counts = [check_certificate.combine_corners(np.logical_and, labels).sum() for labels in allowed]
    return np.minimum(np.array(counts) * h**2 / STRIP, 1.0)


def box_shares(boxes: Floats) -> Floats:
    """The part of the strip in the boxes (n, 4) of a certificate."""
    return (boxes[:, 1] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 2]) / STRIP


def draw_maps(proof: Proof, boxes: Floats, path: Path) -> None:
    """Draw the part left at every pixel for every level, and after the last; one colour scale."""
    arrays = proof.certificate()
    terms, _, _ = check_certificate.terms_with_strokes(arrays, *check_certificate.terms_of(arrays))
    last = {level.h: number for number, level in enumerate(proof.levels)}.values()
    levels = [proof.levels[number] for number in last]
    allowed = [check_certificate.level_of(arrays, number, terms).allowed for number in last]
    left = [remaining_shares(of_level, level.h) for of_level, level in zip(allowed, levels, strict=True)]
    values = [*left, box_shares(boxes)]
    gaps = [1 - level.bound / proof.energy for level in levels]
    titles = [
        f"{np.degrees(level.h):.2g}° apart\ngap {100 * gap:.2g} %"
        for level, gap in zip(levels, gaps, strict=True)
    ]
    titles.append("last step\nno gap")
    rows = -(-len(values) // COLUMNS)
    norm = LogNorm(10.0 ** np.floor(np.log10(values[-1].min())), 1.0)
    with fixed_settings(STYLE | {"font.size": 10}):
        figure = Figure(figsize=(WIDE, 1.5 * rows + 0.7), layout="constrained")
        axes = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
        for place, (array, title) in zip(axes, zip(values, titles, strict=True), strict=False):
            shown = _map(place, proof.field.instance.grid, array, norm)
            place.set_title(title, fontsize=9)
        for place in axes[len(values) :]:
            place.set_axis_off()
        _strokes(axes[0], proof)
        bar = figure.colorbar(shown, ax=axes, orientation="horizontal", aspect=35, pad=0.03)
        bar.set_label("remaining share of all crosses")
        figure.savefig(path, dpi=160, metadata={"Software": None})


def _map(place: Any, grid: Grid, values: Floats, norm: LogNorm) -> Any:
    picture = np.full((grid.height, grid.width), np.nan)
    picture[grid.rows, grid.columns] = values
    place.set_axis_off()
    return place.imshow(picture, norm=norm, cmap=COLOURS, interpolation="nearest")


def _strokes(place: Any, proof: Proof) -> None:
    """Mark the pixels with strokes."""
    instance = proof.field.instance
    at = instance.stroke_index
    place.plot(instance.grid.columns[at], instance.grid.rows[at], "o", color=STROKE, markersize=1.0)


def draw_levels() -> None:
    """Prove the sample `mouse`, and draw its picture."""
    proof = prove(sample("mouse", 24), limits=Limits(120.0, gap=0))
    with tempfile.TemporaryDirectory() as folder:
        certificate = write_certificate(proof, Path(folder) / "certificate.npz")
    draw_maps(proof, certificate.proven.boxes, Path(__file__).parent / "pictures" / "proof_levels.png")
