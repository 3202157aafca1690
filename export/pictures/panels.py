"""The panels of a picture: each function draws one kind onto one set of matplotlib axes.

Axes are in pixel units, x = column, y = -row (y up); pixel [row, column] is the unit square round (column,
-row). Widths, marks and spacings are in points of the printed picture, so that 24 and 200 pixels look alike.
The two families are teal and orange, which stay apart for all common kinds of colour blindness.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, Final

import numpy as np

from ...models.errors import InputError
from ...models.field.field import CrossField
from ...models.instance.grid import Bools, Floats
from ...models.instance.instance import Instance
from ...models.surface.surface import Surface
from .combing import combed
from .streamlines import Streamline, streamlines

FAMILIES: Final = ("#00798c", "#e1812c")
POSITIVE: Final = "#d1242f"
NEGATIVE: Final = "#3056d3"
COLLAPSED: Final = "#b9a3d6"
STROKE: Final = "#b3261e"
FAINT: Final = "#c9c9c9"
BORDER: Final = "#9a9a9a"
OUTSIDE: Final = "#ececec"
OPENING: Final = "#3056d3"

SPACING: Final = 6.5
"""Points between streamlines of one family in a panel of full size."""


@dataclass(frozen=True, eq=False)
class Picture:
    """What a panel shows and how large it is.

    size: points of the longer side of the grid. sketch: polylines (k, 2) in pixel units, drawn faintly below.
    surface: of its field, where the picture shows one.
    """

    instance: Instance
    field: CrossField | None
    sketch: tuple[Floats, ...]
    size: float
    surface: Surface | None = None

    @property
    def openings(self) -> tuple[Floats, ...]:
        """The bridged gaps in the outline, (2, 2) each, in pixel units."""
        reading = self.instance.reading
        return (
            ()
            if reading is None
            else tuple(on_grid(np.array(ends), self.instance) for ends in reading.openings)
        )

    @property
    def unit(self) -> float:
        """Points per pixel."""
        return self.size / max(self.instance.grid.height, self.instance.grid.width)

    @property
    def ink(self) -> float:
        """Factor of widths and marks: 1 in a panel of 320 points, less in smaller ones."""
        return float(np.sqrt(self.size / 320))

    @property
    def crosses(self) -> CrossField:
        """The field. Raises InputError where the picture has none."""
        if self.field is None:
            raise InputError(
                f"{self.instance.name} is an instance without a field; draw it with kind instance, "
                "or solve it first"
            )
        return self.field

    @cached_property
    def combed(self) -> CrossField:
        """The field with labels that agree from pixel to pixel, so that colours do."""
        return combed(self.crosses)


def on_grid(points: Floats, instance: Instance) -> Floats:
    """Points (k, 2) of the sketch, y down, in pixel units, y up."""
    scaled: Floats = ((points - instance.origin) / instance.pixel_size - 0.5) * np.array([1.0, -1.0])
    return scaled


def draw_instance(axes: Any, picture: Picture) -> None:
    """Mask and strokes, and the gaps in the outline that were bridged when the drawing was read."""
    from matplotlib.colors import to_rgba

    mask = picture.instance.mask
    shade = np.where(mask[..., None], 1.0, np.array(to_rgba(OUTSIDE)))
    _image(axes, shade)
    _sketch(axes, picture)
    _strokes(axes, picture, STROKE, max(1.1 * picture.ink, min(0.22 * picture.unit, 2.6)), fade=1.0)
    _border(axes, picture)
    _lines(axes, picture.openings, OPENING, 2.6 * picture.ink)


def draw_crosses(axes: Any, picture: Picture) -> None:
    """Crosses on the pixels, at least some points apart."""
    field = picture.combed
    grid = field.instance.grid
    every = int(np.ceil(7.5 * picture.ink / picture.unit))
    chosen = (grid.rows % every == every // 2) & (grid.columns % every == every // 2)
    _under(axes, picture)
    for vectors, colour in zip((field.u, field.v), FAMILIES, strict=True):
        centre = np.stack([grid.columns, -grid.rows], axis=1)[chosen]
        arm = 0.42 * every * vectors[chosen]
        _lines(axes, np.stack([centre - arm, centre + arm], axis=1), colour, 0.9 * picture.ink)
    _singularities(axes, picture)


def draw_streamlines(axes: Any, picture: Picture) -> None:
    """Evenly spaced streamlines of both families, singularities and degenerate pixels."""
    _under(axes, picture)
    _degenerate(axes, picture)
    spacing = SPACING * picture.ink / picture.unit
    lines = streamlines(picture.crosses, spacing)
    for family, colour in enumerate(FAMILIES):
        _lines(axes, [run for line in lines for run in runs(line, family)], colour, 0.85 * picture.ink)
    _singularities(axes, picture)


def draw_angle(axes: Any, picture: Picture) -> None:
    """The angle between the two lines in degrees."""
    field = picture.crosses
    image = _image(axes, field.image(np.degrees(field.angle_between)), vmin=0.0, vmax=90.0, cmap="magma")
    _border(axes, picture)
    _singularities(axes, picture)
    _bar(axes, image, picture, "angle between the lines", ticks=[0, 30, 60, 90], format="%d°")


def draw_energy(axes: Any, picture: Picture) -> None:
    """The smoothness energy of each pixel, on a square-root scale."""
    from matplotlib.colors import PowerNorm

    field = picture.crosses
    energy = field.pixel_energy
    top = float(energy.max()) if energy.max() > 1e-12 else 1.0
    image = _image(axes, field.image(energy), norm=PowerNorm(0.5, vmin=0.0, vmax=top), cmap="Reds")
    _border(axes, picture)
    _singularities(axes, picture)
    _bar(
        axes,
        image,
        picture,
        "smoothness energy in rad²",
        ticks=[share**2 * top for share in (0, 0.25, 0.5, 0.75, 1)],
        format="%.2g",
    )


def legend_of(picture: Picture) -> list[Any]:
    """Keys for what a picture of the field holds."""
    from matplotlib.lines import Line2D

    field = picture.crosses
    index = field.singularities.index
    keys = [
        Line2D([], [], color=colour, lw=1.4, label=f"lines {name}")
        for colour, name in zip(FAMILIES, "uv", strict=True)
    ]
    for colour, name, some in ((POSITIVE, "+", index > 0), (NEGATIVE, "−", index < 0)):
        if some.any():
            sizes = "1/4" if (np.abs(index[some]) < 0.5).all() else "1/4, large: 1/2"
            keys.append(
                Line2D([], [], ls="", marker="o", ms=5, mew=0, color=colour, label=f"index {name}{sizes}")
            )
    if field.degenerate.any():
        keys.append(Line2D([], [], ls="", marker="s", ms=5, mew=0, color=COLLAPSED, label="lines coincide"))
    return keys


def _under(axes: Any, picture: Picture) -> None:
    _sketch(axes, picture)
    if not picture.sketch:
        _strokes(axes, picture, FAINT, 2.6 * picture.ink, fade=0.8)
    _border(axes, picture)


def runs(line: Streamline, family: int) -> list[Floats]:
    """The stretches of a line on which it belongs to a family; neighbouring stretches share a point."""
    limits = np.concatenate([[0], np.flatnonzero(np.diff(line.families)) + 1, [len(line.points)]])
    return [
        line.points[first : stop + 1]
        for first, stop in pairwise(limits.tolist())
        if line.families[first] == family
    ]


def _lines(axes: Any, lines: Any, colour: Any, width: float, *, snap: bool = False) -> None:
    from matplotlib.collections import LineCollection

    lines = LineCollection(
        lines, colors=colour, linewidths=width, capstyle="round", joinstyle="round", clip_on=False
    )
    lines.set_snap(snap)
    axes.add_collection(lines, autolim=False)


def _sketch(axes: Any, picture: Picture) -> None:
    _lines(axes, picture.sketch, FAINT, 1.6 * picture.ink)


def _strokes(axes: Any, picture: Picture, colour: str, width: float, fade: float) -> None:
    """A short segment at each stroke pixel, the more opaque the more reliable."""
    from matplotlib.colors import to_rgba

    theta, w = picture.instance.theta, picture.instance.w
    row, column = picture.instance.stroke_pixels.T
    centre = np.stack([column, -row], axis=1)
    arm = 0.48 * np.stack([np.cos(theta), np.sin(theta)], axis=1)
    colours = np.tile(to_rgba(colour), (len(row), 1))
    colours[:, 3] = fade * (0.2 + 0.8 * w)
    _lines(axes, np.stack([centre - arm, centre + arm], axis=1), colours, width)


def _border(axes: Any, picture: Picture) -> None:
    """The outline of the mask, along pixel sides."""
    outline = sides(np.pad(picture.instance.mask, 1), between=False) * (1, -1) + (-0.5, 0.5)
    _lines(axes, outline, BORDER, 0.5 * picture.ink, snap=True)


def sides(mask: Bools, *, between: bool) -> Floats:
    """Sides of pixels as segments (k, 2, 2): between pixels of the padded mask, or at its border.

    Points are (x, y) with y down; pixel [row, column] reaches from (column, row) one further.
    """
    first, second = (mask[1:, :], mask[:-1, :]), (mask[:, 1:], mask[:, :-1])
    row, column = np.nonzero(first[0] & first[1] if between else first[0] != first[1])
    level = np.stack([np.stack([column - 1, row], axis=1), np.stack([column, row], axis=1)], axis=1)
    row, column = np.nonzero(second[0] & second[1] if between else second[0] != second[1])
    upright = np.stack([np.stack([column, row - 1], axis=1), np.stack([column, row], axis=1)], axis=1)
    return np.concatenate([level, upright]).astype(np.float64)


def _image(axes: Any, values: Floats, **style: Any) -> Any:
    height, width = values.shape[:2]
    return axes.imshow(
        values,
        extent=(-0.5, width - 0.5, 0.5 - height, 0.5),
        origin="upper",
        interpolation="nearest",
        **style,
    )


def _singularities(axes: Any, picture: Picture) -> None:
    """Red and blue dots, larger from an index of 1/2 on."""
    found = picture.crosses.singularities
    crowd = np.clip(40 / np.sqrt(max(len(found.index), 1)), 0.35, 1.0)
    size = np.where(np.abs(found.index) < 0.5, 5.5, 8.0) * picture.ink * crowd
    colours = np.where(found.index > 0, POSITIVE, NEGATIVE)
    axes.scatter(
        found.column + 0.5,
        -found.row - 0.5,
        s=size**2,
        c=colours,
        edgecolors="white",
        linewidths=0.8 * picture.ink * crowd,
        zorder=3,
        clip_on=False,
    )


def _degenerate(axes: Any, picture: Picture) -> None:
    field = picture.crosses
    grid = field.instance.grid
    at = field.degenerate
    size = max(1.15 * picture.unit, 2.5 * picture.ink)  # a little over, or seams show
    axes.scatter(
        grid.columns[at], -grid.rows[at], s=size**2, marker="s", color=COLLAPSED, linewidths=0, zorder=1
    )


def _bar(axes: Any, image: Any, picture: Picture, label: str, **style: Any) -> None:
    """A colour bar to the right of the axes, in room that the page has left there."""
    inset = axes.inset_axes([1 + 9 / picture.size, 0.0, 8 / picture.size, 1.0])
    bar = axes.figure.colorbar(image, cax=inset, **style)
    bar.outline.set_visible(False)
    if picture.unit * picture.instance.grid.height > 100:
        bar.set_label(label, fontsize=7)
    else:
        bar.set_ticks([bar.vmin, bar.vmax])
    inset.tick_params(labelsize=6.5, length=2, width=0.5)
