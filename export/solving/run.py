"""The whole pipeline: an instance, its files, fields by all methods that can run here, pictures, a report."""

from __future__ import annotations

import json
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from ...models.arguments import check_arguments
from ...models.errors import CrossfieldError, SolverError
from ...models.field.field import CrossField
from ...models.field.file import write_field
from ...models.instance.grid import Grid
from ...models.instance.instance import Instance
from ...models.instance.mesh import Mesh
from ...models.processes.deadline import Deadline, Over, Progress, Stop, silent, stop_function
from ...models.processes.limits import Limits
from ...models.processes.process_groups import catch_interrupts
from ...models.search.starts import first_field
from ...models.storage import make_folder, remove_file, replacing_files, write_bytes
from ...models.surface.lift import surface
from ..bundle.manifest import Manifest
from ..bundle.problem_files import write_all
from ..pictures.mask import has_mask, write_mask
from ..pictures.underlay import Underlay, read_underlay
from ..surfaces.files import NORMALS, SHADED, write_layers
from .methods import METHODS, Candidate, Request, methods_of
from .proven import ProvenBound
from .report import Report, Stopwatch
from .run_page import REPORT, write_page

PICTURES: Final = ("overview", "field", "crosses", "angle", "instance")
OVERLAY: Final = ("overlay.svg", "overlay.png")
"""The field over its drawing: layers in the drawing's coordinates, and the same as a picture."""
LONGEST_LIFT: Final = 10.0
"""Seconds after which the surface's present heights are kept; grids up to 64 pixels take a few."""
MASK: Final = "mask.png"
LOWEST: Final = "lowest.npz"
"""The field of least 2-norm energy."""
CERTIFICATE: Final = "certificate.npz"
START: Final = "start"
"""Name of the field from which the methods of a run start: `first_field`, or the given one."""
COMPILING: Final = "compiling"


def plan_sentence(limits: Limits, instance: Instance) -> str:
    """A sentence on the time limit of a run's searches, in all and each."""
    timed = [method.name for method in methods_of(instance) if method.timed]
    limits_of_methods = ", ".join(f"{name} {limits.time_limit:g}" for name in timed)
    return f"at most {len(timed) * limits.time_limit:g} s: {limits_of_methods}; files and pictures on top"


@check_arguments
def run(
    instance: Instance,
    folder: str | Path,
    *,
    limits: Limits | None = None,
    drawing: str | Path | None = None,
    progress: Progress = silent,
    stop: Stop | None = None,
) -> Report:
    """Write solver files, compute fields by every method, draw pictures, and write a report.

    The field of the method `bend` is kept, because it has the smallest error at hidden curves
    (docs/evidence.md). Afterwards the folder contains

    - DIR/models: every formulation in every format, starting points, manifests, the instance
    - DIR/solve: input and output of the local solvers
    - DIR/field.npz, .json, .rawfield with .obj and .sings: the kept field
    - DIR/overview.png and other pictures of it; overlay.svg, .png: the same on the drawing
    - DIR/normals.png, shaded.png: its surface on the page of the drawing, without doubts; otherwise
      report.json has the reasons
    - DIR/lowest.npz: the field of minimum 2-norm energy
    - DIR/mask.png: the mask, as `read_sketch` accepts it; not for an instance from a file
    - DIR/certificate.npz: the certificate of the proven bound, with the field of the method `prove`
    - DIR/index.html: a page that shows all of these
    - DIR/report.json: written last

    Files of an earlier run stay until the new ones of their kind are complete, also when the run is killed.

    Orthogonal crosses, and instances on meshes, get the methods that find such fields. On a mesh there are
    two pictures, `instance` and `crosses`, and the page turns the model.

    The report names methods that failed and what interrupted the run. Ctrl-C ends the current method with its
    best field; then no further method is tried and nothing is drawn. Before the solver files are written,
    Ctrl-C raises KeyboardInterrupt.

    Parameters
    ----------
    instance
        The instance.
    folder
        The folder to write to; created if it does not exist.
    limits
        Limits of each method that searches; `Limits()` by default. The first line of `progress` states the
        total.
    drawing
        The file or sample from which the instance was read; it is read first.
    progress
        Receives lines of text.
    stop
        A function that returns whether to stop, or an event, as Ctrl-C does. The solver files are always
        written.

    Returns
    -------
    Report
        All fields, the kept one as `.field`, the manifests, and the proof.

    Raises
    ------
    InputError
        For limits without a time limit, and for a drawing that is unreadable or has another position.
    OutputError
        When a file cannot be written.

    """
    should_stop = stop_function(stop)
    underlay = None if drawing is None else read_underlay(drawing, on=instance)
    limits, folder = Limits.finite_or_default(limits), make_folder(folder)
    progress(plan_sentence(limits, instance))
    watch = Stopwatch()
    with _compiling_in_background(instance):
        progress("greedy field")
        start = first_field(instance)
        watch.lap(START)
        manifests = _write_models(instance, folder, start, progress)
        watch.lap("models")
        request = Request(instance, folder / "solve", limits, start, progress=progress, stop=should_stop)
        results = _Results([Candidate(START, start, watch.stages[START])])
        _find_fields(results, request, watch, timed=False)
        results.interrupted = results.interrupted or _compile_functions(request)
        watch.lap(COMPILING)
    _find_fields(results, request, watch, timed=True)
    report = Report(instance, results.ranked, manifests, results.failures, results.interrupted)
    names = _write_fields(report, folder)
    watch.lap("fields")
    report = _write_certificate(report, folder / CERTIFICATE)
    watch.lap("certificate")
    report, pictures = _draw_all(report, folder, underlay, request, watch)
    report = replace(report, stages=watch.stages)
    names |= pictures | ({CERTIFICATE} if report.proven else set())
    _write_report(report, folder, names)
    return report


