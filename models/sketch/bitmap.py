"""Reader of bitmaps: ink on paper, and stroke directions by a structure tensor.

The paper may have any colour lighter than the strokes, and any light on it. Directions are found at the
picture's own resolution and then averaged over grid pixels by the double angle, weighted by darkness and
coherence, so that junctions and corners drop out (docs/mathematics.md, 1).
"""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, shortened
from ..input_limits import MAX_PIXELS, MAX_SIDE
from ..instance.domain import Bools, Floats
from .colour import REDDISH, ink_of, redness
from .cover import Box, Cover, Covers, Frame, block_means

Ink = NDArray[np.float32]

FORMATS: Final = ("PNG", "JPEG", "WEBP", "TIFF", "BMP", "GIF", "PPM")
"""Formats that Pillow decodes by itself, without starting other programs."""
_ENOUGH: Final = 8  # picture pixels per grid pixel; finer pictures are reduced by whole factors
_WORKING_SIDE: Final = 2048
_DARKEST_PAPER: Final = 64.0  # of 255
_LIGHT_SIDE: Final = 256  # blocks on the longer side in which the light on the paper is found
_SHADOW: Final = 0.1  # of the longer side: darker and wider regions are shadows, not ink
_DARKEST_SHADOW: Final = 0.25  # of the paper's level: darker and wide regions are solid ink after all
_EVEN: Final = 1.05  # light that differs by less counts as even, and the picture is not changed
_MOST_INK: Final = 0.5  # of the picture; strokes leave more paper
_FAINTEST: Final = 0.08  # contrast below which a picture is empty paper
_NOISE, _FULL = 0.15, 0.85  # of the strokes' ink: below it noise of paper and compression, above it full
_WHITE: Final = 65535.0  # of greys with 16 bits
_BAND: Final = 1 << 20  # pixels of a picture that are processed together
_BLUR: Final = 1.0  # pixels, of the gradient
_SPECK: Final = 4.0  # ink in pixels of the smallest mark that is not dust
_INK: Final = 0.3  # least ink of a pixel that belongs to a stroke
_COLOUR_SHARE: Final = 0.03  # of all ink, for red and for other strokes, before the two are separated


@dataclass(frozen=True, eq=False)
class Bitmap:
    """A bitmap sketch, ready for any frame.

    ink: [h, w], 0 for paper to 1 for ink as dark as the strokes. red: [h, w] in [0, 1], the part of the ink
    that is red. pixels: uint8 [h, w, 1 or 3], the picture on white. reduction: pixels of the file per pixel
    of these arrays in each direction. width, height: in pixels of the file. notes: what was left out or
    changed while reading, one line each.
    """

    ink: Ink
    red: Ink
    pixels: NDArray[np.uint8]
    reduction: int
    width: int
    height: int
    notes: tuple[str, ...] = ()

    @property
    def page(self) -> Box:
        """x, y, width and height of the picture."""
        return 0.0, 0.0, self.width, self.height

    @cached_property
    def box(self) -> Box:
        """Left, top, right, bottom of the ink in pixels of the file."""
        rows, columns = (np.nonzero((self.ink > _INK).any(axis=axis))[0] for axis in (1, 0))
        edges = np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1], dtype=float)
        left, top, right, bottom = (self.reduction * edges).tolist()
        return left, top, right, bottom

    @cached_property
    def stroke_width(self) -> float:
        """Typical width of a stroke in pixels of the arrays, at least 1: twice area over length of edges."""
        down, right = np.diff(self.ink, axis=0) ** 2, np.diff(self.ink, axis=1) ** 2
        # The mean over both sides of a 2 x 2 block is equal for every orientation of the picture.
        edges = float(np.sqrt((down[:, :-1] + down[:, 1:] + right[:-1] + right[1:]) / 2).sum())
        return max(1.0, 2 * float(self.ink.sum()) / edges) if edges > 0 else 1.0

    def covers(self, frame: Frame) -> Covers:
        """The covers by curvature lines and by other strokes, separated where red and others occur."""
        width = self.stroke_width * self.reduction / frame.pixel
        red = self.ink * self.red
        share = float(red.sum() / self.ink.sum())
        if _COLOUR_SHARE < share < 1 - _COLOUR_SHARE:
            black = self.ink * (1 - self.red)
            return Covers(
                self._cover_by_ink(red, frame, width), self._cover_by_ink(black, frame, width), width
            )
        nothing = Cover(np.zeros(frame.shape), np.zeros((*frame.shape, 2)))
        return Covers(self._cover_by_ink(self.ink, frame, width), nothing, width)

    def _cover_by_ink(self, ink: Ink, frame: Frame, width: float) -> Cover:
        rows, columns = (edges / self.reduction for edges in frame.edges)
        tangent = stroke_directions(ink, self.stroke_width)
        dark = block_means(ink, rows, columns)
        direction = (
            block_means(ink[..., None] * tangent, rows, columns) / np.where(dark > 0, dark, 1)[..., None]
        )
        # A stroke straight across a grid pixel darkens a part width / pixel of it.
        return Cover(dark / min(1.0, width), direction)


