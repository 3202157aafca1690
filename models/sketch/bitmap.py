"""Reader of bitmaps: ink on paper, and stroke directions by a structure tensor.

The paper may have any colour and any light on it, and may lie on a table. Directions are found at the
picture's own resolution and then averaged over grid pixels by the double angle, weighted by darkness and
coherence, so that junctions and corners drop out (docs/mathematics.md, 1).
"""

from __future__ import annotations

import io
import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, shortened
from ..input_limits import MAX_PIXELS, MAX_SIDE
from ..instance.domain import Bools, Floats
from .colour import PAPER, REDDISH, ink_of, redness
from .cover import Box, Cover, Covers, Frame, block_means
from .paper import Ink, relative_to_paper
from .sheet import SEARCHED_SIDE, PhotographedSheet, find_sheet

FORMATS: Final = ("PNG", "JPEG", "WEBP", "TIFF", "BMP", "GIF", "PPM")
"""Formats that Pillow decodes by itself, without starting other programs."""
_PAGED: Final = ("TIFF", "GIF", "WEBP", "PNG")
"""Formats whose files may have several pages that are drawings, unlike previews of a JPEG."""
_ENOUGH: Final = 8  # picture pixels per grid pixel; finer pictures are reduced by whole factors
_WORKING_SIDE: Final = 2048
_MOST_INK: Final = 0.5  # of the picture; strokes leave more paper
_FAINTEST: Final = 0.08  # contrast below which a picture is empty paper
_NOISE, _FULL = 0.15, 0.85  # of the strokes' ink: below it noise of paper and compression, above it full
_WHITE: Final = 65535.0  # of greys with 16 bits
_BLUR: Final = 1.0  # pixels, of the gradient
_CORE: Final = 0.8  # least ink in the core of a stroke
_SPECK: Final = 4.0  # ink in pixels of the smallest mark that is not dust
_INK: Final = 0.3  # least ink of a pixel that belongs to a stroke
_FAINT: Final = 0.85  # of the ink of other strokes: fainter red ones count as much as they do
_RICH: Final = 0.6  # redness of the reddest strokes of a picture whose colours are whole
_PALE: Final = 0.5  # of the redness of the reddest strokes: in other pictures, paler ones are red, too
_PALEST: Final = 0.15  # part of the ink that must be red even if no stroke is redder
_THIN: Final = 0.7  # of the width of all strokes: a pen that is thinner has a width of its own
_RIM: Final = 3  # pixels beside strokes of another colour that say nothing of colours
_SHORTEST: Final = 0.03  # of the longer side of the drawing: length of what is a stroke and no speck
_LEAST_LENGTH: Final = 0.1  # of that side: of red strokes, and of others, that are meant to be told apart


