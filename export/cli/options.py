"""Arguments and options that several commands share; their help is filled from the tables in braces."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from ...models.errors import InputError
from ...models.processes.side_by_side import MOST, checked


def _permitted(count: int, what: str, least: int) -> int:
    """The number, if so many threads or processes may be asked for."""
    try:
        return checked(count, what, least=least)
    except InputError as error:
        raise typer.BadParameter(str(error)) from error


def _jobs(count: int) -> int:
    return _permitted(count, "jobs", 1)


def _threads(count: int) -> int:
    return _permitted(count, "threads", 0)


What = Annotated[
    str,
    typer.Argument(
        metavar="SKETCH|SAMPLE|INSTANCE",
        help="A drawing (SVG, .scap, .curves) or bitmap; a built-in sample: {samples}; or a file of"
        " `instance`.",
    ),
]
Folder = Annotated[
    Path,
    typer.Option("-o", "--output", metavar="DIR", help="Folder for the files; made when it is not there."),
]
Output = Annotated[
    Path, typer.Option("-o", "--output", metavar="FILE", help="File to write; its suffix says what kind.")
]
On = Annotated[
    Path | None,
    typer.Option("--on", metavar="INSTANCE", help="The instance (.npz, .json) of a .rawfield."),
]
Over = Annotated[
    str | None,
    typer.Option(
        "--over",
        metavar="DRAWING|SAMPLE",
        help="Drawing or sample that the instance was read from; its strokes are drawn too. A .curves file is"
        " seen as the instance records it.",
    ),
]
Size = Annotated[
    int | None, typer.Option("--size", help="Pixels on the longer side of the grid; {size} by default.")
]
Mask = Annotated[
    Path | None,
    typer.Option(
        "--mask", metavar="FILE", help="Picture as large as the sketch, white where the field is wanted."
    ),
]
Outline = Annotated[
    Literal["none", "outer"],
    typer.Option(
        "--silhouette",
        help="What runs along the outline of the drawing carries no direction (outer), or all curvature lines"
        " do (none).",
    ),
]
Curvature = Annotated[
    list[str] | None,
    typer.Option(
        "--curvature",
        metavar="LABEL",
        help="Strokes that are curvature lines, such as colour=red, class=flow, id=group2, layer=Flow (SVG)"
        " or cluster=3 (.scap); the others cut the field. May be repeated; red ones among others by default.",
    ),
]
View = Annotated[
    str | None,
    typer.Option(
        "--view",
        metavar="VIEW",
        help="From where a .curves file is seen: front, side, top, or azimuth and elevation in degrees as in"
        " 30,25; by default where the strokes reach farthest.",
    ),
]
GaugeName = Annotated[
    Literal["strokes", "box"] | None,
    typer.Option(
        "--gauge",
        help="The 90 degrees in which the angle alpha may lie: round the stroke in each pixel (strokes,"
        " exact), or 0 to 90 as the paper prints it (box).",
    ),
]
StrokeWeight = Annotated[
    float | None,
    typer.Option(
        "--stroke-weight",
        metavar="X",
        help="Weight of the distance from the strokes, 0 to {most weight}, the same on every grid; by default"
        " {stroke weight}, or that of the instance file.",
    ),
]
SkewWeight = Annotated[
    float | None,
    typer.Option(
        "--skew-weight",
        metavar="X",
        help="Weight of the skew beta, 0 to {most weight}, the same on every grid; by default {skew weight},"
        " or that of the instance file.",
    ),
]
Facet = Annotated[
    Literal["hull", "printed"] | None,
    typer.Option("--facet", help="Inequality (26) of the paper: corrected (hull, exact), or as printed."),
]
StrokeNorm = Annotated[
    int | None,
    typer.Option(
        "--stroke-norm",
        min=1,
        max=2,
        help="Distance from the strokes in absolute values (1) or squares (2), where a formulation leaves it"
        " open.",
    ),
]
BetaNorm = Annotated[
    int | None,
    typer.Option(
        "--beta-norm",
        min=1,
        max=2,
        help="Skew beta in absolute values (1) or squares (2), where a formulation leaves it open.",
    ),
]
Relax = Annotated[
    bool, typer.Option("--relax", help="Let integers take any value within their bounds: a lower bound.")
]
Seconds = Annotated[
    float, typer.Option("--time-limit", min=0.1, metavar="SECONDS", help="Seconds for each solve.")
]
SecondsInAll = Annotated[
    float,
    typer.Option(
        "--time-limit",
        min=0.1,
        metavar="SECONDS",
        help="Seconds in all, reading and writing files included; methods that do not search end earlier."
        " power, polyvector and bend complete their first factorisation in any case.",
    ),
]
SecondsEach = Annotated[
    float,
    typer.Option(
        "--time-limit",
        min=0.1,
        metavar="SECONDS",
        help="Seconds for each method that searches; what that makes in all is said before the first begins.",
    ),
]
Gap = Annotated[
    float,
    typer.Option(
        "--gap",
        min=0.0,
        help="Relative distance between best point and proven bound at which a solver may stop.",
    ),
]
Jobs = Annotated[
    int,
    typer.Option("--jobs", callback=_jobs, help=f"How many solver files are written at once; 1 to {MOST}."),
]
Processes = Annotated[
    int, typer.Option("--jobs", callback=_jobs, help=f"How many processes work at once; 1 to {MOST}.")
]
Threads = Annotated[
    int,
    typer.Option(
        "--threads",
        callback=_threads,
        help=f"Cores that HiGHS and search use at once; 1 to {MOST}, or 0: as many as they choose.",
    ),
]
Start = Annotated[
    Path | None,
    typer.Option(
        "--start",
        metavar="FIELD",
        help="Field (.npz, .json, .rawfield) on the same instance to start from; "
        "its jumps are the data of qp-fixed.",
    ),
]
GamsLayout = Annotated[
    Literal["indexed", "scalar"] | None,
    typer.Option(
        "--gams-layout",
        help="GAMS files with sets and equations over them (indexed), or row by row as in MINLPLib (scalar).",
    ),
]
NlForm = Annotated[
    Literal["text", "binary"] | None, typer.Option("--nl-form", help="AMPL .nl files as text or binary.")
]
Names = Annotated[
    list[str] | None,
    typer.Option(
        "-f",
        "--formulation",
        metavar="NAME",
        help="{formulations}; in short {short names}; all by default, may be repeated.",
    ),
]
Formats = Annotated[
    list[str] | None,
    typer.Option(
        "-F", "--format", metavar="NAME", help="{formats}; {default formats} by default, may be repeated."
    ),
]
Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="Print nothing but errors.")]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
