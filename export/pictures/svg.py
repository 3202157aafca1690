"""The writer of SVG files: sheets of marks, the same bytes for the same input.

Layers are groups that Inkscape shows as layers. Pictures for a browser follow the reader's dark mode.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...models.instance.domain import Floats
from .marks import Area, Dots, Layer, Lines, Mark, Sheet
from .underlay import Underlay, ink_colours, size_in_units

_FINENESS: Final = 20_000.0  # steps of coordinates along the longer side of the page, at least
_COARSE: Final = 3_000.0  # the same for a browser
_PARTS: Final = 16.0  # the same for each pixel of a picture
_SPACES: Final = (
    'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
    'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
)


def sheet_svg(sheet: Sheet) -> bytes:
    """The file of a sheet, its layers as layers of a drawing program."""
    size = size_in_units(sheet.page) if sheet.drawing is None else sheet.drawing.size
    return _svg_document(_SPACES, sheet, size, [*_svg_body(sheet, _FINENESS)])


def web_sheet_svg(sheet: Sheet, dark: dict[str, str]) -> bytes:
    """The file of a sheet for a browser. dark: colours of dark mode by those that they replace."""
    body = list(_svg_body(sheet, _COARSE))
    text = "".join(body)
    rules = "".join(
        f'[{attribute}="{light}"]{{{attribute}:{night}}}'
        for light, night in dark.items()
        for attribute in ("fill", "stroke")
        if f'{attribute}="{light}"' in text
    )
    style = f"<style>@media (prefers-color-scheme:dark){{{rules}}}</style>"
    return _svg_document(
        'xmlns="http://www.w3.org/2000/svg"', sheet, size_in_units(sheet.page), [style, *body]
    )


def render_sheet(sheet: Sheet, width: int, height: int) -> NDArray[np.uint8]:
    """Red, green, blue and opacity (height, width, 4) of the layers on a page without paper."""
    import resvg_py
    from PIL import Image

    body = [*_svg_body(sheet, _PARTS * max(width, height))]
    text = _svg_document(f'{_SPACES} preserveAspectRatio="none"', sheet, (str(width), str(height)), body)
    picture = resvg_py.svg_to_bytes(svg_string=text.decode(), skip_system_fonts=True)
    return np.asarray(Image.open(io.BytesIO(bytes(picture))).convert("RGBA"))


def _svg_document(spaces: str, sheet: Sheet, size: tuple[str, str], body: list[str]) -> bytes:
    box = " ".join(f"{value:.12g}" for value in sheet.page)
    opening = f'<svg {spaces} viewBox="{box}" width="{size[0]}" height="{size[1]}">'
    return "\n".join(['<?xml version="1.0" encoding="UTF-8"?>', opening, *body, "</svg>", ""]).encode()


def _svg_body(sheet: Sheet, fineness: float) -> Iterator[str]:
    step = 10.0 ** -np.ceil(np.log10(fineness / max(sheet.page[2:])))
    for layer in sheet.layers:
        parts = [line for part in layer.parts for line in _mark_elements(part, step)]
        if layer.name:
            yield from _layer_group(layer, sheet.drawing if layer.name == "drawing" else None, parts)
        else:
            yield from parts


def _layer_group(layer: Layer, drawing: Underlay | None, parts: list[str]) -> Iterator[str]:
    yield (
        f'<g id="{layer.name}" inkscape:groupmode="layer" inkscape:label="{layer.name}" '
        f'style="display:{"inline" if layer.shown else "none"}"{_opacity_attribute(layer.opacity)}>'
    )
    if drawing is not None and drawing.ink is not None:
        yield _ink_image(drawing.ink, drawing.scale)
    yield from parts
    yield "</g>"


def _mark_elements(part: Mark, step: float) -> Iterator[str]:
    if isinstance(part, Lines):
        return _line_elements(part, step)
    if isinstance(part, Dots):
        return _dot_elements(part, step)
    return _area_element(part, step)


def _ink_image(ink: NDArray[np.uint8], scale: float) -> str:
    """The ink of a bitmap on nothing, as PNG with a palette inside the file."""
    from PIL import Image

    colours, image, stream = ink_colours(), Image.fromarray(ink), io.BytesIO()
    image.putpalette(colours[:, :3].tobytes())
    image.save(stream, "PNG", transparency=colours[:, 3].tobytes(), optimize=True)
    high, wide = (scale * side for side in ink.shape)
    return (
        f'<image x="0" y="0" width="{wide:g}" height="{high:g}" preserveAspectRatio="none" '
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
