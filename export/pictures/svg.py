"""Sheets of marks as SVG files, whose layers Inkscape shows as layers, and as bitmaps.

The same input gives the same bytes.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final, cast

import numpy as np
from numpy.typing import NDArray

from ...models.instance.domain import Floats
from .marks import Area, Dots, ImageMark, Lines, Mark, Polygons, Sheet, TextMark, straight_line
from .underlay import size_in_units

if TYPE_CHECKING:
    from PIL import ImageFont

_FINENESS: Final = 20_000.0  # steps of coordinates along the longer side of the page, at least
_PARTS: Final = 16.0  # the same for each pixel of a picture
_PLAIN: Final = str.maketrans("×−", "x-")  # signs that the font of bitmaps lacks
_SPACES: Final = (
    'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
    'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
)


def sheet_svg(sheet: Sheet) -> bytes:
    """The file of a sheet, its layers as layers of a drawing program."""
    return _svg_document(
        _SPACES, sheet, sheet.size or size_in_units(sheet.page), [*_svg_body(sheet, _FINENESS)]
    )


def render_sheet(sheet: Sheet, width: int, height: int) -> NDArray[np.uint8]:
    """Red, green, blue and opacity (height, width, 4) of the layers on a page without paper."""
    import resvg_py
    from PIL import Image, ImageDraw

    body = [*_svg_body(sheet, _PARTS * max(width, height))]
    text = _svg_document(f'{_SPACES} preserveAspectRatio="none"', sheet, (str(width), str(height)), body)
    data = resvg_py.svg_to_bytes(svg_string=text.decode(), skip_system_fonts=True)
    image = Image.open(io.BytesIO(bytes(data))).convert("RGBA")
    pen, scale = ImageDraw.Draw(image), width / sheet.page[2]
    for words in (mark for layer in sheet.layers for mark in layer.parts if isinstance(mark, TextMark)):
        (left, top, *_), (x, y) = sheet.page, words.place
        font, anchor = load_font(scale * words.size), f"{words.anchor[0].replace('s', 'l')}s"
        pen.text(
            (scale * (x - left), scale * (y - top)), words.text.translate(_PLAIN), words.colour, font, anchor
        )
    return np.asarray(image)


def load_font(size: float) -> ImageFont.FreeTypeFont:
    """The font of words in bitmaps, which Pillow contains: the same on every machine."""
    from PIL import ImageFont

    return cast("ImageFont.FreeTypeFont", ImageFont.load_default(size))


def encode_png(picture: NDArray[np.uint8]) -> bytes:
    """A picture (h, w, 3 or 4) of red, green, blue and optional opacity as PNG."""
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, "PNG")
    return stream.getvalue()


def _svg_document(spaces: str, sheet: Sheet, size: tuple[str, str], body: list[str]) -> bytes:
    box = " ".join(f"{value:.12g}" for value in sheet.page)
    opening = f'<svg {spaces} viewBox="{box}" width="{size[0]}" height="{size[1]}">'
    return "\n".join(['<?xml version="1.0" encoding="UTF-8"?>', opening, *body, "</svg>", ""]).encode()


def _svg_body(sheet: Sheet, fineness: float) -> Iterator[str]:
    step = 10.0 ** -np.ceil(np.log10(fineness / max(sheet.page[2:])))
    for layer in sheet.layers:
        parts = (line for part in layer.parts for line in _mark_elements(part, step))
        if layer.name:
            style = (
                f'style="display:{"inline" if layer.shown else "none"}"{_opacity_attribute(layer.opacity)}'
            )
            yield f'<g id="{layer.name}" inkscape:groupmode="layer" inkscape:label="{layer.name}" {style}>'
        yield from parts
        if layer.name:
            yield "</g>"


def _mark_elements(part: Mark, step: float) -> Iterator[str]:
    match part:
        case Lines():
            yield from _line_elements(part, step)
        case Dots():
            yield from _dot_elements(part, step)
        case Area():
            yield from _area_element(part, step)
        case Polygons():
            yield f'<g stroke-width="{part.rim:.4g}" stroke-linejoin="round">'
            for shape, (inside, rim) in zip(part.shapes, part.colours, strict=True):
                yield f'<path fill="{inside}" stroke="{rim}" d="{_path_data(straight_line(shape), step)}z"/>'
            yield "</g>"
        case ImageMark():
            yield _image_element(part)
        case TextMark():
            (x, y), anchor = part.place, part.anchor
            yield (
                f'<text x="{x:.6g}" y="{y:.6g}" font-family="sans-serif" font-size="{part.size:.4g}" '
                f'text-anchor="{anchor}" fill="{part.colour}">{part.text}</text>'
            )


def _image_element(part: ImageMark) -> str:
    """The image as PNG inside the file."""
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(part.colours).save(stream, "PNG", optimize=True)
    x, y, width, height = part.box
    return (
        f'<image x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" preserveAspectRatio="none" '
        f'xlink:href="data:image/png;base64,{base64.b64encode(stream.getvalue()).decode()}"/>'
    )


def _line_elements(part: Lines, step: float) -> Iterator[str]:
    pen = (
        f'fill="none" stroke="{part.colour}" stroke-width="{part.width:.4g}" stroke-linecap="round" '
        f'stroke-linejoin="round"{_opacity_attribute(part.opacity)}'
    )
    data = [_path_data(line, step) for line in part.lines]
    if part.single:
        yield f"<g {pen}>"
        yield from (f'<path d="{path}"/>' for path in data)
        yield "</g>"
    elif data:
        yield f'<path {pen} d="{"".join(data)}"/>'


def _path_data(line: Floats, step: float) -> str:
    """Path data of pieces that are end to end: rounded first, then written as differences."""
    steps = np.round(line / step) + 0.0
    moves = (steps[:, 1:] - steps[:, :1]).reshape(-1) * step
    letter = "l" if line.shape[1] == 2 else "c"
    return f"M{_format_numbers(steps[0, 0] * step)}{letter}{_format_numbers(moves)}"


def _format_numbers(values: Floats) -> str:
    return " ".join(f"{value:.12g}" for value in values + 0.0).replace(" -", "-")


def _dot_elements(part: Dots, step: float) -> Iterator[str]:
    yield f'<g fill="{part.colour}" stroke="#ffffff" stroke-width="{part.rim:.4g}">'
    rounded = np.round(part.centres / step) * step + 0.0
    for (x, y), radius in zip(rounded.tolist(), part.radii.tolist(), strict=True):
        yield f'<circle cx="{x:.12g}" cy="{y:.12g}" r="{radius:.4g}"/>'
    yield "</g>"


def _area_element(part: Area, step: float) -> Iterator[str]:
    """One path: sides are rounded before they are subtracted, so that neighbours share theirs."""
    sides = np.round(part.boxes / step) + 0.0
    boxes = step * np.concatenate([sides[:, :2], sides[:, 2:] - sides[:, :2]], axis=1)
    data = "".join(
        f"M{x:.12g} {y:.12g}h{wide:.12g}v{high:.12g}h-{wide:.12g}z" for x, y, wide, high in boxes.tolist()
    )
    if data:
        yield f'<path fill="{part.colour}"{_opacity_attribute(part.opacity)} d="{data}"/>'


def _opacity_attribute(opacity: float) -> str:
    return f' opacity="{opacity:.2g}"' if opacity < 1 else ""
