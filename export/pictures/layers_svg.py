"""Layers as an SVG file that drawing programs open layer by layer; same input, same bytes.

The page, its viewBox and all coordinates are those of the drawing. Layers are groups with the marks by which
Inkscape knows its layers; other programs show their ids. Coordinates are rounded to a small part of the page.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from html import escape
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...models.instance.grid import Floats
from .drawing import Drawing, ink_colours, size_in_units
from .layers import Dots, Layer, Lines, Sheet

_FINENESS: Final = 20_000.0  # steps of coordinates along the longer side of the page, at least
_SPACES: Final = (
    'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
    'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
)


def svg_of(sheet: Sheet, title: str | None = None) -> bytes:
    """The file of some layers."""
    step = 10.0 ** -np.ceil(np.log10(_FINENESS / max(sheet.page[2:])))
    box = " ".join(f"{value:.12g}" for value in sheet.page)
    width, height = size_in_units(sheet.page) if sheet.drawing is None else sheet.drawing.size
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg {_SPACES} viewBox="{box}" width="{width}" height="{height}">',
        *([] if title is None else [f"<title>{escape(title)}</title>"]),
    ]
    for layer in sheet.layers:
        lines += _group(layer, sheet.drawing if layer.name == "drawing" else None, step)
    return "\n".join([*lines, "</svg>", ""]).encode()


def _group(layer: Layer, drawing: Drawing | None, step: float) -> Iterator[str]:
    opacity = f' opacity="{layer.opacity:g}"' if layer.opacity < 1 else ""
    yield (
        f'<g id="{layer.name}" inkscape:groupmode="layer" inkscape:label="{layer.name}" '
        f'style="display:{"inline" if layer.shown else "none"}"{opacity}>'
    )
    if drawing is not None and drawing.ink is not None:
        yield _image(drawing.ink, drawing.scale)
    for part in layer.parts:
        yield from _lines(part, step) if isinstance(part, Lines) else _dots(part, step)
    yield "</g>"


def _image(ink: NDArray[np.uint8], scale: float) -> str:
    """The ink of a bitmap on nothing, as PNG inside the file."""
    high, wide = (scale * side for side in ink.shape)
    data = base64.b64encode(_png(ink)).decode()
    return (
        f'<image x="0" y="0" width="{wide:g}" height="{high:g}" preserveAspectRatio="none" '
        f'xlink:href="data:image/png;base64,{data}"/>'
    )


def _png(ink: NDArray[np.uint8]) -> bytes:
    """The ink of a bitmap as a PNG with a palette."""
    from PIL import Image

    colours = ink_colours()
    image = Image.fromarray(ink)
    image.putpalette(colours[:, :3].tobytes())
    stream = io.BytesIO()
    image.save(stream, "PNG", transparency=colours[:, 3].tobytes(), optimize=True)
    return stream.getvalue()


def _lines(lines: Lines, step: float) -> Iterator[str]:
    yield (
        f'<g fill="none" stroke="{lines.colour}" stroke-width="{lines.width:.4g}" stroke-linecap="round" '
        'stroke-linejoin="round">'
    )
    data = [_path(line, step) for line in lines.lines]
    for each in data if lines.single else ["".join(data)][: len(data)]:
        yield f'<path d="{each}"/>'
    yield "</g>"


def _path(line: Floats, step: float) -> str:
    """Path data of pieces that are end to end: rounded first, then told by their differences."""
    whole = np.round(line / step) + 0.0
    moves = (whole[:, 1:] - whole[:, :1]).reshape(-1) * step
    letter = "l" if line.shape[1] == 2 else "c"
    return f"M{_numbers(whole[0, 0] * step)}{letter}{_numbers(moves)}"


def _numbers(values: Floats) -> str:
    return " ".join(f"{value:.12g}" for value in values + 0.0).replace(" -", "-")


def _dots(dots: Dots, step: float) -> Iterator[str]:
    if len(dots.centres):
        yield f'<g fill="{dots.colour}" stroke="#ffffff" stroke-width="{dots.rim:.4g}">'
        rounded = np.round(dots.centres / step) * step + 0.0
        for (x, y), radius in zip(rounded.tolist(), dots.radii.tolist(), strict=True):
            yield f'<circle cx="{x:.12g}" cy="{y:.12g}" r="{radius:.4g}"/>'
        yield "</g>"
