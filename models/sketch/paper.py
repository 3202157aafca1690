"""Colours relative to the paper: what the picture would show on white paper in even light.

Paper is what is most frequent. Strokes are darker than it, or lighter as chalk on a board is, or both as on
brown paper. Lighter strokes come out black, and red if they are red.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..instance.domain import Floats
from .colour import redness
from .cover import block_means

Ink = NDArray[np.float32]

_LIGHT_SIDE: Final = 256  # blocks on the longer side in which the light on the paper is found
_SHADOW: Final = 0.1  # of the longer side: darker and wider regions are shadows, not ink
_DARKEST_SHADOW: Final = 0.25  # of the paper's level: darker and wide regions are solid ink after all
_PURE: Final = 0.2  # of the paper's level: paper that has less of a colour says nothing of that colour
_OTHER: Final = 0.05  # least difference of a stroke's colour from the paper's in a channel
_EVEN: Final = 1.05  # light that differs by less counts as even, and the picture is not changed
_PAPER_SIDE: Final = 64  # blocks on the longer side whose most frequent colour is that of the paper
_LEAST_BLOCK: Final = 8.0  # pixels on a side of a block
_SAMPLE: Final = 16  # pixels of a block in each direction that are looked at
_PAPER_NEAR: Final = 5  # blocks side by side whose median that colour is
_WEIGHED_SIDE: Final = 1024  # pixels on the longer side of the picture whose strokes are weighed
_CLEAR: Final = 0.04  # least difference of brightness from the paper, of 1, that is no grain
_GRAIN: Final = 6.0  # times the median difference: differences up to it are grain, too
_SOLID: Final = 0.35  # difference of brightness from the usual paper of what is solid ink
_LEAST_CONTRAST: Final = 32.0  # of 255, between paper and white
_BOTH: Final = 0.25  # least ratio of lighter and darker strokes, either way, if both count


def relative_to_paper(pixels: NDArray[np.uint8]) -> Floats:
    """Colours [h, w, 1 or 3] relative to the paper, in [0, 1]: 1 for paper and less for strokes."""
    paper = _find_usual_colours(pixels)
    dark, light = _weigh_strokes(pixels, paper)
    if light <= _BOTH * dark:
        return _relative_to_light_paper(pixels, paper)
    colours = _darken_lighter_strokes(pixels, paper)
    if dark > _BOTH * light:
        for channel in range(pixels.shape[-1]):
            scale = np.maximum(_enlarge(paper[..., channel], pixels.shape[:2]), 1)
            np.minimum(colours[..., channel], pixels[..., channel] / scale, out=colours[..., channel])
    return colours


def _find_usual_colours(pixels: NDArray[np.uint8]) -> Ink:
    """The most frequent colours round each of some blocks, [rows, columns, channels]."""
    from scipy import ndimage

    sides = pixels.shape[:2]
    block = max(max(sides) / _PAPER_SIDE, _LEAST_BLOCK)
    counts = [max(1, round(side / block)) for side in sides]
    rows, columns = (
        ((np.arange(_SAMPLE * count) + 0.5) * side / (_SAMPLE * count)).astype(int)
        for side, count in zip(sides, counts, strict=True)
    )
    sample = pixels[rows[:, None], columns].reshape(counts[0], _SAMPLE, counts[1], _SAMPLE, -1)
    usual = np.median(sample, axis=(1, 3)).astype(np.float32)
    return np.asarray(ndimage.median_filter(usual, (_PAPER_NEAR, _PAPER_NEAR, 1), mode="nearest"))


def _weigh_strokes(pixels: NDArray[np.uint8], paper: Ink) -> tuple[float, float]:
    """How much is darker, and how much is lighter, than the paper round it."""
    from PIL import Image

    image = Image.fromarray(pixels if pixels.shape[-1] == 3 else pixels[..., 0])
    reduced = np.atleast_3d(np.asarray(image.reduce(-(-max(pixels.shape) // _WEIGHED_SIDE))))
    small = reduced.mean(axis=-1, dtype=np.float32) / 255
    bright = paper.mean(axis=-1) / 255
    usual = _enlarge(bright, small.shape)
    lighter = (small - usual)[np.abs(usual - np.median(bright)) < _SOLID]
    clear = max(_CLEAR, _GRAIN * float(np.median(np.abs(lighter))))
    return float(np.maximum(-lighter - clear, 0).sum()), float(np.maximum(lighter - clear, 0).sum())


def _darken_lighter_strokes(pixels: NDArray[np.uint8], paper: Ink) -> Floats:
    """Colours on white paper whose strokes are as dark as those of the picture are lighter than its paper."""
    shape = pixels.shape[:2]
    # Nearly black paper says little of the light on it.
    bright = paper.mean(axis=-1) + _LEAST_CONTRAST
    light = _enlarge(np.clip(bright / np.quantile(bright, 0.95), _DARKEST_SHADOW, 1), shape)
    ground = np.stack([_enlarge(channel, shape) for channel in np.moveaxis(paper, -1, 0)], axis=-1)
    excess: Floats = np.subtract(pixels, ground)
    lighter, contrast = (
        np.einsum("ijk,ijk->ij", part, part)  # many times as fast as norms
        for part in (np.maximum(excess, 0), 255 * light[..., None] - ground)
    )
    ink = np.sqrt(np.minimum(lighter / np.maximum(contrast, _LEAST_CONTRAST**2), 1))
    colours: Floats = np.empty_like(excess)
    colours[...] = 1 - ink[..., None]
    if pixels.shape[-1] > 1:
        excess += ink[..., None] * ground  # the colour of the stroke, times its share of the pixel
        brightest = np.maximum(np.maximum(excess[..., 0], excess[..., 1]), excess[..., 2])
        colours[..., 0] += ink * np.clip(redness(excess) / np.maximum(brightest, 1), 0, 1)
    return colours


def _relative_to_light_paper(pixels: NDArray[np.uint8], usual: Ink) -> Floats:
    """Colours of darker strokes relative to the paper."""
    # At least a quarter of a drawing is bare paper, so the upper quartile is a level of the paper.
    level = np.percentile(pixels.reshape(-1, pixels.shape[-1]), 75, axis=0).astype(np.float32)
    colours: Floats = pixels.astype(np.float32)
    colours /= np.maximum(level, 1)
    light = _estimate_light(colours, usual / np.maximum(level, 1))
    if max(float(light.max()), 1 / max(float(light.min()), _PURE)) > _EVEN:
        for channel in range(pixels.shape[-1]):
            ground = _enlarge(light[..., channel], pixels.shape[:2])
            colours[..., channel] /= np.maximum(ground, _PURE)
            colours[..., channel][ground < _PURE] = np.inf
        # On paper of a pure colour, strokes show in the other channels only.
        np.copyto(colours, colours.min(axis=-1, keepdims=True), where=np.isinf(colours))
    return np.minimum(colours, 1, out=colours)


def _estimate_light(colours: Floats, usual: Floats | Ink) -> Ink:
    """The light on the paper in blocks [rows, columns, channels], 1 where it is that of the whole picture.

    An area of another colour, such as a card or a body that is filled, is paper in light of that colour.
    usual: the most frequent colours, as from `_find_usual_colours`, relative to the paper of the picture.
    """
    from scipy import ndimage

    # A grey closing lets lighter surroundings cover darker regions narrower than _SHADOW, in linear time. So
    # strokes vanish, and shadows stay, whether gradual or sharp. Means over blocks remove noise first.
    height, width, channels = colours.shape
    block = max(1, max(height, width) // _LIGHT_SIDE)
    rows, columns = (np.append(np.arange(0, side, block), side) for side in (height, width))
    coarse = np.stack([block_means(colours[..., each], rows, columns) for each in range(channels)], axis=-1)
    # Some colour of a stroke may be lighter than its ground, as red on a blue card.
    ground = np.stack([_enlarge(part, coarse.shape[:2]) for part in np.moveaxis(usual, -1, 0)], axis=-1)
    lighter, darker = ((side > _OTHER).any(axis=-1) for side in (coarse - ground, ground - coarse))
    coarse = np.where((lighter & darker)[..., None], ground, coarse)
    size = int(_SHADOW * max(coarse.shape)) | 1
    closed = ndimage.grey_closing(coarse, (size, size, 1), mode="nearest")
    is_solid = closed.mean(axis=-1) < _DARKEST_SHADOW
    closed[is_solid] = np.maximum(closed[is_solid], _DARKEST_SHADOW)
    return np.asarray(ndimage.gaussian_filter(closed, (1.0, 1.0, 0.0), mode="nearest"), dtype=np.float32)


def _enlarge(blocks: Floats | Ink, shape: tuple[int, ...]) -> Ink:
    """Values of equal blocks [rows, columns], interpolated linearly at the pixels of a picture."""
    from PIL import Image

    enlarged = Image.fromarray(blocks.astype(np.float32)).resize(
        (shape[1], shape[0]), Image.Resampling.BILINEAR
    )
    return np.asarray(enlarged)
