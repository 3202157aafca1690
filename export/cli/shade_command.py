"""The command `shade`: a surface for a field, as pictures, heights and a mesh."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ...models.errors import InputError, shortened
from ...models.processes.deadline import Progress
from . import options
from .inputs import SAVED, find_drawing, read_field_or_instance
from .output import show_progress, show_surface
from .sketch_options import SketchOptions

if TYPE_CHECKING:
    from ...models.field.field import CrossField
    from ...models.instance.instance import Instance
    from ...models.surface.hints import Hint
    from ..shading.colours import Light

FIELD: Final = "field.npz"
"""File of the field that was computed from a sketch, which can be shaded again with other hints."""


def shade_command(
    source: options.FieldOrInput,
    output: options.Folder,
    *,
    flip: options.Flip = False,
    hint: options.Hints = None,
    light: options.Lamp = None,
    side: options.PictureSide = None,
    on: options.On = None,
    underlay: options.Underlay = None,
    force: options.Force = False,
    sketch: SketchOptions,
    printing: options.PrintOptions,
) -> None:
    """Compute the surface whose curvature lines are the crosses: normals, shaded pictures, heights, mesh.

    All pictures have the page of the drawing, so they lie on it as layers, transparent outside the mask. The
    normal map follows OpenGL: red to the right, green up. Without a page, pictures show the grid.

    Crosses do not determine which parts are bumps and which are hollows (--flip), nor the depth of parts that
    bend in one direction only (--hint). What is drawn, what is guessed, where crosses do not fit, and doubts
    are printed and written to surface.json. A surface without doubts can be wrong too, most of all far from
    strokes.
    """
    from ...models.field.file import write_field
    from ...models.storage import replace_results
    from ...models.surface.lift import surface
    from ..pictures.underlay import read_underlay
    from ..surfaces.files import FILES, choose_view, surface_document, write_surface

    hints, lamp = parse_hints(hint), parse_light(light)
    reads = [path for path in (source, on, underlay, sketch.mask) if path is not None]
    with show_progress(quiet=printing.quiet) as show:
        show("reading")
        saved = _read_saved_field(source, on)
        if saved is not None and sketch != SketchOptions():
            raise InputError(
                "is a field, which has its own grid and strokes; omit the options that read a sketch",
                file=source,
            )
        instance = sketch.read(source, "shade", quiet=printing.quiet) if saved is None else saved.instance
        names = [FIELD, *FILES] if saved is None else FILES
        with replace_results(output, names, reads=reads, force=force) as new:
            field = saved or _compute_field(instance, show)
            if saved is None:
                underlay = underlay or find_drawing(source)
                write_field(field, new.path / FIELD)
            drawing = None if underlay is None else read_underlay(underlay, on=field.instance)
            view = choose_view(field.instance, drawing, side)
            solid = surface(field, hints, flip=flip, progress=show)
            about = _describe_choices("bend" if saved is None else None, hints, lamp, flip=flip)
            show("drawing and writing")
            write_surface(solid, new.path, drawing=drawing, light=lamp, side=side, about=about)
    document = surface_document(solid, view, about)
    printing.show(document, lambda: show_surface(solid, document, output))


def _read_saved_field(source: str, on: Path | None) -> CrossField | None:
    """Field in a file; None for a sketch, sample or instance. Raises InputError."""
    from ...models.field.field import CrossField

    path = Path(source)
    if on is None and not (path.is_file() and path.suffix.lower() in SAVED):
        return None
    content = read_field_or_instance(path, on, "shade")
    return content if isinstance(content, CrossField) else None


def _compute_field(instance: Instance, show: Progress) -> CrossField:
    """The field of the method bend."""
    from ...models.smooth.bend import bend_field
    from ...models.smooth.polyvector import HOLDS, polyvector_field

    show("bend field")
    return bend_field(polyvector_field(instance, hold=max(HOLDS)))


def parse_hints(texts: list[str] | None) -> tuple[Hint, ...]:
    """Hints from texts in degrees. Raises InputError for a malformed text."""
    from ...models.surface.hints import Hint

    hints = []
    for text in texts or ():
        row, column, slant, tilt = _parse_numbers(text, "--hint ROW,COLUMN,SLANT,TILT", "12,30,45,90")
        if row % 1 or column % 1:
            raise InputError(
                f"--hint {shortened(text)}: row and column must be whole numbers, as in 12,30,45,90"
            )
        hints.append(Hint(int(row), int(column), math.radians(slant), math.radians(tilt)))
    return tuple(hints)


def parse_light(text: str | None) -> Light:
    """Light from a text in degrees, or from the upper left. Raises InputError for a malformed text."""
    from ..shading.colours import UPPER_LEFT, Light

    if text is None:
        return UPPER_LEFT
    azimuth, elevation = _parse_numbers(text, "--light AZIMUTH,ELEVATION", "135,45")
    return Light(math.radians(azimuth), math.radians(elevation))


def _parse_numbers(text: str, option: str, example: str) -> list[float]:
    """Finite numbers separated by commas, as many as in the example. Raises InputError."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != len(example.split(",")) or not all(map(math.isfinite, numbers)):
        raise InputError(f"{option}: {shortened(text)!r} is malformed; give numbers as in {example}")
    return numbers


def _describe_choices(
    method: str | None, hints: tuple[Hint, ...], lamp: Light, *, flip: bool
) -> dict[str, Any]:
    """Method, hints and light of a surface, for its report; angles in degrees."""
    return {
        "method": method,
        "flipped": flip,
        "hints": [
            {"row": hint.row, "column": hint.column}
            | {name: round(math.degrees(getattr(hint, name)), 4) for name in ("slant", "tilt")}
            for hint in hints
        ],
        "light": {name: round(math.degrees(getattr(lamp, name)), 4) for name in ("azimuth", "elevation")},
    }