def stroke_directions(ink: Ink, width: float) -> Ink:
    """Double-angle vectors [h, w, 2] (y up) of strokes, as long as the tensor is coherent (0..1)."""
    from scipy import ndimage

    # Derivatives of a Gaussian favour no direction, unlike differences of neighbours.
    down, right = (
        ndimage.gaussian_filter(ink, _BLUR, order=order, mode="constant") for order in ((1, 0), (0, 1))
    )
    # The double angle of the tangent is opposite to that of the gradient; 2 gx gy changes its sign once more
    # as y turns up.
    tensor = np.stack([down**2 - right**2, 2 * right * down, right**2 + down**2])
    scale = max(1.5, 0.6 * width)
    cosine, sine, energy = (
        ndimage.gaussian_filter(part, scale, mode="constant", truncate=3.0) for part in tensor
    )
    return np.asarray(np.stack([cosine, sine], axis=-1) / np.maximum(energy, 1e-8)[..., None])


def read_bitmap(data: bytes, size: int) -> Bitmap:
    """The ink of a bitmap, fine enough for a grid of `size` pixels. Raises InputError for other content."""
    image = _open_image(data)
    width, height = image.size
    reduction = max(1, max(width, height) // max(_WORKING_SIDE, _ENOUGH * size))
    pixels = np.concatenate([_reduce(band, reduction) for band in _split_into_bands(image, reduction)])
    del image  # the file's pixels take the most memory at any time
    rgb = _relative_to_paper(pixels)
    raw = ink_of(rgb)
    strongest = float(raw.max())
    if strongest < _FAINTEST:
        raise InputError("shows no stroke: it is paper all over; expected dark strokes on lighter paper")
    level = float(np.median(raw[raw > strongest / 2]))
    ink = np.clip((raw / level - _NOISE) / (_FULL - _NOISE), 0, 1).astype(np.float32)
    ink[_find_specks(ink)] = 0
    if not (ink > _INK).any():
        raise InputError("shows no stroke but a few specks; expected dark strokes on lighter paper")
    covered = float((ink > 0.5).mean())
    if covered >= _MOST_INK:
        raise InputError(
            f"shows ink on {covered:.0%} of the paper, and strokes would leave most of it bare; "
            "crop it to the drawing, take the picture in brighter light, or thin the strokes"
        )
    return Bitmap(ink, _find_red(rgb, raw), pixels, reduction, width, height)


def read_white_pixels(data: bytes) -> Bools:
    """The white part of a mask picture, bool [h, w]. Raises InputError like read_bitmap."""
    image = _open_image(data)
    bands = [pixels.mean(axis=-1, dtype=np.float32) >= 127.5 for pixels in _split_into_bands(image, 1)]
    return np.concatenate(bands)


def _open_image(data: bytes) -> Any:
    """The decoded picture, upright. Its size is checked before its pixels."""
    from PIL import Image, ImageOps, UnidentifiedImageError

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            image = Image.open(io.BytesIO(data), formats=FORMATS)
            _check_size(*image.size)
            image.load()
            ImageOps.exif_transpose(image, in_place=True)
        except InputError:
            raise
        except Image.DecompressionBombError as error:
            raise InputError("declares absurdly many pixels; scale it down") from error
        except Exception as error:  # damaged pictures make decoders raise nearly anything
            unknown = isinstance(error, UnidentifiedImageError)
            reason = "unknown format" if unknown else shortened(error) or type(error).__name__
            raise InputError(f"is not a whole picture ({reason}); expected {', '.join(FORMATS)}") from error
    return image


def _check_size(width: int, height: int) -> None:
    if max(width, height) > MAX_SIDE or width * height > MAX_PIXELS:
        raise InputError(
            f"declares {width} x {height} pixels; at most {MAX_SIDE} a side and "
            f"{MAX_PIXELS // 10**6} million in all are read, scale it down"
        )


def _split_into_bands(image: Any, multiple: int) -> Iterator[NDArray[np.uint8]]:
    """The picture on white, uint8 [h, w, 1 or 3], from top to bottom in bands of whole multiples of rows."""
    # Colours of all pixels at once would take many times the memory of the picture.
    width, height = image.size
    rows = max(1, _BAND // (width * multiple)) * multiple
    bands = [(0, top, width, min(top + rows, height)) for top in range(0, height, rows)]
    if image.mode == "F":
        raise InputError("holds greys in floating point; save it with 8 or 16 bits")
    white = _WHITE if image.mode.startswith("I") else None
    return (_as_eight_bit(image.crop(band), white) for band in bands)


def _as_eight_bit(image: Any, white: float | None) -> NDArray[np.uint8]:
    """The picture on white as uint8 [h, w, 1 or 3]; greys up to `white` are scaled down."""
    from PIL import Image

    if white is not None:
        values = np.asarray(image).astype(np.float32)
        scaled: NDArray[np.uint8] = (255 * np.clip(values / white, 0, 1)).astype(np.uint8)
        return scaled[..., None]
    if "A" in image.getbands() or "transparency" in image.info:
        image = image.convert("RGBA")
        image = Image.alpha_composite(Image.new("RGBA", image.size, "white"), image)
    image = image.convert("L" if image.mode in ("1", "L") else "RGB")
    pixels: NDArray[np.uint8] = np.asarray(image)
    return pixels[..., None] if pixels.ndim == 2 else pixels


def _reduce(pixels: NDArray[np.uint8], factor: int) -> NDArray[np.uint8]:
    """The means over blocks of that many rows and columns."""
    from PIL import Image

    if factor == 1:
        return pixels
    channels = pixels.shape[-1]
    small = Image.fromarray(pixels if channels == 3 else pixels[..., 0]).reduce(factor)
    return np.asarray(small).reshape(small.height, small.width, channels)


def _relative_to_paper(pixels: NDArray[np.uint8]) -> Floats:
    """Colours [h, w, 1 or 3] relative to the paper, in [0, 1]."""
    # At least a quarter of a drawing is bare paper, so the upper quartile is a level of the paper.
    paper = np.percentile(pixels.reshape(-1, pixels.shape[-1]), 75, axis=0).astype(np.float32)
    if paper.max() < _DARKEST_PAPER:
        raise InputError("is dark all over; expected dark strokes on lighter paper, invert the picture")
    colours: Floats = pixels.astype(np.float32)
    colours /= np.maximum(paper, 1)
    light = _estimate_light(colours)
    if max(float(light.max()), 1 / float(light.min())) > _EVEN:
        colours /= light[..., None]
    return np.minimum(colours, 1, out=colours)


def _estimate_light(colours: Floats) -> Ink:
    """The light on the paper [h, w], 1 where it equals the light of the whole picture."""
    from scipy import ndimage

    # A grey closing lets lighter surroundings cover darker regions narrower than _SHADOW, in linear time. So
    # strokes vanish, and shadows stay, whether gradual or sharp. Means over blocks remove noise first.
    height, width = colours.shape[:2]
    block = max(1, max(height, width) // _LIGHT_SIDE)
    rows, columns = (np.append(np.arange(0, side, block), side) for side in (height, width))
    coarse = block_means(colours.mean(axis=-1), rows, columns)
    closed = ndimage.grey_closing(coarse, size=int(_SHADOW * max(coarse.shape)) | 1, mode="nearest")
    smooth = ndimage.gaussian_filter(np.maximum(closed, _DARKEST_SHADOW), 1.0, mode="nearest")
    places = [
        np.interp(np.arange(side) + 0.5, (edges[:-1] + edges[1:]) / 2, np.arange(len(edges) - 1.0))
        for side, edges in ((height, rows), (width, columns))
    ]
    return _interpolate_rows(_interpolate_rows(smooth.astype(np.float32), places[0]).T, places[1]).T


def _interpolate_rows(rows: Ink, place: Floats) -> Ink:
    """Rows at fractional places, interpolated linearly between the rows of an array."""
    below = np.minimum(place.astype(np.intp), max(len(rows) - 2, 0))
    above = np.minimum(below + 1, len(rows) - 1)
    part = (place - below).astype(np.float32)[:, None]
    return np.asarray(rows[below] * (1 - part) + rows[above] * part)


def _find_specks(ink: Ink) -> Bools:
    """The marks that hold less ink than a small dot: dust and noise."""
    from scipy import ndimage

    label, count = ndimage.label(ink > 0, structure=np.ones((3, 3)))
    weight = np.bincount(label.ravel(), ink.ravel(), count + 1)
    return np.asarray(weight[label] < _SPECK)


def _find_red(rgb: Floats, ink: Floats) -> Ink:
    """1 where the blurred ink is red, else 0: colour is coarser than brightness in JPEG."""
    from scipy import ndimage

    if rgb.shape[-1] == 1:
        return np.zeros(ink.shape, dtype=np.float32)
    red, all_ink = (ndimage.gaussian_filter(part, 1.5) for part in (redness(rgb), ink))
    return np.asarray((red > REDDISH * all_ink).astype(np.float32))
