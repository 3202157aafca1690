"""The panels of a picture of a surface: each function draws one kind onto one set of matplotlib axes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from ...models.instance.grid import Floats
from ..shading.light import lit
from ..shading.matcap import matcap
from ..shading.normal_map import coloured
from ..shading.raster import Raster, raster
from .panels import Picture

_DOTS_A_POINT: Final = 3  # as in a PNG


def draw_shaded(axes: Any, picture: Picture) -> None:
    """The surface in the light of a lamp."""
    _draw(axes, picture, lit)


def draw_matcap(axes: Any, picture: Picture) -> None:
    """The surface in the material of a ball."""
    _draw(axes, picture, matcap)


def draw_normals(axes: Any, picture: Picture) -> None:
    """The normals as colours, smooth."""
    _draw(axes, picture, coloured)


def _draw(axes: Any, picture: Picture, colours: Callable[[Raster], Floats]) -> None:
    """An image over the whole grid, smooth at any size; a picture without a surface has none."""
    if picture.surface is None:
        return
    scale = max(1, round(_DOTS_A_POINT * picture.unit))
    axes.imshow(
        colours(raster(picture.instance, picture.surface.normals, scale)),
        extent=picture.extent,
        aspect="auto",
        origin="upper",
        interpolation="hanning",
        interpolation_stage="rgba",
    )