@dataclass(frozen=True, eq=False)
class Bitmap:
    """A bitmap sketch, ready for any frame.

    ink: [h, w], 0 for paper to 1 for ink as dark as the strokes. red: [h, w] in [0, 1], the part of the ink
    that is red. pixels: uint8 [h, w, 1 or 3], the picture on white. reduction: pixels of the file per pixel
    of these arrays in each direction. width, height: in pixels of the file. sheet: the sheet in a photograph;
    all else then refers to the straightened sheet. pages: of the file, of which the first is read.
    """

    ink: Ink
    red: Ink
    pixels: NDArray[np.uint8]
    reduction: int
    width: int
    height: int
    sheet: PhotographedSheet | None = None
    pages: int = 1

    @property
    def notes(self) -> tuple[str, ...]:
        """Changes made while reading, one line each."""
        pages = (_describe_pages(self.pages),) if self.pages > 1 else ()
        return pages if self.sheet is None else (*pages, self.sheet.describe())

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
        """Typical width of a stroke in pixels of the arrays, at least 1."""
        return measure_width(self.ink)

    @cached_property
    def has_two_colours(self) -> bool:
        """Whether red strokes and other strokes are both long enough to be meant."""
        from scipy import ndimage

        left, top, right, bottom = self.box
        longer = max(right - left, bottom - top) / self.reduction
        is_red, is_ink = self.red > 0.5, self.ink > _INK
        if not _LEAST_LENGTH * longer <= (is_red & is_ink).sum():
            return False
        for colour in (is_red, ~is_red):
            # The rim of a stroke often looks as if it had another colour.
            beside = ndimage.maximum_filter(is_ink & ~colour, 2 * _RIM + 1)
            label, _ = ndimage.label(is_ink & colour & ~beside, np.ones((3, 3)))
            sides = [[part.stop - part.start for part in place] for place in ndimage.find_objects(label)]
            length = np.hypot(*np.array(sides, dtype=float).reshape(-1, 2).T) / longer
            if length[length > _SHORTEST].sum() < _LEAST_LENGTH:
                return False
        return True

    def covers(self, frame: Frame) -> Covers:
        """The covers by curvature lines and by other strokes, separated where red and others occur."""
        width = self.stroke_width * self.reduction / frame.pixel
        if self.has_two_colours:
            red, black = self.ink * self.red, self.ink * (1 - self.red)
            return Covers(self._cover_by_ink(red, frame), self._cover_by_ink(black, frame), width)
        nothing = Cover(np.zeros(frame.shape), np.zeros((*frame.shape, 2)))
        return Covers(self._cover_by_ink(self.ink, frame), nothing, width)

    def _cover_by_ink(self, ink: Ink, frame: Frame) -> Cover:
        # A thin pen beside a bold one counts by the length of its strokes.
        width = self.stroke_width if ink is self.ink else measure_width(ink)
        width = width if width < _THIN * self.stroke_width else self.stroke_width
        rows, columns = (edges / self.reduction for edges in frame.edges)
        tangent = stroke_directions(ink, width)
        dark = block_means(ink, rows, columns)
        direction = (
            block_means(ink[..., None] * tangent, rows, columns) / np.where(dark > 0, dark, 1)[..., None]
        )
        # A stroke straight across a grid pixel darkens a part width / pixel of it.
        return Cover(dark / min(1.0, width * self.reduction / frame.pixel), direction)


