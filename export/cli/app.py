"""The command line: the verbs of the package, with progress, tables, exit codes and one-line errors.

Exit codes: 0 fine, 1 the request failed, 2 wrong usage. Ctrl-C ends a search with the best field so far, and
a run with a report of what there is: that is fine too, and said on standard error. Where there is nothing to
keep, the exit code is 1. Heavy libraries are imported inside the commands.
"""

from __future__ import annotations

import logging
import signal
import sys
from functools import partial
from pathlib import Path
from typing import Annotated, Final, NoReturn

import typer

from ...models.errors import CrossfieldError, InputError, shortened
from .evaluate_command import evaluate_command
from .help_texts import Command
from .inputs import (
    SAVED,
    choice_of,
    drawing_of,
    field_or_instance,
    formulations_of,
    known,
    load,
    options_of,
    require_suffix,
)
from .library_command import library
from .options import (
    BetaNorm,
    Curvature,
    Facet,
    Folder,
    Formats,
    GamsLayout,
    Gap,
    GaugeName,
    Jobs,
    Json,
    Mask,
    Names,
    NlForm,
    On,
    Outline,
    Output,
    Over,
    Quiet,
    Relax,
    SecondsEach,
    Size,
    SkewWeight,
    Start,
    StrokeNorm,
    StrokeWeight,
    Threads,
    View,
    What,
)
from .output import (
    INTERRUPTED,
    complain,
    degrade,
    progress,
    say,
    say_json,
    show_lists,
    show_manifests,
    show_report,
    show_samples,
)
from .prove_command import prove_command
from .shade_command import shade_command
from .solve_command import solve_command, tell_solution
from .verify_command import verify_command

