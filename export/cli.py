"""The command line: the verbs of the package, with progress, tables, exit codes and one-line errors.

Exit codes: 0 fine, 1 the request failed, 2 wrong usage. Heavy libraries are imported inside the commands.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, NoReturn

import typer

from ..models.errors import CrossfieldError, InputError

if TYPE_CHECKING:
    from ..models.instance import Gauge, Instance
    from .run import Report
    from .solution import Solution

Progress = Callable[[str], None]

app = typer.Typer(
    name="crossfield",
    help="From a rough concept sketch to optimization instances, and from solvers' answers back to a cross field.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Folder = Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for the files; made when it is not there.")]
Output = Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="File to write; its suffix decides the kind.")]
Size = Annotated[int, typer.Option("--size", help="Pixels on the longer side of the grid.")]
Mask = Annotated[Path | None, typer.Option("--mask", metavar="FILE", help="Picture of the sketch's size: white = solve.")]
GaugeName = Annotated[
    Literal["strokes", "box"] | None, typer.Option("--gauge", help="Window of alpha: round each stroke (exact), or [0, pi/2] as printed.")
]
Facet = Annotated[Literal["hull", "printed"] | None, typer.Option("--facet", help="Facet (26) of z: of the hull (exact), or as printed.")]
StrokeNorm = Annotated[int | None, typer.Option("--stroke-norm", min=1, max=2, help="Norm of the stroke term where it is open.")]
BetaNorm = Annotated[int | None, typer.Option("--beta-norm", min=1, max=2, help="Norm of the skew term where it is open.")]
Relax = Annotated[bool, typer.Option("--relax", help="Drop integrality.")]
Seconds = Annotated[float, typer.Option("--time-limit", min=0.1, help="Seconds for each solve.")]
Gap = Annotated[float, typer.Option("--gap", min=0.0, help="Relative gap at which a discrete search may stop.")]
Threads = Annotated[int, typer.Option("--threads", min=0, help="Threads of a solver; 0: its own choice.")]
Start = Annotated[Path | None, typer.Option("--start", metavar="FIELD", help="Field (.npz, .json) as starting point, and for the jumps of qp-fixed.")]
GamsLayout = Annotated[Literal["indexed", "scalar"] | None, typer.Option("--gams-layout", help="Sets and equations, or MINLPLib's scalar style.")]
NlForm = Annotated[Literal["text", "binary"] | None, typer.Option("--nl-form", help="Text or binary .nl.")]
Names = Annotated[list[str] | None, typer.Option("-f", "--formulation", metavar="NAME", help="Formulation, may be repeated; all by default.")]
Formats = Annotated[list[str] | None, typer.Option("-F", "--format", metavar="NAME", help="Format, may be repeated; all by default.")]
Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="No progress and no tables.")]
Json = Annotated[bool, typer.Option("--json", help="The result as JSON on standard output.")]

_DEFAULT_SIZE: Final = 24


@app.callback(invoke_without_command=True)
def root(
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")] = False,
    version: Annotated[bool, typer.Option("--version", help="Show the version.", is_eager=True)] = False,
) -> None:
    """Options before the command."""
    _STATE["debug"] = debug
    if version:
        from importlib.metadata import version as installed

        _print(f"crossfield {installed('crossfield')}")
        raise typer.Exit


_STATE: Final = {"debug": False}


@app.command("run")
def run_command(
    sketch: Annotated[str, typer.Argument(metavar="SKETCH|SAMPLE|INSTANCE")],
    output: Folder,
    size: Size = _DEFAULT_SIZE,
    mask: Mask = None,
    gauge: GaugeName = None,
    facet: Facet = None,
    time_limit: Seconds = 60.0,
    gap: Gap = 1e-6,
    threads: Threads = 0,
    gams_layout: GamsLayout = None,
    nl_form: NlForm = None,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Do everything: instance, all solver files, the solves that can be done here, the best field, pictures, a report."""
    from .run import run
    from .solvers import Limits

    with _progress(quiet=quiet) as progress:
        progress("reading the sketch")
        instance = _load(sketch, size, mask, gauge)
        report = run(
            instance, output, limits=Limits(time_limit, gap, threads), options={"facet": facet}, dialects=_dialects(gams_layout, nl_form), progress=progress
        )
    if as_json:
        _print_json(report.document())
    elif not quiet:
        _show_report(report, output)