def _write_models(
    instance: Instance, folder: Path, start: CrossField, progress: Progress
) -> tuple[Manifest, ...]:
    """Write every formulation in every format to DIR/models; return the manifests."""
    models = folder / "models"
    with replacing_files(models) as new:
        manifests = write_all(instance, new, start=start, progress=lambda name: progress(f"writing {name}"))
    return tuple(replace(manifest, path=models / manifest.path.name) for manifest in manifests)


def _write_fields(report: Report, folder: Path) -> set[str]:
    """Write the kept field, the lowest one and the mask, and return the names of the files."""
    with replacing_files(folder) as new:
        for suffix in (".npz", ".json", ".rawfield"):
            write_field(report.kept.field, new / f"field{suffix}")
        write_field(report.best.field, new / LOWEST)
        if has_mask(report.instance):
            write_mask(report.instance, new / MASK)
        return {path.name for path in new.iterdir()}


@dataclass
class _Results:
    """The fields found so far, the reasons of methods that failed, and the method that Ctrl-C ended."""

    candidates: list[Candidate] = field(default_factory=list)
    failures: dict[str, str] = field(default_factory=dict)
    interrupted: str = ""

    @property
    def ranked(self) -> tuple[Candidate, ...]:
        """The fields by 2-norm energy, lowest first; of those equal up to rounding, the first found."""
        return tuple(
            sorted(self.candidates, key=lambda candidate: float(f"{candidate.field.energy(2).total:.9g}"))
        )


def _compiling_in_background(instance: Instance) -> AbstractContextManager[None]:
    """Compiles the functions of proofs beside what needs none of them, where the methods of a run prove."""
    if METHODS["prove"] not in methods_of(instance):
        return nullcontext()
    from ...models.proof.compiling import compile_in_background  # it loads Numba

    return compile_in_background(orthogonal=instance.orthogonal)


def _compile_functions(request: Request) -> str:
    """Compile what methods need, so that a first run finds what later ones find; the stage if interrupted."""
    if METHODS["prove"] not in methods_of(request.instance):
        return ""
    from ...models.proof.compiling import compile_proofs

    orthogonal = request.instance.orthogonal
    try:
        return "" if compile_proofs(request.progress, request.stop, orthogonal=orthogonal) else COMPILING
    except KeyboardInterrupt:
        return COMPILING
    except SolverError as error:  # the method `prove` tries again, and its failure is in the report
        request.progress(str(error))
    return ""