app = typer.Typer(
    name="crossfield",
    help="Turn a concept sketch into an optimization problem in files for any solver, and a solver's answer"
    " into a cross field: two line directions at every pixel.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

command = partial(app.command, cls=Command)

_STOPPED: Final = 130  # how typer leaves after a Ctrl-C that no command caught


@app.callback(invoke_without_command=True)
def root(
    *,
    debug: Annotated[  # noqa: ARG001
        bool, typer.Option("--debug", help="Show the traceback of an error.")
    ] = False,
    version: Annotated[bool, typer.Option("--version", help="Show the version.", is_eager=True)] = False,
) -> None:
    """Options before the command; `invoke` looks at --debug."""
    if version:
        from importlib.metadata import version as installed

        say(f"crossfield {installed('crossfield')}")
        raise typer.Exit


@command("run")
def run_command(
    sketch: What,
    output: Folder,
    *,
    size: Size = None,
    mask: Mask = None,
    silhouette: Outline = "none",
    curvature: Curvature = None,
    view: View = None,
    gauge: GaugeName = None,
    stroke_weight: StrokeWeight = None,
    skew_weight: SkewWeight = None,
    facet: Facet = None,
    time_limit: SecondsEach = 60.0,
    gap: Gap = 1e-6,
    threads: Threads = 0,
    jobs: Jobs = 1,
    gams_layout: GamsLayout = None,
    nl_form: NlForm = None,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Do everything for one sketch: write all solver files, try methods, keep a field, draw it.

    The methods are {methods}. The bend field is kept, and that of least 2-norm energy beside it.
    report.json has all facts. Ctrl-C ends the run with the fields so far; a second one ends at once.
    """
    from ...models.processes.limits import Limits
    from ..solving.run import plan, run

    limits = Limits(time_limit, gap, threads)
    with progress(quiet=quiet) as show:
        show("reading the sketch")
        choice = choice_of(silhouette, curvature, view)
        instance = load(
            sketch,
            size,
            mask,
            gauge,
            choice,
            stroke_weight=stroke_weight,
            skew_weight=skew_weight,
            quiet=quiet,
        )
    if not (quiet or as_json):
        say(plan(limits))
    with progress(quiet=quiet) as show:
        report = run(
            instance,
            output,
            limits=limits,
            options={"facet": facet},
            dialects=_dialects(gams_layout, nl_form),
            drawing=drawing_of(sketch),
            jobs=jobs,
            progress=show,
        )
    if as_json:
        say_json(report.document())
    elif not quiet:
        show_report(report, output)
    if report.interrupted:
        complain(f"interrupted: {report.interrupted}; the report says what there is")


@command("instance")
def instance_command(
    sketch: What,
    output: Output,
    *,
    size: Size = None,
    mask: Mask = None,
    silhouette: Outline = "none",
    curvature: Curvature = None,
    view: View = None,
    gauge: GaugeName = None,
    stroke_weight: StrokeWeight = None,
    skew_weight: SkewWeight = None,
    quiet: Quiet = False,
) -> None:
    """Write a sketch or a sample as an instance (.json, .npz): its strokes on a grid of pixels.

    To a .png its mask is written, white where the field is wanted: to be painted, and given back by --mask.
    """
    from ...models.instance.file import write_instance
    from ..pictures.mask import write_mask

    require_suffix(output, (".json", ".npz", ".png"))
    with progress(quiet=quiet) as show:
        show("reading the sketch")
        choice = choice_of(silhouette, curvature, view)
        instance = load(
            sketch,
            size,
            mask,
            gauge,
            choice,
            stroke_weight=stroke_weight,
            skew_weight=skew_weight,
            quiet=quiet,
        )
        (write_mask if output.suffix.lower() == ".png" else write_instance)(instance, output)
    if not quiet:
        say(f"{output}: {instance.summary}")


@command("export")
def export_command(
    instance: What,
    output: Folder,
    *,
    formulation: Names = None,
    file_format: Formats = None,
    size: Size = None,
    mask: Mask = None,
    silhouette: Outline = "none",
    curvature: Curvature = None,
    view: View = None,
    gauge: GaugeName = None,
    stroke_weight: StrokeWeight = None,
    skew_weight: SkewWeight = None,
    facet: Facet = None,
    stroke_norm: StrokeNorm = None,
    beta_norm: BetaNorm = None,
    relax: Relax = False,
    start: Start = None,
    tightened: Annotated[
        Path | None,
        typer.Option(
            "--tightened",
            metavar="PROOF",
            help="Certificate (.npz) on the same instance: windows of alpha and beta and ranges of jumps are"
            " narrowed to what it leaves; qp-fixed takes its jumps. It is checked first.",
        ),
    ] = None,
    gams_layout: GamsLayout = None,
    nl_form: NlForm = None,
    compress: Annotated[bool, typer.Option("--gzip", help="Compress the model files (.gz).")] = False,
    jobs: Jobs = 1,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Write an instance as files for solvers, in every formulation and format.

    Beside the files of each formulation lies its manifest (.manifest.json), which `crossfield read` needs to
    read a solver's answer.
    """
    from ...models.field.file import read_field
    from ...models.proof.certificate import read_certificate
    from ...models.proof.tightening import windows_left
    from ..bundle.manifest import write_all
    from ..formats.registry import DEFAULTS, FORMATS

    formulations = formulations_of(formulation)
    formats = known(file_format or list(DEFAULTS), FORMATS, "format")
    with progress(quiet=quiet) as show:
        show("reading the sketch")
        choice = choice_of(silhouette, curvature, view)
        loaded = load(
            instance,
            size,
            mask,
            gauge,
            choice,
            stroke_weight=stroke_weight,
            skew_weight=skew_weight,
            quiet=quiet,
        )
        field = None if start is None else read_field(start, on=loaded)
        proof = None
        if tightened is not None:
            show("checking the certificate")
            proof = read_certificate(tightened, on=loaded)
        manifests = write_all(
            loaded,
            output,
            formulations=formulations,
            formats=formats,
            start=field,
            jumps_of=None if proof is None else proof.field,
            windows=None if proof is None else windows_left(proof),
            options=options_of(facet, stroke_norm, beta_norm, relax=relax),
            dialects=_dialects(gams_layout, nl_form),
            compress=compress,
            jobs=jobs,
            progress=show,
        )
    if as_json:
        say_json([manifest.document for manifest in manifests])
    elif not quiet:
        show_manifests(manifests, output)


command("solve")(solve_command)
command("prove")(prove_command)
command("evaluate")(evaluate_command)


@command("read")
def read_command(
    solution: Annotated[
        Path,
        typer.Argument(
            metavar="SOLUTION",
            help="A solution file of {answers}, plain or .gz; which of them is seen from its content.",
        ),
    ],
    manifest: Annotated[
        Path,
        typer.Option(
            "--manifest",
            metavar="FILE",
            help="The .manifest.json that `crossfield export` wrote beside the file that was solved.",
        ),
    ],
    output: Output,
    *,
    tolerance: Annotated[
        float,
        typer.Option(
            "--tolerance",
            metavar="X",
            min=0,
            help="How far the answer may break a row or a bound, and how far, relatively, its objective"
            " may be off, before it is refused.",
        ),
    ] = 1e-5,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Read a solver's solution file back as a cross field, and check it.

    Objective and violations are computed again from the instance. Where they contradict what the file claims,
    or the solver says that its values are no answer, no field is written and the exit code is 1.
    """
    from ...models.errors import SolutionError
    from ...models.field.file import write_field
    from ..bundle.manifest import read_manifest
    from ..solutions.solution import read_solution

    require_suffix(output, SAVED)
    with progress(quiet=quiet) as show:
        show("reading the solution")
        described = read_manifest(manifest)
        problem = described.problem()
        found = read_solution(solution, problem, held=described.held(problem), tolerance=tolerance)
        if found.point is None:
            raise InputError(
                f"holds no point: {found.status}; {found.message or 'the solver says no more'}", file=solution
            )
        if not found.doubt:
            write_field(found.field, output)
    tell_solution(found, None if found.doubt else output, quiet=quiet, as_json=as_json)
    if found.doubt:
        raise SolutionError(
            f"{found.doubt}; no field was written (--tolerance X allows for more)", file=solution
        )


@command("draw")
def draw_command(
    what: Annotated[
        Path,
        typer.Argument(
            metavar="FIELD|INSTANCE", help="File of a field (.npz, .json, .rawfield) or an instance."
        ),
    ],
    output: Output,
    *,
    on: On = None,
    kind: Annotated[
        str | None,
        typer.Option(
            "--kind",
            metavar="NAME",
            help="{pictures}; by default layers for a field as SVG or --over a drawing, else what the file"
            " holds.",
        ),
    ] = None,
    over: Over = None,
    title: Annotated[str | None, typer.Option("--title", help="A line above the picture.")] = None,
    quiet: Quiet = False,
) -> None:
    """Draw a field or an instance as PNG, SVG or PDF.

    A field as SVG has a layer for each of its parts, in the coordinates of the drawing: opened on top of it,
    it fits.
    """
    from ..pictures.draw import SUFFIXES, draw

    require_suffix(output, tuple(SUFFIXES))
    with progress(quiet=quiet) as show:
        show("reading")
        subject = field_or_instance(what, on)
        show("drawing")
        draw(subject, output, kind=kind, underlay=over, title=title)
    if not quiet:
        say(str(output))


command("shade")(shade_command)
command("verify")(verify_command)


@command("list")
def list_command(*, as_json: Json = False) -> None:
    """List formulations, formats, solvers and methods, and which go together."""
    from .tables import tables

    found = tables()
    if as_json:
        say_json({name: rows for name, (_, rows) in found.items()})
    else:
        show_lists(found)


@command("samples")
def samples_command(*, as_json: Json = False) -> None:
    """List the built-in samples."""
    from .tables import sample_rows

    rows = sample_rows()
    if as_json:
        say_json(rows)
    else:
        show_samples(rows)


app.add_typer(library, name="library")


def main() -> NoReturn:
    """Run the command line and leave with its exit code; SIGTERM leaves nothing half done either."""
    degrade()
    logging.getLogger("PIL").addHandler(logging.NullHandler())  # an error is one line, and that is ours
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    sys.exit(invoke(sys.argv[1:]))


def invoke(arguments: list[str]) -> int:
    """The exit code of a command line: 0 fine, 1 the request failed, 2 wrong usage; an error is one line.

    With --debug the error itself is raised.
    """
    try:
        app(arguments, prog_name="crossfield")
    except SystemExit as stop:
        if stop.code != _STOPPED:
            return int(stop.code or 0)
        complain(INTERRUPTED)
    except Exception as error:
        if "--debug" in arguments:
            raise
        complain(_line(error))
    return 1


def _line(error: Exception) -> str:
    """What is said of an error."""
    if isinstance(error, CrossfieldError):
        return str(error)
    if isinstance(error, MemoryError):
        return "there is not enough memory; choose a smaller --size"
    if isinstance(error, OSError):
        what = (error.strerror or str(error)).lower()
        return f"{error.filename or 'a file'}: {what}; check the path and the free space"
    what = f"{type(error).__name__}: {shortened(error)}"
    return f"this should not happen, please report it: {what} (crossfield --debug ... shows where)"


def _dialects(gams_layout: str | None, nl_form: str | None) -> dict[str, str]:
    return {name: value for name, value in (("gms", gams_layout), ("nl", nl_form)) if value}
