"""Declaration of the commands, and their arguments and options."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import typer

from ...models.processes.job_counts import MOST_JOBS

# Literal names, because help loads no tables; tests/export/cli/test_help.py compares them.
_SOLVERS: Final = "gurobi, cplex, xpress, highs, scip, baron, ipopt, bonmin, gams-cplex, cbc, glpk"
RUNGS: Final = "tiny, small, medium, large, mesh"

_output = partial(typer.Option, rich_help_panel="Output")
_folder = partial(_output, "-o", "--output", metavar="DIR")
_formulating = partial(typer.Option, rich_help_panel="Formulation")
_method = partial(typer.Option, "-m", "--method", metavar="NAME")
_formulation = partial(_formulating, "-f", "--formulation", metavar="NAME")
_time_limit = partial(typer.Option, "--time-limit", min=0.1, metavar="SECONDS")
_gap = partial(typer.Option, "--gap", min=0.0)
_jobs = partial(typer.Option, "--jobs", min=1, max=MOST_JOBS)


def _norm_option(option: str, terms: str) -> Any:
    """Option for a norm."""
    words = f"{terms} in absolute values (1) or squares (2), where a formulation offers both."
    return _formulating(option, min=1, max=2, help=words)


def add_command(app: typer.Typer, name: str, example: str) -> Callable[[Callable[..., None]], Any]:
    """Decorator that adds a function to the app as a command of this name; the example ends its help."""

    def add(function: Callable[..., None]) -> Any:
        text = re.sub(r"(?<!\n)\n(?!\n)", " ", inspect.getdoc(function) or "")  # lines begin no paragraphs
        return app.command(name, help=text, epilog=f"Example: {example}")(function)

    return add


# Input and output

_ANY: Final = (
    "A drawing (SVG, .scap, .curves) or bitmap; a triangle mesh (.obj, .ply, .off, .stl); an instance file"
    " (.json, .npz); or the name of a built-in sample, which `crossfield list` lists."
)
Input = Annotated[str, typer.Argument(metavar="SKETCH|SAMPLE|MESH|INSTANCE", help=_ANY)]
OptionalInput = Annotated[str | None, typer.Argument(metavar="[SKETCH|SAMPLE|MESH|INSTANCE]", help=_ANY)]
FieldOrInput = Annotated[
    str,
    typer.Argument(
        metavar="FIELD|SKETCH|SAMPLE|INSTANCE",
        help="File of a field (.npz, .json), or what `solve` takes, for its field of the method bend.",
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
        help="Solution file of a solver, plain or .gz; the kind is detected from the content."
        " `crossfield list` lists the kinds.",
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
Json = Annotated[bool, _output("--json", help="Print the result as JSON.")]

# Reading of sketches and meshes

_sketch = partial(typer.Option, rich_help_panel="Sketch")
_mesh = partial(typer.Option, rich_help_panel="Mesh")

Size = Annotated[int | None, _sketch("--size", help="Pixels on the longer side of the grid; 24 by default.")]
Mask = Annotated[
    Path | None,
    _sketch(
        "--mask",
        metavar="FILE",
        help="Picture of the same size as the sketch, white where the field is wanted.",
    ),
]
Silhouette = Annotated[
    Literal["none", "outer"],
    _sketch(
        "--silhouette",
        help="Strokes along the outline of the drawing carry no direction (outer), or are curvature lines"
        " like all others (none).",
    ),
]
Curvature = Annotated[
    list[str] | None,
    _sketch(
        "--curvature",
        metavar="LABEL",
        help="Label of the strokes that are curvature lines, such as colour=red, class=flow, id=group2,"
        " layer=Flow (SVG) or cluster=3 (.scap). Other strokes cut the field. May be repeated; by default"
        " red strokes, or all strokes of a drawing in one colour.",
    ),
]
View = Annotated[
    str | None,
    _sketch(
        "--view",
        metavar="VIEW",
        help="Viewpoint of a .curves file: front, side, top, or azimuth and elevation in degrees, as in"
        " 30,25; by default the view in which the strokes extend furthest.",
    ),
]
StrokeWeight = Annotated[
    float | None,
    _sketch(
        "--stroke-weight",
        metavar="X",
        help="Weight of the distance from the strokes, 0 to 1,000,000 (to less on grids below 24"
        " pixels), the same on every grid; by default 20, or the weight in the instance"
        " file.",
    ),
]
Sharp = Annotated[
    float | None,
    _mesh(
        "--sharp",
        metavar="DEGREES",
        help="Strokes along the edges of a mesh whose faces meet at this angle or more, 0 (all edges) to 180;"
        " by default only boundaries, and the polylines of an .obj, are strokes.",
    ),
]
Boundary = Annotated[
    bool | None,
    _mesh(
        "--boundary/--no-boundary",
        help="Whether boundary edges of a mesh are strokes; by default they are.",
        show_default=False,
    ),
]
Directions = Annotated[
    Path | None,
    _mesh(
        "--directions",
        metavar="FILE",
        help="More strokes of a mesh: a table face,x,y,z or face,x,y,z,weight (CSV) of directions in space,"
        " faces from 0 and weights from 0 to 1; the first vectors of a .rawfield or .rosy; or the edges of a"
        " .sharp of QuadWild.",
    ),
]
Weights = Annotated[
    Literal["unit", "dual"],
    _mesh(
        "--weights",
        help="Weights of neighbouring faces in the smoothness: all 1 (unit), or the length of their edge"
        " over the distance of their centres (dual).",
    ),
]
Merge = Annotated[
    float | None,
    _mesh(
        "--merge",
        metavar="DISTANCE",
        help="Join vertices of the boundary of a mesh up to this distance, 0 for those at the same place; by"
        " default only a warning reports them. Faces keep their order.",
    ),
]
SharpWeight = Annotated[
    float | None,
    _mesh(
        "--sharp-weight",
        metavar="X",
        help="Factor of the weight of two faces with strokes along their common edge, above 0, up to"
        " 1,000,000; by default 1. A small one, such as 1e-6, lets crosses on both sides turn apart.",
    ),
]

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
    str | None, _formulation(help="Solve this formulation; `crossfield list` has their full and short names.")
]
FormulationNames = Annotated[
    list[str] | None,
    _formulation(
        help="Full or short name of a formulation in `crossfield list`; all by default, may be repeated."
    ),
]
FormatNames = Annotated[
    list[str] | None,
    typer.Option(
        "-F",
        "--format",
        metavar="NAME",
        help="nl, gms, lp, mps, mod, osil, qplib, bar; the first four by default, may be repeated.",
    ),
]
Gzip = Annotated[bool, typer.Option("--gzip", help="Compress the model files (.gz).")]

# Methods, solvers and their limits

MethodName = Annotated[
    str | None,
    _method(help="greedy, power, polyvector, bend, search or two-stage; `crossfield list` describes them."),
]
SolverName = Annotated[
    str | None,
    typer.Option(
        "--solver",
        metavar="NAME",
        help=f"{_SOLVERS}; by default one of highs, ipopt, bonmin that suits the formulation.",
    ),
]
ProgramNames = Annotated[
    list[str] | None,
    typer.Option(
        "-p",
        "--program",
        metavar="NAME",
        help="highs, gurobi, cplex, xpress, scip, cbc, glpk, casadi, gams; by default all that are installed,"
        " may be repeated.",
    ),
]
LibrarySolvers = Annotated[
    list[str] | None,
    typer.Option(
        "--solver",
        metavar="NAME",
        help=f"{_SOLVERS}; those that are installed by default, may be repeated.",
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
Indices = Annotated[
    Path | None,
    typer.Option(
        "--indices",
        metavar="FILE",
        help="Indices that orthogonal crosses must have at some vertices: a .sings, with a line `4 N` and N"
        " lines of a vertex, from 0, and four times its index.",
    ),
]
SkewWeight = Annotated[
    float | None,
    typer.Option(
        "--skew-weight",
        metavar="X",
        help="Weight of the skew beta, 0 to 1,000,000 (to less on grids below 24 pixels), the same on"
        " every grid; by default 1e-06, or the weight in the instance file.",
    ),
]
Processes = Annotated[int, _jobs(help="Number of processes that work in parallel.")]
Threads = Annotated[
    int,
    typer.Option(
        "--threads", min=0, max=MOST_JOBS, help="Threads of HiGHS and of the search; 0: they choose."
    ),
]

# Pictures and surfaces

Kind = Annotated[
    str | None,
    typer.Option(
        "--kind",
        metavar="NAME",
        help="instance, crosses, field, angle, overview or layers; by default layers for a field as SVG or"
        " with --underlay, otherwise what the file contains.",
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
Up = Annotated[
    Literal["x", "y", "z"] | None,
    typer.Option("--up", help="Axis of a mesh that points upwards; by default z."),
]
Flip = Annotated[
    bool,
    typer.Option(
        "--flip", help="Turn the surface inside out: bumps become hollows. Hints, if any, take precedence."
    ),
]
Concave = Annotated[
    list[str] | None,
    typer.Option(
        "--concave",
        metavar="X,Y",
        help="A place in the drawing, in its coordinates, whose part of the surface is a bowl, not a bump."
        " May be repeated. Hints, if any, take precedence.",
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
PictureSide = Annotated[
    int | None,
    typer.Option(
        "--side",
        min=1,
        metavar="PIXELS",
        help="Pixels on the longer side of the pictures; by default those of a sketch that is a picture,"
        " and about 1024 for others.",
    ),
]
