"""The command `shade`: a surface for a field, as pictures, heights and a mesh."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from ...models.errors import InputError, shortened
from . import options
from .inputs import find_drawing, read_field_or_instance, read_source
from .output import print_result, show_progress, show_surface

if TYPE_CHECKING:
    from ...models.field.field import CrossField
    from ...models.surface.hints import Hint

_Value = TypeVar("_Value")


def shade_command(
    source: options.FieldOrInput,
    output: options.Folder,
    *,
    size: options.Size = None,
    flip: options.Flip = False,
    concave: options.Concave = None,
    hint: options.Hints = None,
    side: options.PictureSide = None,
    underlay: options.Underlay = None,
    force: options.Force = False,
    as_json: options.Json = False,
) -> None:
    """Compute the surface whose curvature lines are the crosses: normals, shaded pictures, heights, mesh.

    All pictures have the page of the drawing, so they lie on it as layers, transparent outside the mask. The
    normal map follows OpenGL: red to the right, green up. Without a page, pictures show the grid.

    Crosses do not determine which parts are bumps and which are hollows (--flip, --concave), nor the depth
    of parts that bend in one direction only (--hint). What is drawn, what is guessed, where crosses do not
    fit, and what is undetermined are printed and written to surface.json. A surface can be wrong without a
    warning, most of all far from strokes.
    """
    from ...models.surface.lift import surface
    from ...models.written_files import check_targets
    from ..pictures.underlay import read_underlay
    from ..surfaces.files import FILES, REPORT, choose_view, write_surface

    hints, bowls = parse_hints(hint), [_parse_place(text) for text in concave or ()]
    underlay = underlay or find_drawing(source)
    check_targets(output, FILES, reads=[path for path in (source, underlay) if path is not None], force=force)
    with show_progress() as show:
        show("reading, and the field of bend unless it is given")
        field = _read_or_compute_field(source, size)
        drawing = None if underlay is None else read_underlay(underlay, on=field.instance)
        choose_view(field.instance, drawing, side)  # checks the side before the work
        solid = surface(field, hints, flip=flip, concave=bowls, progress=show)
        show("drawing and writing")
        about = {"flipped": flip, "concave": bowls, "hints": [given.in_degrees for given in hints]}
        write_surface(solid, output, drawing=drawing, side=side, about=about, force=force)
    document = json.loads((output / REPORT).read_text("utf-8"))
    print_result(document, lambda: show_surface(solid, document, output), as_json=as_json)


def _read_or_compute_field(source: str, size: int | None) -> CrossField:
    """The field in a file, or that of the method bend. Raises InputError."""
    from ...models.field.field import CrossField
    from ...models.smooth.bend import surface_field

    if size is None and Path(source).is_file() and source.lower().endswith((".npz", ".json")):
        content = read_field_or_instance(Path(source), None)
    else:
        content = read_source(source, sketch={"size": size})
    if isinstance(content, CrossField):
        return content
    return surface_field(content)


def parse_hints(texts: list[str] | None) -> list[Hint]:
    """Hints from texts in degrees. Raises InputError for a malformed text."""
    from ...models.surface.hints import Hint

    def parse(row: str, column: str, slant: str, tilt: str) -> Hint:
        return Hint(int(row), int(column), math.radians(float(slant)), math.radians(float(tilt)))

    return [_parse(text, parse, "--hint", "ROW,COLUMN,SLANT,TILT as in 12,30,45,90") for text in texts or ()]


def _parse_place(text: str) -> tuple[float, float]:
    """A place from its text. Raises InputError for a malformed text."""
    return _parse(text, lambda x, y: (float(x), float(y)), "--concave", "X,Y as in 120,80.5")


def _parse(text: str, parse: Callable[..., _Value], option: str, form: str) -> _Value:
    """The value of the numbers in a text. Raises InputError for a malformed text."""
    try:
        return parse(*text.split(","))
    except (TypeError, ValueError) as error:
        raise InputError(f"{option} {shortened(text)!r} is malformed; give {form}") from error
