"""A surface over the mask of an instance: heights at the corners of its pixels, in pixels."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..field.field import CrossField
from ..instance.domain import Floats
from ..instance.instance import Instance
from ..previews import Pictured
from .equations import normals_of
from .freedom import Freedom
from .stencils import SLOPES, corners_of_blocks


@dataclass(frozen=True, eq=False)
class Surface(Pictured):
    """Heights that a cross field was lifted to.

    Parameters
    ----------
    field
        The cross field.
    heights
        Heights at the corners of pixels in pixels, float (height + 1, width + 1), [0, 0] at the upper left;
        NaN at a corner of no pixel of the mask.
    confidence
        How well the equations hold at each pixel, float (n,) in [0, 1]. It does not measure the distance from
        the intended surface.
    freedom
        Choices that the crosses leave open, with the option that decides each. Flatter and deeper surfaces
        often fit too where none is named.
    interrupted
        Whether `stop` ended the descent before the heights had settled.

    """

    field: CrossField
    heights: Floats
    confidence: Floats
    freedom: tuple[Freedom, ...] = ()
    interrupted: bool = False

    def __repr__(self) -> str:
        deep = np.nanmax(self.heights) - np.nanmin(self.heights)
        end = ", interrupted" if self.interrupted else ""
        return f"<Surface on {self.instance.name}: {deep:.4g} pixels deep{end}>"

    @property
    def instance(self) -> Instance:
        """The instance of the field."""
        return self.field.instance

    @cached_property
    def corners(self) -> Floats:
        """Heights at the corners of each pixel, shape (n, 4): upper left and right, lower left and right."""
        corners = corners_of_blocks(self.heights)
        return np.stack([corner[self.instance.mask] for corner in corners], axis=1)

    @cached_property
    def gradient(self) -> Floats:
        """Slopes (dz/dx, dz/dy) at the pixels' centres, y up, shape (n, 2)."""
        return np.asarray(self.corners @ SLOPES.T)

    @cached_property
    def normals(self) -> Floats:
        """Unit normals towards the viewer at the pixels' centres, shape (n, 3)."""
        return normals_of(self.gradient.T).T

    def flipped(self) -> Surface:
        """The same surface turned inside out, z to -z: the crosses are the same."""
        return replace(self, heights=-self.heights)
