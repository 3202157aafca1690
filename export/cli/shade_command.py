"""The command `shade`: a surface for a field, as pictures, heights and a mesh."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ...models.errors import InputError, shortened
from ...models.processes.deadline import Progress
from . import options
from .inputs import SAVED, drawing_of, field_or_instance, known
from .output import print_notice, progress, show_surface
from .sketch_options import SketchOptions

if TYPE_CHECKING:
    from ...models.field.field import CrossField
    from ...models.instance.instance import Instance
    from ...models.surface.hints import Hint
    from ..shading.colours import Light
    from ..solving.methods import Candidate

FIELD: Final = "field.npz"
"""File of the field that was computed from a sketch, which can be shaded again with other hints."""


def shade_command(
    source: options.FieldOrInput,
    output: options.Folder,
    *,
    flip: options.Flip = False,
    hint: options.Hints = None,
    light: options.Lamp = None,
    scale: options.Scale = None,
    method: options.ShadedMethod = None,
    on: options.On = None,
    underlay: options.Underlay = None,
    sketch: SketchOptions,
    time_limit: options.SecondsInAll = 60.0,
    printing: options.PrintOptions,
) -> None:
    """Compute the surface whose curvature lines are the crosses: normals, shaded pictures, heights, mesh.

    Crosses do not determine which parts are bumps and which are hollows (--flip), nor the depth of parts that
    bend in one direction only (--hint). Doubts about the surface are printed and written to surface.json.
    A surface without doubts can be wrong too: crosses between strokes are extrapolated.
    """
    from ...models.field.file import write_field
    from ...models.surface.lift import surface
    from ..surfaces.files import surface_document, write_surface

    hints, lamp = hints_of(hint), light_of(light)
    with progress(quiet=printing.quiet) as show:
        show("reading")
        field, candidate = _saved(source, on), None
        if field is None:
            instance = sketch.instance(source, quiet=printing.quiet)
            candidate = _made(instance, method, output, time_limit, show)
            field, underlay = candidate.field, underlay or drawing_of(source)
        elif sketch.given or method is not None:
            raise InputError(
                "is a field, which has its own grid, strokes and weights; omit --method and the options that"
                " read a sketch",
                file=source,
            )
        found = surface(field, hints, flip=flip, progress=show)
        about = _about(candidate, hints, lamp, flip=flip)
        show("drawing and writing")
        write_surface(found, output, drawing=underlay, light=lamp, scale=scale, about=about)
        if candidate is not None:
            write_field(field, output / FIELD)
    printing.show(surface_document(found, about), lambda: show_surface(found, output))
    if candidate is not None and candidate.interrupted:
        print_notice("interrupted; the surface belongs to the best field so far")


def _saved(source: str, on: Path | None) -> CrossField | None:
    """Field in a file; None for a sketch, sample or instance. Raises InputError."""
    from ...models.field.field import CrossField

    path = Path(source)
    if on is None and not (path.is_file() and path.suffix.lower() in SAVED):
        return None
    found = field_or_instance(path, on)
    return found if isinstance(found, CrossField) else None


def _made(instance: Instance, method: str | None, folder: Path, seconds: float, show: Progress) -> Candidate:
    """Final field of a method. Raises InputError for an unknown method."""
    from ...models.processes.limits import Limits
    from ..solving.methods import METHODS, Request
    from ..solving.run import KEPT

    (name,) = known([method or KEPT], METHODS, "method")
    *_, candidate = METHODS[name].find(Request(instance, folder / "solve", Limits(seconds), progress=show))
    return candidate


def hints_of(texts: list[str] | None) -> tuple[Hint, ...]:
    """Hints from texts in degrees. Raises InputError for a malformed text."""
    from ...models.surface.hints import Hint

    hints = []
    for text in texts or ():
        row, column, slant, tilt = _numbers(text, "--hint ROW,COLUMN,SLANT,TILT", "12,30,45,90")
        if row % 1 or column % 1:
            raise InputError(
                f"--hint {shortened(text)}: row and column must be whole numbers, as in 12,30,45,90"
            )
        hints.append(Hint(int(row), int(column), math.radians(slant), math.radians(tilt)))
    return tuple(hints)


def light_of(text: str | None) -> Light:
    """Light from a text in degrees, or from the upper left. Raises InputError for a malformed text."""
    from ..shading.colours import UPPER_LEFT, Light

    if text is None:
        return UPPER_LEFT
    azimuth, elevation = _numbers(text, "--light AZIMUTH,ELEVATION", "135,45")
    return Light(math.radians(azimuth), math.radians(elevation))


def _numbers(text: str, option: str, example: str) -> list[float]:
    """Finite numbers separated by commas, as many as in the example. Raises InputError."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != len(example.split(",")) or not all(map(math.isfinite, numbers)):
        raise InputError(f"{option}: {shortened(text)!r} is malformed; give numbers as in {example}")
    return numbers


def _about(
    candidate: Candidate | None, hints: tuple[Hint, ...], lamp: Light, *, flip: bool
) -> dict[str, Any]:
    """Method, hints and light of a surface, for its report; angles in degrees."""
    return {
        "method": None if candidate is None else candidate.method,
        "flipped": flip,
        "hints": [
            {"row": hint.row, "column": hint.column}
            | {name: round(math.degrees(getattr(hint, name)), 4) for name in ("slant", "tilt")}
            for hint in hints
        ],
        "light": {name: round(math.degrees(getattr(lamp, name)), 4) for name in ("azimuth", "elevation")},
    }