@app.command("instance")
def instance_command(
    sketch: Annotated[str, typer.Argument(metavar="SKETCH|SAMPLE")],
    output: Output,
    size: Size = _DEFAULT_SIZE,
    mask: Mask = None,
    gauge: GaugeName = None,
    quiet: Quiet = False,
) -> None:
    """Turn a sketch (SVG, bitmap, .scap) or a built-in sample into an instance file (.json or .npz)."""
    from ..models.instance_file import write_instance

    with _progress(quiet=quiet) as progress:
        progress("reading the sketch")
        instance = _load(sketch, size, mask, gauge)
        _require_suffix(output, (".json", ".npz"))
        write_instance(instance, output)
    if not quiet:
        _print(f"{output}: {_described(instance)}")


@app.command("export")
def export_command(
    instance: Annotated[str, typer.Argument(metavar="INSTANCE")],
    output: Folder,
    formulation: Names = None,
    file_format: Formats = None,
    size: Size = _DEFAULT_SIZE,
    gauge: GaugeName = None,
    facet: Facet = None,
    stroke_norm: StrokeNorm = None,
    beta_norm: BetaNorm = None,
    relax: Relax = False,
    start: Start = None,
    gams_layout: GamsLayout = None,
    nl_form: NlForm = None,
    compress: Annotated[bool, typer.Option("--gzip", help="Compress every file.")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Write an instance (or sketch, or sample) as solver files: every formulation in every format, with manifests."""
    from ..models.field_file import read_field
    from ..models.formulations import FORMULATIONS
    from .formats import FORMATS
    from .manifest import write_all

    with _progress(quiet=quiet) as progress:
        manifests = write_all(
            _load(instance, size, None, gauge),
            output,
            formulation or FORMULATIONS,
            file_format or FORMATS,
            start=None if start is None else read_field(start),
            options={"facet": facet, "stroke_norm": stroke_norm, "beta_norm": beta_norm, "relax": relax or None},
            dialects=_dialects(gams_layout, nl_form),
            compress=compress,
            progress=progress,
        )
    if as_json:
        _print_json([manifest.document for manifest in manifests])
    elif not quiet:
        _show_manifests(manifests, output)


@app.command("solve")
def solve_command(
    instance: Annotated[str, typer.Argument(metavar="INSTANCE")],
    output: Folder,
    formulation: Annotated[str, typer.Option("-f", "--formulation", metavar="NAME", help="Formulation to solve.")],
    solver: Annotated[str | None, typer.Option("--solver", metavar="NAME", help="highs, ipopt or bonmin; by default the one for the class.")] = None,
    size: Size = _DEFAULT_SIZE,
    gauge: GaugeName = None,
    facet: Facet = None,
    stroke_norm: StrokeNorm = None,
    beta_norm: BetaNorm = None,
    relax: Relax = False,
    start: Start = None,
    time_limit: Seconds = 60.0,
    gap: Gap = 1e-6,
    threads: Threads = 0,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Solve one formulation here, started from the greedy baseline; leaves file, log, solution and field in the folder."""
    from ..models.field_file import read_field, write_field
    from ..models.formulations import FORMULATIONS
    from ..models.greedy import greedy
    from ..models.problem import formulate
    from .solvers import Limits, solve

    with _progress(quiet=quiet) as progress:
        loaded = _load(instance, size, None, gauge)
        progress("greedy start" if start is None else "reading the start")
        first = greedy(loaded) if start is None else read_field(start)
        fixed = formulation in FORMULATIONS and FORMULATIONS[formulation].fixed
        options = {"facet": facet, "stroke_norm": stroke_norm, "beta_norm": beta_norm, "relax": relax or None}
        problem = formulate(loaded, formulation, p=first.p if fixed else None, **options)
        progress(f"solving {formulation}, at most {time_limit:g} s")
        solution = solve(problem, solver, output, limits=Limits(time_limit, gap, threads), start=first)
        target = output / f"{loaded.name}.{formulation}.field.npz"
        if solution.point is not None:
            write_field(solution.field, target)
    _report_solution(solution, quiet=quiet, as_json=as_json)
    if solution.point is None:
        raise InputError(f"the solver found no point: {solution.status}; give it more time or another start")


@app.command("read")
def read_command(
    solution: Annotated[Path, typer.Argument(metavar="SOLUTION")],
    manifest: Annotated[Path, typer.Option("--manifest", metavar="FILE", help="The .manifest.json that export wrote.")],
    output: Output,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Read a solver's solution file back as a cross field; objective and violations are recomputed."""
    from ..models.field_file import write_field
    from .manifest import read_manifest
    from .solution import read_solution

    with _progress(quiet=quiet) as progress:
        progress("reading the solution")
        found = read_solution(solution, read_manifest(manifest).problem())
        if found.point is None:
            raise InputError(f"holds no point: {found.status}; {found.message or 'the solver says no more'}", file=solution)
        write_field(found.field, output)
    _report_solution(found, quiet=quiet, as_json=as_json)


@app.command("draw")
def draw_command(
    what: Annotated[Path, typer.Argument(metavar="FIELD|INSTANCE")],
    output: Output,
    kind: Annotated[str | None, typer.Option("--kind", metavar="NAME", help="instance, crosses, field, angle, energy or overview.")] = None,
    title: Annotated[str | None, typer.Option("--title", help="A line above the picture.")] = None,
    quiet: Quiet = False,
) -> None:
    """Draw a field or an instance as PNG, SVG or PDF."""
    from .draw import draw

    with _progress(quiet=quiet) as progress:
        progress("reading")
        subject = _field_or_instance(what)
        is_field = hasattr(subject, "alpha")
        progress("drawing")
        draw(subject, output, kind=kind or ("field" if is_field else "instance"), title=title)
    if not quiet:
        _print(str(output))


@app.command("list")
def list_command(as_json: Json = False) -> None:
    """List formulations, formats and solvers, and which go together."""
    from .tables import tables

    if as_json:
        _print_json({name: rows for name, (_, rows) in tables().items()})
        return
    for name, (columns, rows) in tables().items():
        _show_table(name, columns, [[str(row[column]) for column in columns] for row in rows])


@app.command("samples")
def samples_command(as_json: Json = False) -> None:
    """List the built-in samples."""
    from .tables import sample_rows

    rows = sample_rows(_DEFAULT_SIZE)
    if as_json:
        _print_json(rows)
        return
    _show_table("samples", tuple(rows[0]), [[str(value) for value in row.values()] for row in rows])


def main() -> NoReturn:
    """Run the command line and leave with its exit code."""
    sys.exit(invoke(sys.argv[1:]))


def invoke(arguments: list[str]) -> int:
    """The exit code of a command line: 0 fine, 1 the request failed, 2 wrong usage. Errors are one line on standard error."""
    try:
        app(arguments, standalone_mode=True)
    except SystemExit as stop:
        return int(stop.code or 0)
    except CrossfieldError as error:
        if _STATE["debug"]:
            raise
        _complain(str(error))
    except (KeyboardInterrupt, BrokenPipeError):
        _complain("interrupted")
    except MemoryError:
        _complain("there is not enough memory; choose a smaller --size")
    except OSError as error:
        if _STATE["debug"]:
            raise
        _complain(f"{error.filename or 'a file'}: {(error.strerror or str(error)).lower()}")
    return 1


def _load(what: str, size: int, mask: Path | None, gauge: Gauge | None) -> Instance:
    """The instance of an instance file, a sketch file or a built-in sample, in this order."""
    from ..models.instance_file import read_instance
    from ..models.samples import SAMPLES, sample
    from ..models.sketch import read_sketch

    path = Path(what)
    if not path.exists() and what in SAMPLES:
        if mask is not None:
            raise InputError(f"the sample {what} has its own mask; leave --mask out")
        return sample(what, size, gauge or "strokes")
    if not path.exists():
        raise InputError(f"there is no such file and no such sample; `crossfield samples` lists the samples", file=what)
    if path.suffix in {".json", ".npz"}:
        instance = read_instance(path)
        return instance if gauge is None else instance.with_gauge(gauge)
    return read_sketch(path, size=size, mask=mask, gauge=gauge or "strokes")


def _field_or_instance(path: Path) -> Any:
    from ..models.field_file import read_field
    from ..models.instance_file import read_instance

    try:
        return read_field(path)
    except CrossfieldError as field_error:
        try:
            return read_instance(path)
        except CrossfieldError as error:
            raise InputError(f"is neither a field nor an instance: {field_error}") from error


def _require_suffix(path: Path, allowed: tuple[str, ...]) -> None:
    if path.suffix not in allowed:
        raise InputError(f"has the suffix {path.suffix!r}; use {' or '.join(allowed)}", file=path)


def _dialects(gams_layout: str | None, nl_form: str | None) -> dict[str, str]:
    return {name: value for name, value in (("gms", gams_layout), ("nl", nl_form)) if value}


def _described(instance: Instance) -> str:
    grid = instance.grid
    parts = f", {grid.parts} separate parts" if grid.parts > 1 else ""
    return f"{instance.name}, {grid.width} x {grid.height}, {grid.size} pixels, {len(instance.theta)} of them with strokes{parts}, gauge {instance.gauge}"


@contextmanager
def _progress(*, quiet: bool) -> Iterator[Progress]:
    """A function that shows what is being done; on a terminal a spinner with the time, else nothing."""
    from rich.console import Console
    from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield lambda _: None
        return
    with Bar(SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn(), console=console, transient=True) as bar:
        task = bar.add_task("starting")
        yield lambda text: bar.update(task, description=text)


def _show_report(report: Report, output: Path) -> None:
    rows = []
    for candidate in report.candidates:
        facts = candidate.facts()
        mark = "*" if candidate is report.best else ""
        rows.append(
            [
                f"{facts['method']}{mark}",
                f"{facts['energy_2_norm']:.6g}",
                f"{facts['energy_1_norm']:.6g}",
                str(facts["singularities"]),
                f"{facts['mean_abs_beta_degrees']:.2f}",
                f"{facts['seconds']:.2f}",
                str(facts.get("status", "")),
            ]
        )
    columns = ("method", "2-norm energy", "1-norm energy", "singularities", "mean |beta| (deg)", "seconds", "status")
    _show_table(_described(report.instance), columns, rows)
    document = report.document()
    for name, reason in report.failures.items():
        _complain(f"{name}: {reason}")
    _print(f"{document['files']} solver files in {output / 'models'}; * kept as {output / 'field.npz'}, drawn in {output / 'overview.png'}; facts in {output / 'report.json'}")


def _show_manifests(manifests: list[Any], output: Path) -> None:
    rows = []
    for manifest in manifests:
        document = manifest.document
        sizes = {f["format"]: f["bytes"] for f in document["files"] if not f["name"].endswith((".row", ".col"))}
        written = ", ".join(f"{name} {size / 1e3:.0f} kB" for name, size in sizes.items())
        counts = document["counts"]
        rows.append([document["formulation"], document["class"], str(counts["columns"]), str(counts["rows"]), written, ", ".join(document["refused"])])
    _show_table(str(output), ("formulation", "class", "columns", "rows", "written", "refused"), rows)


def _report_solution(solution: Solution, *, quiet: bool, as_json: bool) -> None:
    from .run import solution_facts

    facts = solution_facts(solution)
    if solution.point is not None:
        facts |= {"energy_2_norm": solution.field.energy(2).total, "energy_1_norm": solution.field.energy(1).total}
    if as_json:
        _print_json(facts)
    elif not quiet:
        _show_table(solution.problem.instance.name, ("", "value"), [[key.replace("_", " "), _text(value)] for key, value in facts.items()])


def _text(value: object) -> str:
    return f"{value:.10g}" if isinstance(value, float) else "" if value is None else str(value)


def _show_table(title: str, columns: tuple[str, ...], rows: list[list[str]]) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=escape(title), title_justify="left", header_style="bold")
    for column in columns:
        table.add_column(column, overflow="fold")
    for row in rows:
        table.add_row(*map(escape, row))
    console = Console()
    if not console.is_terminal:
        console = Console(width=160)
    console.print(table)


def _print(text: str) -> None:
    typer.echo(text)


def _print_json(value: object) -> None:
    typer.echo(json.dumps(value, indent=1))


def _complain(text: str) -> None:
    typer.echo(f"crossfield: {text}", err=True)


if __name__ == "__main__":
    main()
