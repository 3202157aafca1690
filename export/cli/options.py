"""Arguments and options that several commands share, with their help."""

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
        help="SVG, bitmap or .scap; a name of `crossfield samples`; or a .json or .npz of `crossfield instance`.",
    ),
]
Folder = Annotated[
    Path,
    typer.Option("-o", "--output", metavar="DIR", help="Folder for the files; made when it is not there."),
]
Output = Annotated[
    Path, typer.Option("-o", "--output", metavar="FILE", help="File to write; its suffix decides the kind.")
]
Size = Annotated[
    int | None, typer.Option("--size", help="Pixels on the longer side of the grid; 24 by default.")
]
Mask = Annotated[
    Path | None, typer.Option("--mask", metavar="FILE", help="Picture of the sketch's size: white = solve.")
]
GaugeName = Annotated[
    Literal["strokes", "box"] | None,
    typer.Option("--gauge", help="Window of alpha: round each stroke (exact), or [0, pi/2] as printed."),
]
Facet = Annotated[
    Literal["hull", "printed"] | None,
    typer.Option("--facet", help="Facet (26) of z: of the hull (exact), or as printed."),
]
StrokeNorm = Annotated[
    int | None, typer.Option("--stroke-norm", min=1, max=2, help="Norm of the stroke term where it is open.")
]
BetaNorm = Annotated[
    int | None, typer.Option("--beta-norm", min=1, max=2, help="Norm of the skew term where it is open.")
]
Relax = Annotated[bool, typer.Option("--relax", help="Drop integrality.")]
Seconds = Annotated[
    float, typer.Option("--time-limit", min=0.1, metavar="SECONDS", help="Seconds for each solve.")
]
SecondsInAll = Annotated[
    float,
    typer.Option(
        "--time-limit",
        min=0.1,
        metavar="SECONDS",
        help="Seconds in all, reading and writing files included; greedy and power end when they are done.",
    ),
]
SecondsEach = Annotated[
    float,
    typer.Option(
        "--time-limit",
        min=0.1,
        metavar="SECONDS",
        help="Seconds for each of the methods that search; what that makes in all is said before they start.",
    ),
]
Gap = Annotated[
    float, typer.Option("--gap", min=0.0, help="Relative gap at which a discrete search may stop.")
]
Jobs = Annotated[
    int,
    typer.Option("--jobs", callback=_jobs, help=f"Solver files written at once, in threads; 1 to {MOST}."),
]
Processes = Annotated[
    int, typer.Option("--jobs", callback=_jobs, help=f"Entries built at once, in processes; 1 to {MOST}.")
]
Threads = Annotated[
    int,
    typer.Option(
        "--threads",
        callback=_threads,
        help=f"Threads of HiGHS, processes of searches; 1 to {MOST}, or 0: their own choice.",
    ),
]
Start = Annotated[
    Path | None,
    typer.Option(
        "--start",
        metavar="FIELD",
        help="Field (.npz, .json) as starting point, and for the jumps of qp-fixed.",
    ),
]
GamsLayout = Annotated[
    Literal["indexed", "scalar"] | None,
    typer.Option("--gams-layout", help="Sets and equations, or MINLPLib's scalar style."),
]
NlForm = Annotated[Literal["text", "binary"] | None, typer.Option("--nl-form", help="Text or binary .nl.")]
Names = Annotated[
    list[str] | None,
    typer.Option("-f", "--formulation", metavar="NAME", help="Formulation, may be repeated; all by default."),
]
Formats = Annotated[
    list[str] | None,
    typer.Option(
        "-F", "--format", metavar="NAME", help="Format, may be repeated; by default nl, gms, lp and mps."
    ),
]
Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="Print nothing but errors.")]
Json = Annotated[bool, typer.Option("--json", help="The result as JSON on standard output.")]
