"""A shaded surface with the strokes drawn over it, and the strokes on paper as a texture."""

from __future__ import annotations

from typing import Final

import numpy as np

from ...models.instance.grid import Floats
from ...models.instance.instance import Instance
from ..pictures.canvas import pixels_of
from ..pictures.draw import own_settings
from ..pictures.drawing import Drawing
from ..pictures.layers import strokes_sheet

PAPER: Final = (0.93, 0.91, 0.88)


def strokes(instance: Instance, drawing: Drawing | None, scale: int) -> Floats:
    """Red, green, blue and opacity (h, w, 4) in [0, 1] of the strokes, `scale` pixels per pixel of the grid.

    They come from the drawing, or are pieces of line at the stroke pixels without one.
    """
    height, width = (side * scale for side in instance.mask.shape)
    with own_settings():
        drawn: Floats = pixels_of(strokes_sheet(instance, drawing), width, height) / 255.0
    return drawn


def over(above: Floats, below: Floats) -> Floats:
    """One picture (h, w, 4) laid over another, both with opacity as fourth value."""
    front, back = above[..., 3:], below[..., 3:] * (1 - above[..., 3:])
    opacity = front + back
    colour = (front * above[..., :3] + back * below[..., :3]) / np.maximum(opacity, 1e-9)
    return np.concatenate([colour, opacity], axis=-1)


def on_paper(drawn: Floats) -> Floats:
    """Red, green and blue (h, w, 3) of the strokes on paper, as the texture of a mesh."""
    return over(drawn, np.broadcast_to((*PAPER, 1.0), drawn.shape))[..., :3]
