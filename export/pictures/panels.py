"""The panels of a picture: each function draws one kind onto matplotlib axes in points, y down."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from ...models.field.field import CrossField
from ...models.instance.domain import Floats
from ...models.instance.instance import Instance
from ...models.surface.surface import Surface
from ..shading.colours import shade_by_light
from ..shading.raster import raster, view_of_grid
from .canvas import draw_smooth_image, paint
from .marks import BORDER, FAINT, FAMILIES, NEGATIVE, POSITIVE, STROKE, GridFrame
from .palette import ANGLE_MAP

COLLAPSED: Final = "#b9a3d6"
OUTSIDE: Final = "#ececec"

_DOTS_PER_POINT: Final = 3  # of a surface, as in a PNG
SPACING: Final = 6.5  # points between streamlines of one family in a panel of full size


@dataclass(frozen=True, eq=False)
class PanelContent:
    """Contents and size of a panel, in points of the longer side of the grid."""

    instance: Instance
    field: CrossField | None
    size: float
    surface: Surface | None = None

    @property
    def frame(self) -> GridFrame:
        """The coordinates of the axes."""
        return GridFrame(self.instance, (0.0, 0.0), self.unit)

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top of an image over the grid."""
        return 0.0, self.unit * self.instance.grid.width, self.unit * self.instance.grid.height, 0.0

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
        """The field, of a picture that has one."""
        assert self.field is not None
        return self.field


def draw_instance(axes: Any, picture: PanelContent) -> None:
    """Mask and strokes."""
    frame = picture.frame
    paint(axes, [frame.area(OUTSIDE, ~picture.instance.mask)])
    paint(axes, frame.strokes(STROKE, max(1.1 * picture.ink, min(0.22 * picture.unit, 2.6))))
    _draw_border(axes, picture)


def draw_crosses(axes: Any, picture: PanelContent) -> None:
    """Crosses on the pixels, at least some points apart."""
    _draw_background(axes, picture)
    every = int(np.ceil(7.5 * picture.ink / picture.unit))
    paint(axes, picture.frame.crosses(picture.crosses, 0.9 * picture.ink, every))
    _draw_singularities(axes, picture)


def draw_streamlines(axes: Any, picture: PanelContent) -> None:
    """Evenly spaced streamlines of both families, singularities and degenerate pixels."""
    field = picture.crosses
    _draw_background(axes, picture)
    paint(axes, [picture.frame.area(COLLAPSED, field.image(field.degenerate) > 0)])
    paint(axes, picture.frame.streamlines(field, 0.85 * picture.ink, SPACING * picture.ink))
    _draw_singularities(axes, picture)


def draw_angle(axes: Any, picture: PanelContent) -> None:
    """The angle between the two lines in degrees."""
    field = picture.crosses
    degrees = field.image(np.degrees(field.angle_between))
    image = _draw_image(axes, picture, degrees, vmin=0.0, vmax=90.0, cmap=ANGLE_MAP)
    _draw_border(axes, picture)
    _draw_singularities(axes, picture)
    _draw_colour_bar(axes, image, picture, "angle between the lines", ticks=[0, 30, 60, 90], format="%d°")


def legend_keys(picture: PanelContent) -> list[Any]:
    """Keys of the marks in a picture of a field."""
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


def _draw_background(axes: Any, picture: PanelContent) -> None:
    """The strokes, faintly, and the border."""
    paint(axes, picture.frame.strokes(FAINT, 2.6 * picture.ink, 0.8))
    _draw_border(axes, picture)


def _draw_border(axes: Any, picture: PanelContent) -> None:
    paint(axes, [picture.frame.sides(BORDER, 0.5 * picture.ink)], snap=True)


def _draw_singularities(axes: Any, picture: PanelContent) -> None:
    paint(axes, picture.frame.singularities(picture.crosses, 2.75 * picture.ink))


def _draw_image(axes: Any, picture: PanelContent, values: Floats, **style: Any) -> Any:
    return axes.imshow(
        values, extent=picture.extent, origin="upper", interpolation="nearest", aspect="auto", **style
    )


def _draw_colour_bar(axes: Any, image: Any, picture: PanelContent, label: str, **style: Any) -> None:
    """A colour bar to the right of the axes, in room that the page has left there."""
    inset = axes.inset_axes([1 + 9 / picture.size, 0.0, 8 / picture.size, 1.0])
    bar = axes.figure.colorbar(image, cax=inset, **style)
    bar.outline.set_visible(False)
    if picture.unit * picture.instance.grid.height > 100:
        bar.set_label(label)
    else:
        bar.set_ticks([bar.vmin, bar.vmax])
    inset.tick_params(length=2, width=0.5)


def draw_surface(axes: Any, picture: PanelContent) -> None:
    """The surface in the light of a lamp, smooth at any size."""
    assert picture.surface is not None
    scale = max(1, round(_DOTS_PER_POINT * picture.unit))
    view = view_of_grid(picture.instance, scale)
    image = shade_by_light(raster(picture.instance, picture.surface.normals, view))
    draw_smooth_image(axes, image, picture.extent)
