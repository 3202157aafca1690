"""The command `shade`: a surface over a field, as pictures, heights and a mesh."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from ...models.errors import InputError, shortened
from ...models.processes.progress import Progress
from ...models.sketch.choice import AS_DRAWN, Choice
from .inputs import SAVED, choice_of, drawing_of, field_or_instance, known, load
from .options import (
    Curvature,
    Folder,
    GaugeName,
    Json,
    Mask,
    On,
    Outline,
    Over,
    Quiet,
    SecondsInAll,
    Size,
    SkewWeight,
    StrokeWeight,
    View,
)
from .output import complain, progress, say_json, show_surface

if TYPE_CHECKING:
    from ...models.field.field import CrossField
    from ...models.instance.instance import Instance
    from ...models.surface.hints import Hint
    from ..shading.light import Light
    from ..solving.methods import Candidate

FIELD: Final = "field.npz"
"""The field that was made of a sketch, beside its surface: to be shaded again with other hints."""

Subject = Annotated[
    str,
    typer.Argument(
        metavar="FIELD|SKETCH|SAMPLE|INSTANCE",
        help="A field (.npz, .json, .rawfield); or what it is made of first: a drawing (SVG, .scap, .curves)"
        " or bitmap; a built-in sample: {samples}; a file of `instance`.",
    ),
]
Flip = Annotated[
    bool,
    typer.Option(
        "--flip", help="Turn the surface inside out: bumps become hollows. Hints decide where there are some."
    ),
]
HintTexts = Annotated[
    list[str] | None,
    typer.Option(
        "--hint",
        metavar="ROW,COLUMN,SLANT,TILT",
        help="How the surface lies at a pixel (0,0 is upper left), in degrees: the slant between its normal"
        " and the viewer, 0 to 90, and the tilt, where the normal points on the drawing, counter-clockwise"
        " from the right. May be repeated.",
    ),
]
LightText = Annotated[
    str | None,
    typer.Option(
        "--light",
        metavar="AZIMUTH,ELEVATION",
        help="Where the lamp is, in degrees: counter-clockwise from the right, and 0 to 90 above the plane of"
        " the drawing; {light} by default.",
    ),
]
Scale = Annotated[
    int | None,
    typer.Option(
        "--scale",
        min=1,
        metavar="N",
        help="Pixels of a picture a pixel of the grid; by default one in the normal map, and in the others as"
        " many as make about {picture side}.",
    ),
]
MethodName = Annotated[
    str | None,
    typer.Option(
        "-m",
        "--method",
        metavar="NAME",
        help="How the field is made: {methods}; {kept method} by default.",
    ),
]


def shade_command(
    what: Subject,
    output: Folder,
    *,
    flip: Flip = False,
    hint: HintTexts = None,
    light: LightText = None,
    scale: Scale = None,
    method: MethodName = None,
    on: On = None,
    over: Over = None,
    size: Size = None,
    mask: Mask = None,
    silhouette: Outline = "none",
    curvature: Curvature = None,
    view: View = None,
    gauge: GaugeName = None,
    stroke_weight: StrokeWeight = None,
    skew_weight: SkewWeight = None,
    time_limit: SecondsInAll = 60.0,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Find the surface whose curvature lines the crosses are: normal map, shaded pictures, heights, mesh.

    The crosses leave open what is a bump and what a hollow (--flip), and how deep parts are that bend in one
    direction only (--hint). What speaks against the surface is printed, and stands in surface.json.
    """
    from ...models.field.file import write_field
    from ...models.surface.lift import surface
    from ..surfaces.files import write_surface
    from ..surfaces.report import surface_document

    hints, lamp = hints_of(hint), light_of(light)
    choice = choice_of(silhouette, curvature, view)
    with progress(quiet=quiet) as show:
        show("reading")
        field, candidate, below = _saved(what, on), None, over
        if field is None:
            instance = load(
                what,
                size,
                mask,
                gauge,
                choice,
                stroke_weight=stroke_weight,
                skew_weight=skew_weight,
                quiet=quiet,
            )
            candidate = _made(instance, method, output, time_limit, show)
            field, below = candidate.field, over or drawing_of(what)
        else:
            _refuse_options(what, choice, size, mask, gauge, stroke_weight, skew_weight, method)
        found = surface(field, hints, flip=flip, progress=show)
        about = _about(candidate, hints, lamp, flip=flip)
        show("drawing and writing")
        write_surface(found, output, drawing=below, light=lamp, scale=scale, about=about)
        if candidate is not None:
            write_field(field, output / FIELD)
    if as_json:
        say_json(surface_document(found, about))
    elif not quiet:
        show_surface(found, output)
    if candidate is not None and candidate.interrupted:
        complain("interrupted; the surface is that of the best field so far")


def _saved(what: str, on: Path | None) -> CrossField | None:
    """The field in a file; None for what a field is to be made of. Raises InputError."""
    from ...models.field.field import CrossField

    path = Path(what)
    if on is None and not (path.is_file() and path.suffix.lower() in SAVED):
        return None
    found = field_or_instance(path, on)
    return found if isinstance(found, CrossField) else None


def _refuse_options(what: str, choice: Choice, *options: object) -> None:
    """Nothing, or InputError where an option is given that says how a field is to be made."""
    if choice != AS_DRAWN or any(option is not None for option in options):
        raise InputError(
            "is a field, which has its own grid, strokes and weights; leave --method and the options that"
            " read a sketch out",
            file=what,
        )


def _made(instance: Instance, method: str | None, folder: Path, seconds: float, show: Progress) -> Candidate:
    """The last field of a method. Raises InputError for a method that is none."""
    from ...models.processes.limits import Limits
    from ..solving.methods import METHODS, Request
    from ..solving.run import KEPT

    (name,) = known([method or KEPT], METHODS, "method")
    *_, candidate = METHODS[name].find(Request(instance, folder / "solve", Limits(seconds), progress=show))
    return candidate


def hints_of(texts: list[str] | None) -> tuple[Hint, ...]:
    """The hints that are given in degrees. Raises InputError for what is none."""
    from ...models.surface.hints import Hint

    hints = []
    for text in texts or ():
        row, column, slant, tilt = _numbers(text, "--hint ROW,COLUMN,SLANT,TILT", "12,30,45,90")
        if row % 1 or column % 1:
            raise InputError(f"--hint {shortened(text)}: row and column are whole numbers, as in 12,30,45,90")
        hints.append(Hint(int(row), int(column), math.radians(slant), math.radians(tilt)))
    return tuple(hints)


def light_of(text: str | None) -> Light:
    """The light that is given in degrees, or that from the upper left. Raises InputError for what is none."""
    from ..shading.light import UPPER_LEFT, Light

    if text is None:
        return UPPER_LEFT
    azimuth, elevation = _numbers(text, "--light AZIMUTH,ELEVATION", "135,45")
    return Light(math.radians(azimuth), math.radians(elevation))


def _numbers(text: str, option: str, example: str) -> list[float]:
    """As many finite numbers as the example has, with commas between them. Raises InputError."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != len(example.split(",")) or not all(map(math.isfinite, numbers)):
        raise InputError(f"{option} is given {shortened(text)!r}; give numbers as in {example}")
    return numbers


def _about(
    candidate: Candidate | None, hints: tuple[Hint, ...], lamp: Light, *, flip: bool
) -> dict[str, Any]:
    """How a surface was made, for its report; angles in degrees."""
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
