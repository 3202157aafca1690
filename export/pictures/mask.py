"""The mask of an instance as a picture of the size that `--mask` takes, to be painted and given back."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...models.errors import InputError
from ...models.input_limits import MAX_PIXELS, MAX_SIDE
from ...models.instance.domain import Bools, Floats
from ...models.instance.instance import Instance
from ...models.storage import replacing, require_suffix

Page = tuple[float, float, float, float]


def write_mask(instance: Instance, path: str | Path, *, force: bool = False) -> Path:
    """Write the mask of an instance as a PNG: white where the field is solved for, black elsewhere.

    Parameters
    ----------
    instance
        An instance that was read from a drawing.
    path
        File to write, with the suffix .png. It has the size of the bitmap or page that was read: what
        `read_sketch` takes as `mask`.
    force
        Whether to replace a file that crossfield has not written or that has changed since, such as a painted
        mask.

    Returns
    -------
    Path
        The path.

    Raises
    ------
    InputError
        For an instance from another source, or from a page that is too small or too large for a picture; and
        for another suffix.
    OutputError
        If the file cannot be written, or if another one is in the way.

    """
    from PIL import Image

    path, page = Path(path), _page(instance)
    require_suffix(path, ".png")
    if page is None:
        raise InputError(
            f"{instance.name} has no page that a mask could cover; give a sketch with a viewBox or a width "
            f"and height, of 1 to {MAX_SIDE} units per side and {MAX_PIXELS // 10**6} million in all",
            file=path,
        )
    white = mask_on_page(instance, page)
    image = Image.fromarray(np.where(white, np.uint8(255), np.uint8(0)))
    with replacing(path, force=force) as stream:
        image.save(stream, "PNG")
    return path


def has_mask(instance: Instance) -> bool:
    """True for an instance whose mask can be written as a picture."""
    return _page(instance) is not None


def mask_on_page(instance: Instance, page: Page) -> Bools:
    """Which pixels, of one unit a side, of the page have their middle in a pixel that is solved for."""
    column, row = (_cells(*axis) for axis in zip(page[:2], page[2:], instance.origin, strict=True))
    padded = np.pad(instance.mask, 1)
    return padded[
        np.ix_(
            *(
                np.clip(np.floor(cell / instance.pixel_size) + 1, 0, side - 1).astype(np.int64)
                for cell, side in zip((row, column), padded.shape, strict=True)
            )
        )
    ]


def _cells(start: float, side: float, origin: float) -> Floats:
    """The distances of the middles of page pixels from the origin of the grid."""
    count = round(side)
    return start + (np.arange(count) + 0.5) * side / count - origin


def _page(instance: Instance) -> Page | None:
    """The page of the drawing, if a mask of it has pixels and not too many."""
    page = None if instance.reading is None else instance.reading.page
    if page is None:
        return None
    width, height = page[2:]
    fits = min(width, height) > 0.5 and max(width, height) <= MAX_SIDE and width * height <= MAX_PIXELS
    return page if fits else None
