"""A surface over the mask of an instance: heights at the corners of its pixels, in pixels."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..field.field import CrossField
from ..instance.domain import Floats
from ..instance.instance import Instance
from ..previews import Pictured
from .freedom import Freedom


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
        row, column = self.instance.grid.rows, self.instance.grid.columns
        return np.stack(
            [self.heights[row + down, column + right] for down in (0, 1) for right in (0, 1)], axis=1
        )

    @cached_property
    def gradient(self) -> Floats:
        """Slopes (dz/dx, dz/dy) at the pixels' centres, y up, shape (n, 2)."""
        upper_left, upper_right, lower_left, lower_right = self.corners.T
        across = (upper_right - upper_left + lower_right - lower_left) / 2
        upward = (upper_left - lower_left + upper_right - lower_right) / 2
        return np.stack([across, upward], axis=1)

    @cached_property
    def normals(self) -> Floats:
        """Unit normals towards the viewer at the pixels' centres, shape (n, 3)."""
        normal = np.column_stack([-self.gradient, np.ones(len(self.gradient))])
        return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))

    def flipped(self) -> Surface:
        """The same surface turned inside out, z to -z: the crosses are the same."""
        return replace(self, heights=-self.heights)
