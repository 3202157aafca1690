"""The command line: all commands, exit codes and one-line errors.

Exit codes: 0 success, 1 the request failed, 2 wrong usage. Ctrl-C ends a search with the best field so far,
and a run with a report of the fields so far: exit code 0, with a notice on standard error. If there is no
result to keep, the exit code is 1. Heavy libraries are imported inside the commands.
"""

from __future__ import annotations

import logging
import signal
import sys
from dataclasses import replace
from typing import Annotated, Final, NoReturn

import typer

from ...models.errors import CrossfieldError, InputError, shortened
from ...models.storage import remove_unfinished, replace_results, require_suffix
from ...models.written_files import check_targets
from . import options
from .inputs import (
    SAVED,
    check_names,
    check_output,
    find_drawing,
    full_formulation_names,
    read_described_problem,
    read_field_or_instance,
    read_source,
    read_start,
)
from .library_command import library
from .options import add_command
from .output import (
    escape_unencodable,
    print_line,
    print_notice,
    print_result,
    show_lists,
    show_manifests,
    show_progress,
    show_report,
)
from .prove_command import prove_command
from .shade_command import shade_command
from .solve_command import print_solution, solve_command
from .studio_command import studio_command
from .verify_command import verify_command

app = typer.Typer(
    name="crossfield",
    help="Write a concept sketch as optimization problems for any solver, and turn a solver's answer into a"
    " cross field: two line directions at every pixel.",
    epilog="Example: crossfield run mouse -o out",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

_STOPPED: Final = 130  # exit code of typer after a Ctrl-C that no command handled itself


@app.callback(invoke_without_command=True)
def root(
    *,
    debug: Annotated[  # noqa: ARG001
        bool, typer.Option("--debug", help="Show the traceback of an error.")
    ] = False,
    version: Annotated[bool, typer.Option("--version", help="Show the version.", is_eager=True)] = False,
) -> None:
    """Options before the command; `invoke` reads --debug."""
    if version:
        from importlib.metadata import version as installed

        print_line(f"crossfield {installed('crossfield')}")
        raise typer.Exit


@add_command(app, "run", "crossfield run mouse -o out --time-limit 5")
def run_command(
    source: options.Input,
    output: options.Folder,
    *,
    size: options.Size = None,
    mask: options.Mask = None,
    silhouette: options.Silhouette = "none",
    curvature: options.Curvature = None,
    view: options.View = None,
    stroke_weight: options.StrokeWeight = None,
    time_limit: options.SecondsPerMethod = 60.0,
    threads: options.Threads = 0,
    force: options.Force = False,
    as_json: options.Json = False,
) -> None:
    """Do all steps for one sketch or mesh: write the solver files, try the methods, keep a field and draw it.

    The field of bend is kept; the field of minimum 2-norm energy is written too.
    report.json contains all facts. Ctrl-C ends the run with the fields so far; a second Ctrl-C ends it now.
    """
    from ...models.processes.limits import Limits
    from ..runs.run import plan_sentence, run

    limits = Limits(time_limit, threads=threads)
    with show_progress() as show:
        show("reading the sketch")
        sketch = {"size": size, "mask": mask, "silhouette": silhouette, "curvature": curvature, "view": view}
        instance = read_source(source, stroke_weight=stroke_weight, sketch=sketch)
    if not as_json:
        print_line(plan_sentence(limits, instance))
    with show_progress() as show:
        report = run(
            instance,
            output,
            limits=limits,
            drawing=find_drawing(source),
            mask=mask,
            force=force,
            progress=show,
        )
    print_result(report.document(), lambda: show_report(report, report.folder), as_json=as_json)
    if report.interrupted:
        print_notice(f"interrupted: {report.interrupted}; report.json lists the results so far")
    if report.folder != output:
        print_notice(f"the earlier run stays in {output}; the new results are in {report.folder}")


@add_command(app, "instance", "crossfield instance mouse --size 48 -o mouse.json")
def instance_command(
    source: options.Input,
    output: options.Output,
    *,
    size: options.Size = None,
    mask: options.Mask = None,
    silhouette: options.Silhouette = "none",
    curvature: options.Curvature = None,
    view: options.View = None,
    stroke_weight: options.StrokeWeight = None,
    sharp: options.Sharp = None,
    boundary: options.Boundary = None,
    directions: options.Directions = None,
    weights: options.Weights = "unit",
    sharp_weight: options.SharpWeight = None,
    merge: options.Merge = None,
    crosses: options.Crosses = None,
    indices: options.Indices = None,
    gauge: options.Gauge = None,
    skew_weight: options.SkewWeight = None,
    force: options.Force = False,
) -> None:
    """Write a sketch, a sample or a mesh as an instance (.json, .npz): strokes on pixels or faces.

    Other commands take this file in place of a sketch or a mesh.

    With the suffix .png, write the mask of the instance: white where the field is wanted. Edit it in a paint
    program and pass it to --mask. With .sharp, write the edges of a mesh that have strokes, for QuadWild.
    """
    from ...models.field.exchange import read_sings
    from ...models.instance.file import write_instance
    from ...models.mesh.sharp_edges import write_sharp_edges
    from ..pictures.mask import write_mask

    writers = {
        ".json": write_instance,
        ".npz": write_instance,
        ".png": write_mask,
        ".sharp": write_sharp_edges,
    }
    require_suffix(output, *writers)
    check_output(output, source, mask, directions, indices, force=force)
    with show_progress() as show:
        show("reading the sketch")
        sketch = {"size": size, "mask": mask, "silhouette": silhouette, "curvature": curvature, "view": view}
        of_mesh = {
            "sharp": sharp,
            "boundary": boundary,
            "directions": directions,
            "weights": weights,
            "sharp_weight": sharp_weight,
            "merge": merge,
        }
        instance = read_source(source, stroke_weight=stroke_weight, sketch=sketch, mesh=of_mesh)
        instance = instance.with_weights(skew_weight=skew_weight)
        instance = instance if gauge is None else instance.with_gauge(gauge)
        orthogonal = instance.orthogonal if crosses is None else crosses == "orthogonal"
        prescribed = instance.indices if indices is None else read_sings(indices)
        instance = replace(instance, orthogonal=orthogonal, indices=prescribed)
        writers[output.suffix.lower()](instance, output, force=force)
    print_line(f"{output}: {instance.summary}")


@add_command(app, "export", "crossfield export skew --size 4 -f milp-mccormick -F mps -F lp -o files")
def export_command(
    source: options.Input,
    output: options.Folder,
    *,
    formulation: options.FormulationNames = None,
    file_format: options.FormatNames = None,
    size: options.Size = None,
    facet: options.Facet = None,
    stroke_norm: options.StrokeNorm = None,
    beta_norm: options.BetaNorm = None,
    relax: options.Relax = False,
    limits: options.ResidualLimits = False,
    start: options.Start = None,
    tightened: options.Tightened = None,
    compress: options.Gzip = False,
    force: options.Force = False,
    as_json: options.Json = False,
) -> None:
    """Write an instance as files for solvers, in every formulation and format.

    By default, formulations that the instance cannot have are left out. Each formulation also has a manifest
    (.manifest.json), which `crossfield read` needs.
    """
    from ..bundle.problem_files import write_all
    from ..formats.registry import DEFAULTS, FORMATS

    formulations = full_formulation_names(formulation) if formulation else None
    formats = check_names(file_format or list(DEFAULTS), FORMATS, "format")
    with show_progress() as show:
        show("reading the sketch")
        instance = read_source(source, sketch={"size": size})
        field, jumps_of, windows = read_start(start, instance), None, None
        if tightened is not None:
            from ...models.proof.certificate import read_certificate
            from ...models.proof.tightening import remaining_windows

            show("checking the certificate")
            certificate = read_certificate(tightened, on=instance)
            jumps_of, windows = certificate.field, remaining_windows(certificate)
        manifests = write_all(
            instance,
            output,
            formulations=formulations,
            formats=formats,
            start=field,
            jumps_of=jumps_of,
            windows=windows,
            options={
                "facet": facet,
                "stroke_norm": stroke_norm,
                "beta_norm": beta_norm,
                "relax": relax or None,
                "limits": limits or None,
            },
            compress=compress,
            force=force,
            progress=show,
        )
    documents = [manifest.document for manifest in manifests]
    print_result(
        documents,
        lambda: show_manifests(instance, documents, output, complete=not formulation),
        as_json=as_json,
    )


add_command(app, "solve", "crossfield solve mouse --size 48 --method bend -o field")(solve_command)
add_command(app, "prove", "crossfield prove skew --size 5 -o proof")(prove_command)


@add_command(
    app, "read", "crossfield read skew.sol --manifest files/skew.milp-mccormick.manifest.json -o skew.npz"
)
def read_command(
    solution: options.SolutionFile,
    manifest: options.Manifest,
    output: options.Output,
    *,
    tolerance: options.Tolerance = 1e-5,
    pick: options.Pick = None,
    gap: options.AnswerGap = None,
    bound: options.AnswerBound = None,
    force: options.Force = False,
    as_json: options.Json = False,
) -> None:
    """Read a solver's solution file back as a cross field, and check it.

    Objective and violations are computed again from the instance. If they contradict the file, or if the file
    contains no valid answer, no field is written and the exit code is 1.
    """
    from ...models.errors import SolutionError
    from ...models.field.file import field_names, write_field
    from ..bundle.earlier import keep_better_field, objective_function
    from ..solutions.read import read_solution

    require_suffix(output, *SAVED)
    names, reads = field_names(output.name), [solution, manifest]
    check_targets(output.parent, names, reads=reads, force=force)
    with show_progress() as show:
        show("reading the solution")
        problem, held = read_described_problem(manifest)
        answer = read_solution(
            solution,
            problem,
            held=held,
            tolerance=tolerance,
            solution=pick,
            stated_gap=gap,
            stated_bound=bound,
        )
        if answer.point is None:
            words = (answer.caveat and f"; claims {answer.caveat}") or (answer.doubt and f"; {answer.doubt}")
            raise InputError(
                f"holds no point: {answer.status}; {answer.message or 'the solver gives no reason'}{words}",
                file=solution,
            )
        if not answer.doubt:
            with replace_results(output.parent, names, reads=reads, force=force) as new:
                write_field(answer.field, new.path / output.name)
                if not force:
                    keep_better_field(
                        new,
                        output.name,
                        answer.field,
                        print_notice,
                        on=problem.instance,
                        value=objective_function(problem),
                    )
    print_solution(answer, output, as_json=as_json)
    if answer.doubt:
        remedy = answer.remedy and f"; {answer.remedy}"
        raise SolutionError(f"{answer.doubt}; no field was written{remedy}", file=solution)


@add_command(app, "draw", "crossfield draw field/mouse.bend.field.npz --kind overview -o field.png")
def draw_command(
    source: options.FieldOrInstance,
    output: options.Output,
    *,
    on: options.On = None,
    kind: options.Kind = None,
    underlay: options.Underlay = None,
    up: options.Up = None,
    force: options.Force = False,
) -> None:
    """Draw a field or an instance as PNG or SVG.

    A field as SVG has one layer for each of its parts, in the coordinates of the drawing.
    """
    from ..pictures.draw import SUFFIXES, draw

    require_suffix(output, *SUFFIXES)
    check_output(output, source, on, underlay, force=force)
    with show_progress() as show:
        show("reading")
        subject = read_field_or_instance(source, on)
        show("drawing")
        draw(subject, output, kind=kind, underlay=underlay, up=up, force=force)
    print_line(str(output))


add_command(app, "shade", "crossfield shade field/mouse.bend.field.npz --underlay mouse -o surface")(
    shade_command
)
add_command(app, "studio", "crossfield studio mouse")(studio_command)
add_command(app, "verify", "crossfield verify files --solve 2")(verify_command)


@add_command(app, "list", "crossfield list")
def list_command(*, as_json: options.Json = False) -> None:
    """List samples, formulations, formats, solvers and methods, and their combinations."""
    from .tables import tables

    content = tables()
    print_result(content, lambda: show_lists(content), as_json=as_json)


app.add_typer(library, name="library")


def main() -> NoReturn:
    """Run the command line and exit with its exit code; SIGTERM too removes files that are not complete."""
    escape_unencodable()
    logging.getLogger("PIL").addHandler(logging.NullHandler())  # `invoke` prints every error as one line
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    try:
        sys.exit(invoke(sys.argv[1:]))
    finally:
        remove_unfinished()


def invoke(arguments: list[str]) -> int:
    """Run a command line and return its exit code: 0 success, 1 the request failed, 2 wrong usage.

    An error is printed as one line; with --debug it is raised.
    """
    try:
        app(arguments, prog_name="crossfield")
    except SystemExit as stop:
        if stop.code != _STOPPED:
            return int(stop.code or 0)
        print_notice("interrupted; all written files are complete")
    except Exception as error:
        if "--debug" in arguments:
            raise
        print_notice(_error_line(error))
    return 1


def _error_line(error: Exception) -> str:
    """One line about an error."""
    if isinstance(error, CrossfieldError):
        return str(error)
    if isinstance(error, MemoryError):
        return "there is not enough memory; choose a smaller --size or a coarser mesh"
    if isinstance(error, OSError):
        reason = (error.strerror or str(error)).lower()
        return f"{error.filename2 or error.filename or 'a file'}: {reason}; check the path and the free space"
    reason = f"{type(error).__name__}: {shortened(error)}"
    return f"internal error, please report it: {reason} (crossfield --debug ... shows the traceback)"
