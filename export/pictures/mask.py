"""The mask of an instance as a picture of the size that `--mask` takes, to be painted and given back."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...models.errors import InputError
from ...models.input_limits import MAX_PIXELS, MAX_SIDE
from ...models.instance.domain import Bools
from ...models.instance.instance import Instance
from ...models.sketch.cover import Box
from ...models.storage import replacing, require_suffix


def write_mask(instance: Instance, path: str | Path, *, force: bool = False) -> Path:
    """Write the mask of an instance as a PNG: white where the field is solved for, black elsewhere.

    It has the size of the bitmap or page that was read. force: whether to replace a painted mask. Raises
    InputError for an instance without such a page, and for another suffix; OutputError.
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


def mask_on_page(instance: Instance, page: Box) -> Bools:
    """Which pixels, of one unit a side, of the page have their middle in a pixel that is solved for."""
    padded, chosen = np.pad(instance.mask, 1), []
    axes = zip(page[:2], page[2:], instance.origin, padded.shape[::-1], strict=True)
    for start, side, origin, cells in axes:
        count = round(side)
        middles = start + (np.arange(count) + 0.5) * side / count - origin
        chosen.append(np.clip(np.floor(middles / instance.pixel_size) + 1, 0, cells - 1).astype(np.int64))
    return padded[np.ix_(*chosen[::-1])]


def _page(instance: Instance) -> Box | None:
    """The page of the drawing, if a mask of it has pixels and not too many."""
    page = None if instance.reading is None else instance.reading.page
    if page is None:
        return None
    width, height = page[2:]
    fits = min(width, height) > 0.5 and max(width, height) <= MAX_SIDE and width * height <= MAX_PIXELS
    return page if fits else None
