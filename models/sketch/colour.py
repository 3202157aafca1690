"""Colours: their notation in CSS, and the recognition of paper and of red strokes."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Final

import numpy as np

from ..input_limits import MAX_LENGTH
from ..instance.domain import Bools, Floats

PAPER: Final = 0.1  # ink below this counts as paper
REDDISH: Final = 0.4  # least share of a stroke's ink that must be missing from green and blue alone

# From CSS Color Module Level 4, section 18 (sample code).
_P3_TO_SRGB: Final = [
    [1.2249402, -0.2249402, 0],
    [-0.0420570, 1.0420570, 0],
    [-0.0196376, -0.0786361, 1.0982735],
]


def ink_of(rgb: Floats) -> Floats:
    """Ink of a colour, 1 - min(red, green, blue) in [0, 1], shape (...,): 1 for black and for pure red."""
    return np.asarray(1 - rgb.min(axis=-1))


def redness(rgb: Floats) -> Floats:
    """Amount of red ink in a colour, (...,): red - max(green, blue), less orange and purple."""
    red, green, blue = np.moveaxis(rgb, -1, 0)
    return np.asarray(np.maximum(red - np.maximum(green, blue) - np.abs(green - blue) / 2, 0))


def is_red(rgb: Floats) -> Bools:
    """True where a colour is a saturated red; shape (...,)."""
    return redness(rgb) > REDDISH * ink_of(rgb)


@lru_cache(maxsize=1024)
def hex_colour(text: str) -> str | None:
    """A colour in CSS as #rrggbb, or as #rrggbbaa if it is not opaque; None if it cannot be read."""
    from tinycss2.color4 import parse_color

    parsed = parse_color(text) if len(text) <= MAX_LENGTH else None
    if parsed is None or isinstance(parsed, str):
        return None
    channels = _srgb_channels(parsed)
    if channels is None:
        return None
    levels = np.rint(255 * np.clip([*channels, parsed.alpha], 0, 1)).astype(int).tolist()
    return "#" + "".join(f"{level:02x}" for level in (levels if levels[3] < 255 else levels[:3]))


def _srgb_channels(colour: Any) -> Any:
    """Red, green and blue in [0, 1] of a parsed colour; None for spaces that no drawing program writes."""
    if colour.space in ("srgb", "hsl", "hwb"):
        return colour.to("srgb").coordinates
    if colour.space != "display-p3":
        return None
    values = np.array([0.0 if value is None else value for value in colour.coordinates])
    linear = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    linear = np.clip(np.array(_P3_TO_SRGB) @ linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
