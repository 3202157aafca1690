"""Arguments and options of the commands; names in braces are filled from the tables when help is shown."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import typer

from ...models.processes.job_counts import MOST
from .output import print_json, print_line, show_facts

_SKETCH: Final = "a drawing (SVG, .scap, .curves) or bitmap; a built-in sample: {samples};"
_SAVED: Final = "or an instance file (.json, .npz)."

_output = partial(typer.Option, rich_help_panel="Output")
_folder = partial(_output, "-o", "--output", metavar="DIR")
_formulating = partial(typer.Option, rich_help_panel="Formulation")
_method = partial(typer.Option, "-m", "--method", metavar="NAME")
_formulation = partial(_formulating, "-f", "--formulation", metavar="NAME")
_time_limit = partial(typer.Option, "--time-limit", min=0.1, metavar="SECONDS")
_gap = partial(typer.Option, "--gap", min=0.0)
_jobs = partial(typer.Option, "--jobs", min=1, max=MOST)


def _norm_option(option: str, terms: str) -> Any:
    """Option for a norm."""
    words = f"{terms} in absolute values (1) or squares (2), where a formulation offers both."
    return _formulating(option, min=1, max=2, help=words)


# Input and output

_ANY: Final = f"One of: {_SKETCH} a triangle mesh ({{meshes}}), or a built-in one: {{mesh samples}}; {_SAVED}"
Input = Annotated[str, typer.Argument(metavar="SKETCH|SAMPLE|MESH|INSTANCE", help=_ANY)]
OptionalInput = Annotated[str | None, typer.Argument(metavar="[SKETCH|SAMPLE|MESH|INSTANCE]", help=_ANY)]
FieldOrInput = Annotated[
    str,
    typer.Argument(
        metavar="FIELD|SKETCH|SAMPLE|INSTANCE",
        help=f"A field (.npz, .json, .rawfield); or the input for a new field: {_SKETCH} {_SAVED}",
    ),
]
FieldOrInstance = Annotated[
    Path,
    typer.Argument(
        metavar="FIELD|INSTANCE", help="File of a field (.npz, .json, .rawfield) or of an instance."
    ),
]
SolutionFile = Annotated[
    Path,
    typer.Argument(
        metavar="SOLUTION",
        help="Solution file of {answers}, plain or .gz; the kind is detected from the content.",
    ),
]
Exported = Annotated[Path, typer.Argument(metavar="DIR", help="Folder that `crossfield export` wrote.")]
Folder = Annotated[Path, _folder(help="Folder for the files; created if it does not exist.")]
ProofFolder = Annotated[Path | None, _folder(help="Folder for field, certificate and report.")]
Output = Annotated[
    Path, _output("-o", "--output", metavar="FILE", help="File to write; its suffix selects the format.")
]
Force = Annotated[
    bool,
    _output(
        "--force",
        help="Replace also files that crossfield has not written or that have changed since, and better"
        " results than the new ones. Without it, the command stops before any work if such files are in the"
        " way, and better results stay. Files that the command reads are never replaced.",
    ),
]
Manifest = Annotated[
    Path,
    typer.Option(
        "--manifest",
        metavar="FILE",
        help="The .manifest.json file that `crossfield export` wrote next to the solved file, or the .json "
        "file of a library's entry.",
    ),
]
On = Annotated[
    Path | None, typer.Option("--on", metavar="INSTANCE", help="Instance (.npz, .json) of a .rawfield.")
]
Start = Annotated[
    Path | None,
    typer.Option(
        "--start",
        metavar="FIELD",
        help="Field (.npz, .json, .rawfield) on the same instance to start from; "
        "qp-fixed takes its jumps as data.",
    ),
]
Tightened = Annotated[
    Path | None,
    _formulating(
        "--tightened",
        metavar="PROOF",
        help="Certificate (.npz) on the same instance, which is checked first. The bounds of alpha, beta and"
        " the jumps are reduced to the proven ranges; qp-fixed takes its jumps.",
    ),
]
Check = Annotated[
    Path | None,
    typer.Option("--check", metavar="FILE", help="Only check this certificate and print what it proves."),
]
Quiet = Annotated[bool, _output("-q", "--quiet", help="Print nothing but errors.")]
Json = Annotated[bool, _output("--json", help="Print the result as JSON.")]


@dataclass(frozen=True)
class PrintOptions:
    """Options for the result on standard output."""

    quiet: Quiet = False
    as_json: Json = False

    def show(self, document: object, show: Callable[[], None]) -> None:
        """Print the document as JSON, call the function that shows it, or do nothing if quiet."""
        if self.as_json:
            print_json(document)
        elif not self.quiet:
            show()

    def show_facts(self, title: str, facts: dict[str, Any], *lines: str) -> None:
        """Print facts as JSON, or as a table with some lines below, or do nothing if quiet."""

        def show() -> None:
            show_facts(title, facts)
            for line in lines:
                print_line(line)

        self.show(facts, show)


# Formulations and formats

Facet = Annotated[
    Literal["hull", "printed"] | None,
    _formulating("--facet", help="Inequality (26) of the paper: corrected (hull, exact), or as printed."),
]


StrokeNorm = Annotated[int | None, _norm_option("--stroke-norm", "Distance from the strokes")]
BetaNorm = Annotated[int | None, _norm_option("--beta-norm", "Skew beta")]
Relax = Annotated[
    bool,
    _formulating(
        "--relax", help="Let integers take any value within their bounds, which gives a lower bound."
    ),
]
ResidualLimits = Annotated[
    bool,
    _formulating(
        "--limits",
        help="Limit residuals of orthogonal crosses to what no change of one jump improves; the optimum "
        "stays.",
    ),
]
FormulationName = Annotated[
    str | None, _formulation(help="Solve this formulation: {formulations}; in short {short names}.")
]
FormulationNames = Annotated[
    list[str] | None,
    _formulation(help="{formulations}; in short {short names}; all by default, may be repeated."),
]
FormatNames = Annotated[
    list[str] | None,
    typer.Option(
        "-F", "--format", metavar="NAME", help="{formats}; {default formats} by default, may be repeated."
    ),
]
NlForm = Annotated[
    Literal["text", "binary"] | None, typer.Option("--nl-form", help="AMPL .nl files as text or binary.")
]
Gzip = Annotated[bool, typer.Option("--gzip", help="Compress the model files (.gz).")]

# Methods, solvers and their limits

MethodName = Annotated[
    str | None,
    _method(help="Compute the field with a method of: {methods}. `crossfield list` describes them."),
]
SolverName = Annotated[
    str | None,
    typer.Option(
        "--solver",
        metavar="NAME",
        help="{all solvers}; by default one of {bundled solvers} that suits the formulation.",
    ),
]
ProgramNames = Annotated[
    list[str] | None,
    typer.Option(
        "-p",
        "--program",
        metavar="NAME",
        help="{programs}; by default all that are installed, may be repeated.",
    ),
]
Seconds = Annotated[float, _time_limit(help="Seconds for each solve.")]
SecondsInAll = Annotated[
    float,
    _time_limit(
        help="Seconds in total, including reading and writing files; methods that do not search end earlier."
        " power, polyvector and bend always complete their first factorisation."
    ),
]
SecondsPerMethod = Annotated[
    float,
    _time_limit(
        help="Seconds for each method that searches; the total is printed before the first one begins."
    ),
]
SecondsOfProof = Annotated[
    float,
    _time_limit(
        help="Seconds for the proof. They count from when the sketch has been read and, once on a machine,"
        " the functions of proofs are compiled. Its certificate is checked and written afterwards."
    ),
]
ProofGap = Annotated[
    float,
    _gap(
        help="Relative distance between energy and bound at which the proof stops; 0 asks for a proven"
        " optimum."
    ),
]
Norm = Annotated[
    Literal["1", "2", "mixed"],
    _formulating(
        "--norm",
        help="Norm of the energy: squares (2), absolute values (1, as in milp-mccormick), or absolute values"
        " of the smoothness with squares of the other terms (mixed, as in miqp-mccormick).",
    ),
]
Tolerance = Annotated[
    float,
    typer.Option(
        "--tolerance",
        metavar="X",
        min=0,
        help="Largest accepted violation of a row or a bound, and largest accepted relative error of the"
        " objective.",
    ),
]
Pick = Annotated[
    int | None,
    typer.Option(
        "--solution",
        min=1,
        metavar="K",
        help="Number of the solution in a file with several; by default the one with the least objective, or"
        " the first.",
    ),
]
AnswerGap = Annotated[
    float | None,
    _gap(
        help="Relative gap that the program was given, for a file that calls its point optimal and states no"
        " dual bound; 0 for an exact search.",
    ),
]
AnswerBound = Annotated[
    float | None,
    typer.Option(
        "--bound",
        metavar="X",
        help="Dual bound that the program has proven, from its log; the greater one of this and the file's"
        " counts.",
    ),
]
SolveSeconds = Annotated[
    float | None,
    typer.Option(
        "--solve",
        min=0.1,
        metavar="SECONDS",
        help="Solve every problem too, within this time each, and compare the optima.",
    ),
]
Gauge = Annotated[
    Literal["strokes", "box"] | None,
    typer.Option(
        "--gauge",
        help="Range of 90 degrees for the angle alpha: around the stroke in each pixel (strokes, exact),"
        " or 0 to 90 as in the paper (box).",
    ),
]
Crosses = Annotated[
    Literal["orthogonal", "skewed"] | None,
    typer.Option(
        "--crosses",
        help="Crosses of right angles, without variables for the skew (orthogonal), or of any angles"
        " (skewed); by default orthogonal on meshes and skewed on sketches.",
    ),
]
SkewWeight = Annotated[
    float | None,
    typer.Option(
        "--skew-weight",
        metavar="X",
        help="Weight of the skew beta, 0 to {most weight} (to less on grids below 24 pixels), the same on"
        " every grid; by default {skew weight}, or the weight in the instance file.",
    ),
]
Processes = Annotated[int, _jobs(help="Number of processes that work in parallel.")]
Threads = Annotated[
    int,
    typer.Option("--threads", min=0, max=MOST, help="Threads of HiGHS and of the search; 0: they choose."),
]

# Pictures and surfaces

Kind = Annotated[
    str | None,
    typer.Option(
        "--kind",
        metavar="NAME",
        help="{pictures}; by default layers for a field as SVG or with --underlay, otherwise what the file"
        " contains.",
    ),
]
Underlay = Annotated[
    str | None,
    typer.Option(
        "--underlay",
        metavar="DRAWING|SAMPLE",
        help="Drawing or sample from which the instance was read, to show its strokes. A .curves file is"
        " shown from the view that the instance records.",
    ),
]
Flip = Annotated[
    bool,
    typer.Option(
        "--flip", help="Turn the surface inside out: bumps become hollows. Hints, if any, take precedence."
    ),
]
Hints = Annotated[
    list[str] | None,
    typer.Option(
        "--hint",
        metavar="ROW,COLUMN,SLANT,TILT",
        help="Normal of the surface at a pixel (0,0 is upper left), in degrees: the slant between normal and"
        " viewing direction, 0 to 90, and the tilt, the direction of the normal on the drawing,"
        " counter-clockwise from the right. May be repeated.",
    ),
]
Lamp = Annotated[
    str | None,
    typer.Option(
        "--light",
        metavar="AZIMUTH,ELEVATION",
        help="Direction of the light in degrees: counter-clockwise from the right, and 0 to 90 above the"
        " plane of the drawing; {light} by default.",
    ),
]
PictureSide = Annotated[
    int | None,
    typer.Option(
        "--side",
        min=1,
        metavar="PIXELS",
        help="Pixels on the longer side of the pictures; by default those of a sketch that is a picture,"
        " and about {picture side} for others.",
    ),
]