def measure_width(ink: Ink) -> float:
    """Typical width of strokes in pixels, at least 1: twice area over length of edges."""
    down, right = np.diff(ink, axis=0) ** 2, np.diff(ink, axis=1) ** 2
    # The mean over both sides of a 2 x 2 block is equal for every orientation of the picture.
    edges = float(np.sqrt((down[:, :-1] + down[:, 1:] + right[:-1] + right[1:]) / 2).sum())
    return max(1.0, 2 * float(ink.sum()) / edges) if edges > 0 else 1.0


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
    pages = getattr(image, "n_frames", 1) if image.format in _PAGED else 1
    width, height = image.size
    # The sheet must not depend on the size, so that all grids are on one page.
    factor = -(-max(width, height) // SEARCHED_SIDE)
    sheet = find_sheet(_reduce_image(image, factor), factor, image.size)
    reduction = max(1, max(width, height) // max(_WORKING_SIDE, _ENOUGH * size))
    pixels = _reduce_image(image, reduction)
    del image  # the file's pixels take the most memory at any time
    if sheet is not None:
        pixels = sheet.cut_out(pixels, reduction)
        width, height = sheet.size or (width, height)
    rgb = relative_to_paper(pixels)
    raw = ink_of(rgb)
    strongest = float(raw.max())
    if strongest < _FAINTEST:
        raise InputError(
            "shows no stroke: it is paper all over; expected strokes that are darker or lighter than it"
            + (f"; {_describe_pages(pages)}" if pages > 1 else "")
        )
    red = _find_red(rgb, raw)
    level = _typical_ink(raw)
    # A pen of another colour, or a thinner one, is fainter.
    red_level = _typical_ink(raw[red])
    if _FAINTEST < red_level < _FAINT * level:
        raw = np.where(red, raw * (level / red_level), raw)
    ink = np.clip((raw / level - _NOISE) / (_FULL - _NOISE), 0, 1).astype(np.float32)
    ink[_find_specks(ink, measure_width(ink))] = 0
    if not (ink > _INK).any():
        raise InputError(
            "shows no stroke but a few specks; expected strokes that are darker or lighter than the paper"
        )
    covered = float((ink > 0.5).mean())
    if covered >= _MOST_INK:
        raise InputError(
            f"shows ink on {covered:.0%} of the paper, and strokes would leave most of it bare; "
            "crop it to the drawing, take the picture in brighter light, or thin the strokes"
        )
    return Bitmap(ink, red.astype(np.float32), pixels, reduction, width, height, sheet, pages)


def _describe_pages(count: int) -> str:
    return f"the file has {count} pages, and page 1 is read; save another page as a file of its own"


def read_white_pixels(data: bytes) -> Bools:
    """The white part of a mask picture, bool [h, w]. Raises InputError like read_bitmap."""
    pixels = _reduce_image(_open_image(data), 1)
    return np.asarray(pixels.sum(axis=-1, dtype=np.uint16) >= 127.5 * pixels.shape[-1])


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


def _reduce_image(image: Any, factor: int) -> NDArray[np.uint8]:
    """The picture on white as uint8 [h, w, 1 or 3], reduced by a factor."""
    from PIL import Image

    if image.mode == "F":
        raise InputError("holds greys in floating point; save it with 8 or 16 bits")
    if image.mode.startswith("I"):
        greys = np.asarray(image).astype(np.float32)
        image = Image.fromarray((255 * np.clip(greys / _WHITE, 0, 1)).astype(np.uint8))
    has_alpha = "A" in image.getbands() or "transparency" in image.info
    mode = "RGBA" if has_alpha else "L" if image.mode in ("1", "L") else "RGB"
    image = image if image.mode == mode else image.convert(mode)
    image = image.reduce(factor) if factor > 1 else image
    if has_alpha:
        ground = "black" if _has_light_ink(np.asarray(image)) else "white"
        image = Image.alpha_composite(Image.new("RGBA", image.size, ground), image).convert("RGB")
    return np.asarray(image).reshape(*image.size[::-1], -1)


def _has_light_ink(pixels: NDArray[np.uint8]) -> bool:
    """Whether most strokes on a transparent ground, uint8 [h, w, 4], are as light as white paper."""
    ink = pixels[..., 3] / np.float32(255)
    light = np.where(pixels[..., :3].min(axis=-1) > 255 * (1 - PAPER), ink, 0)
    return bool(
        ink.mean() < _MOST_INK
        and light.sum() > ink.sum() / 2
        and measure_width(light) < _SHORTEST * max(ink.shape)
    )


def _find_specks(ink: Ink, width: float) -> Bools:
    """The marks that hold less ink than a small dot, or less than two and no core: dust and noise."""
    from scipy import ndimage

    label, count = ndimage.label(ink > 0, structure=np.ones((3, 3)))
    weight, core = (np.bincount(label.ravel(), part.ravel(), count + 1) for part in (ink, ink > _CORE))
    is_speck = (weight < _SPECK) | ((weight < 2 * width**2) & (core < width**2 / 4))
    return np.asarray(is_speck[label])


def _typical_ink(raw: Floats) -> float:
    """The ink in the middle of most strokes."""
    return float(np.median(raw[raw > raw.max() / 2])) if raw.any() else 0.0


def _find_red(rgb: Floats, ink: Floats) -> Bools:
    """Where the blurred ink is red: colour is coarser than brightness in JPEG."""
    from scipy import ndimage

    if rgb.shape[-1] == 1:
        return np.zeros(ink.shape, dtype=bool)
    amount, all_ink = (ndimage.gaussian_filter(part, 1.5) for part in (redness(rgb), ink))
    is_red = amount > REDDISH * all_ink
    share = amount / np.maximum(all_ink, _FAINTEST)
    reddest = _typical_ink(share)
    if not _PALEST < reddest < _RICH:
        return np.asarray(is_red)
    # Compression takes the colour of thin lines. Pale ones are red only if they have red's own hue, as orange
    # and brown contain some red as well.
    hue = np.abs(ndimage.gaussian_filter(rgb[..., 1] - rgb[..., 2], 3.0)) / np.maximum(all_ink, _FAINTEST)
    return np.asarray(is_red | (share - 1.5 * hue > max(_PALE * reddest, _PALEST)))
