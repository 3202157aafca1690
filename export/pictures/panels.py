"""The panels of a picture: each function returns the marks of one kind, in points, y down."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...models.field.field import CrossField
from ...models.instance.domain import Floats
from ...models.instance.instance import Instance
from ...models.surface.surface import Surface
from ..shading.colours import shade_by_light, to_eight_bit
from ..shading.raster import raster, view_of_grid
from .marks import BORDER, FAINT, FAMILIES, NEGATIVE, POSITIVE, STROKE, GridFrame, ImageMark, Mark, TextMark
from .palette import ANGLES

COLLAPSED: Final = "#b9a3d6"
OUTSIDE: Final = "#ececec"

_DOTS_PER_POINT: Final = 3  # of a surface, as in a PNG
_SHARP: Final = 800  # dots of the longer side of an image whose pixels are seen
_BAR: Final = 9.0  # points: width of a colour bar, and its distance from the panel
SPACING: Final = 6.5  # points between streamlines of one family in a panel of full size


@dataclass(frozen=True, eq=False)
class PanelContent:
    """Contents of a panel, points of the longer side of its grid, its upper left corner, size of words."""

    instance: Instance
    field: CrossField | None
    size: float
    surface: Surface | None = None
    corner: tuple[float, float] = (0.0, 0.0)
    words: float = 7.5

    @property
    def frame(self) -> GridFrame:
        """The coordinates of the picture."""
        return GridFrame(self.instance, self.corner, self.unit)

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Left, top, width and height of the grid."""
        return *self.corner, self.unit * self.instance.grid.width, self.unit * self.instance.grid.height

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


def draw_instance(picture: PanelContent) -> list[Mark]:
    """Mask and strokes."""
    frame = picture.frame
    strokes = frame.strokes(STROKE, max(1.1 * picture.ink, min(0.22 * picture.unit, 2.6)))
    return [frame.area(OUTSIDE, ~picture.instance.mask), *strokes, _border(picture)]


def draw_crosses(picture: PanelContent) -> list[Mark]:
    """Crosses on the pixels, at least some points apart."""
    every = int(np.ceil(7.5 * picture.ink / picture.unit))
    crosses = picture.frame.crosses(picture.crosses, 0.9 * picture.ink, every)
    return [*_background(picture), *crosses, *_singularities(picture)]


def draw_streamlines(picture: PanelContent) -> list[Mark]:
    """Evenly spaced streamlines of both families, singularities and degenerate pixels."""
    field, frame = picture.crosses, picture.frame
    collapsed = frame.area(COLLAPSED, field.image(field.degenerate, 0.0) > 0)
    lines = frame.streamlines(field, 0.85 * picture.ink, SPACING * picture.ink)
    return [collapsed, *_background(picture), *lines, *_singularities(picture)]


def draw_angle(picture: PanelContent) -> list[Mark]:
    """The angle between the two lines in degrees, with a colour bar to the right of the panel."""
    field = picture.crosses
    degrees = field.image(np.degrees(field.angle_between))
    fine = -(-_SHARP // max(degrees.shape))
    image = ImageMark(picture.box, np.kron(_angle_colours(degrees), np.ones((fine, fine, 1), dtype=np.uint8)))
    x, y, width, height = picture.box
    x += width + _BAR
    bar = ImageMark((x, y, _BAR, height), _angle_colours(np.linspace(90.0, 0.0, 91)[:, None]))
    ticks = (0, 30, 60, 90) if height > 8 * picture.words else (0, 90)
    words = [
        TextMark(
            f"{tick}°",
            (x + 1.5 * _BAR, y + height * (1 - tick / 90) + 0.35 * picture.words),
            picture.words,
            anchor="start",
        )
        for tick in ticks
    ]
    return [image, bar, *words, _border(picture), *_singularities(picture)]


def _angle_colours(degrees: Floats) -> NDArray[np.uint8]:
    """Colours (h, w, 4) of angles, transparent where they are not numbers."""
    stops = np.array([[*bytes.fromhex(colour[1:])] for colour in ANGLES])
    colours = [np.interp(degrees, np.linspace(0, 90, len(ANGLES)), stops[:, channel]) for channel in range(3)]
    opacity = np.where(np.isnan(degrees), 0, 255)
    table: NDArray[np.uint8] = np.nan_to_num(np.stack([*colours, opacity], axis=-1)).round().astype(np.uint8)
    return table


def draw_surface(picture: PanelContent) -> list[Mark]:
    """The surface in the light of a lamp, smooth at any size."""
    assert picture.surface is not None
    view = view_of_grid(picture.instance, max(1, round(_DOTS_PER_POINT * picture.unit)))
    image = shade_by_light(raster(picture.instance, picture.surface.normals, view))
    return [ImageMark(picture.box, to_eight_bit(image))]


DrawPanel = Callable[[PanelContent], list[Mark]]


def legend(field: CrossField) -> list[tuple[str, str]]:
    """Words on the marks in a picture of a field, and their colours."""
    index = field.singularities.index
    keys = [(f"lines {name}", colour) for name, colour in zip("uv", FAMILIES, strict=True)]
    for colour, name, some in ((POSITIVE, "+", index > 0), (NEGATIVE, "−", index < 0)):
        if some.any():
            sizes = "1/4" if (np.abs(index[some]) < 0.5).all() else "1/4, large: 1/2"
            keys.append((f"index {name}{sizes}", colour))
    return [*keys, ("lines coincide", COLLAPSED)] if field.degenerate.any() else keys


def _background(picture: PanelContent) -> list[Mark]:
    """The strokes, faintly, and the border."""
    return [*picture.frame.strokes(FAINT, 2.6 * picture.ink, 0.8), _border(picture)]


def _border(picture: PanelContent) -> Mark:
    return picture.frame.sides(BORDER, 0.5 * picture.ink)


def _singularities(picture: PanelContent) -> list[Mark]:
    return [*picture.frame.singularities(picture.crosses, 2.75 * picture.ink)]
