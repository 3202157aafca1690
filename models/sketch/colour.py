"""Recognition of strokes, and of red strokes, by colour on white paper."""

from __future__ import annotations

from typing import Final

import numpy as np

from ..instance.domain import Bools, Floats

PAPER: Final = 0.1  # ink below this counts as paper
REDDISH: Final = 0.4  # least share of a stroke's ink that must be missing from green and blue alone


def ink_of(rgb: Floats) -> Floats:
    """Ink of a colour, 1 - min(red, green, blue) in [0, 1], shape (...,): 1 for black and for pure red."""
    return np.asarray(1 - rgb.min(axis=-1))


def redness(rgb: Floats) -> Floats:
    """Amount of red ink in a colour, (...,): red - max(green, blue), less orange and purple."""
    red, green, blue = np.moveaxis(rgb, -1, 0)
    return np.asarray(np.maximum(red - np.maximum(green, blue) - np.abs(green - blue) / 2, 0))


def is_paper(rgb: Floats) -> Bools:
    """True where a colour is as good as white; shape (...,)."""
    return ink_of(rgb) < PAPER


def is_red(rgb: Floats) -> Bools:
    """True where a colour is a saturated red; shape (...,)."""
    return redness(rgb) > REDDISH * ink_of(rgb)