def _find_fields(results: _Results, request: Request, watch: Stopwatch, *, timed: bool) -> None:
    """Add the fields that the methods with or without a time limit find, until one is interrupted."""
    for method in methods_of(request.instance):
        if results.interrupted:
            break
        if method.timed != timed:
            continue
        try:
            for candidate in method.find(request):
                results.candidates.append(candidate)
                results.interrupted = results.interrupted or (method.name if candidate.interrupted else "")
        except CrossfieldError as error:
            results.failures[method.name] = str(error)
        except KeyboardInterrupt:
            results.interrupted = method.name
        if request.stop():
            results.interrupted = results.interrupted or method.name
        watch.lap(method.name)


def _write_certificate(report: Report, path: Path) -> Report:
    """Write the certificate of the proven bound; return the report with the bound, a failure or Ctrl-C."""
    proof = next((candidate.proof for candidate in report.candidates if candidate.proof is not None), None)
    if proof is None:
        return report
    try:
        return replace(report, proven=ProvenBound.write(proof, path))
    except CrossfieldError as error:
        report.failures["certificate"] = str(error)
    except KeyboardInterrupt:
        return replace(report, interrupted="certificate")
    return report


def _draw_all(
    report: Report, folder: Path, underlay: Underlay | None, request: Request, watch: Stopwatch
) -> tuple[Report, set[str]]:
    """Draw the kept field and its surface, unless the run was interrupted; return the names of the pictures.

    The report says whether Ctrl-C or the caller ended that.
    """
    # An exception at Ctrl-C could be raised in a callback, where Python discards it.
    with catch_interrupts() as pressed, replacing_files(folder) as new:

        def stop() -> bool:
            return request.stop() or pressed()

        if not report.interrupted:
            report = _draw_field(report, new, underlay, request.progress, stop)
            watch.lap("pictures")
        if not report.interrupted and isinstance(report.instance.domain, Grid):
            report = _draw_surface(report, new, underlay, request.progress, stop)
            watch.lap("surface")
        return report, {path.name for path in new.iterdir()}


def _draw_field(
    report: Report, folder: Path, underlay: Underlay | None, progress: Progress, stop: Over
) -> Report:
    """Draw the kept field; return the report, marked where Ctrl-C or the caller ended that."""
    from ..pictures.draw import ON_MESHES, draw, draw_layers

    ended = replace(report, interrupted="drawing")
    on_mesh = isinstance(report.instance.domain, Mesh)
    try:
        for kind in ON_MESHES if on_mesh else PICTURES:
            if stop():
                return ended
            progress(f"drawing {kind}")
            subject = report.instance if kind == "instance" else report.kept.field
            draw(subject, folder / picture_name(kind), kind=kind)
        if stop():
            return ended
        if not on_mesh:
            progress("drawing overlay")
            draw_layers(report.kept.field, [folder / name for name in OVERLAY], underlay)
    except KeyboardInterrupt:
        return ended
    return report


def _draw_surface(
    report: Report, folder: Path, underlay: Underlay | None, progress: Progress, stop: Over
) -> Report:
    """Lift the kept field to a surface, and draw it if nothing speaks against it; return the report."""
    deadline = Deadline.after(LONGEST_LIFT)
    try:
        progress("surface over the kept field")
        lifted = surface(report.kept.field, stop=lambda: deadline.passed() or stop(), progress=progress)
        report = replace(report, surface=lifted, interrupted="surface" if stop() else "")
        if report.surface is not None and report.shaded:
            write_layers(report.surface, folder, underlay)
    except CrossfieldError as error:
        report.failures["surface"] = str(error)
    except KeyboardInterrupt:
        return replace(report, interrupted="surface")
    return report


def _write_report(report: Report, folder: Path, names: set[str]) -> None:
    """Write page and report, and remove files of an earlier run that this one did not replace."""
    document = report.document()
    write_page(folder, document, report.manifests, names, report.kept.field)
    for name in {CERTIFICATE, MASK, NORMALS, SHADED, *OVERLAY, *map(picture_name, PICTURES)} - names:
        remove_file(folder / name)
    write_bytes(folder / REPORT, (json.dumps(document, indent=1, allow_nan=False) + "\n").encode())


def picture_name(kind: str) -> str:
    """The name of the file of a picture."""
    return f"{kind}.png"
