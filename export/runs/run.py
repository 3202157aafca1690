"""The whole pipeline: an instance, its files, fields by all methods that can run here, pictures, a report."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Final

from ...models.errors import CrossfieldError, SolverError
from ...models.field.field import CrossField
from ...models.field.file import SAME, earlier_field, write_field
from ...models.formulations.catalogue import list_formulations
from ...models.instance.grid import Grid
from ...models.instance.instance import Instance
from ...models.instance.mesh import Mesh
from ...models.processes.child import Child, KilledError
from ...models.processes.child_program import is_stopped
from ...models.processes.deadline import Deadline, Progress, Stop, silent, stop_function
from ...models.processes.job_counts import cores
from ...models.processes.limits import Limits
from ...models.processes.process_groups import catch_interrupts
from ...models.processes.process_pool import process_pool
from ...models.search.starts import first_field
from ...models.storage import NewResults, make_folder, replace_results, write_bytes
from ...models.surface.lift import surface
from ...models.surface.surface import Surface
from ...models.written_files import is_unchanged
from ..bundle.problem_files import names_of_set, write_all
from ..formats.registry import DEFAULTS
from ..pictures.draw import ON_MESHES, draw, draw_layers
from ..pictures.mask import has_mask, write_mask
from ..pictures.underlay import Underlay, read_underlay
from ..surfaces.files import NORMALS, SHADED, write_layers
from .methods import METHODS, Candidate, Method, Request, methods_of
from .page import PAGE, REPORT, write_page
from .proven import ProvenBound
from .report import KEPT, Report, Stopwatch

PICTURES: Final = ("overview", "field", "crosses", "angle", "instance")
OVERLAY: Final = ("overlay.svg", "overlay.png")
"""The field over its drawing: layers in the drawing's coordinates, and the same as a picture."""
LONGEST_LIFT: Final = 10.0
"""Seconds after which the surface's present heights are kept; grids up to 64 pixels take a few."""
MASK: Final = "mask.png"
FIELD: Final = "field.npz"
LOWEST: Final = "lowest.npz"
"""The field of least 2-norm energy."""
CERTIFICATE: Final = "certificate.npz"
START: Final = "start"
"""Name of the field from which the methods of a run start: `first_field`, or the given one."""
EARLIER: Final = "earlier run"
"""Name of a better field that an earlier run in the same folder has found."""
COMPILING: Final = "compiling"
WAITING: Final = "waiting"
"""Stage in which a run waits for the methods and pictures that are computed during search and proof."""


def plan_sentence(limits: Limits, instance: Instance) -> str:
    """A sentence on the time limit of a run's searches, in all and each, and on what has no limit."""
    timed, in_parallel = [method for method in methods_of(instance) if method.timed], _has_processors(limits)
    one_by_one = sum(not (method.in_parallel and in_parallel) for method in timed)
    limits_of_methods = ", ".join(
        f"{method.name} {limits.time_limit:g}{' in parallel' * (method.in_parallel and in_parallel)}"
        for method in sorted(timed, key=lambda method: method.in_parallel)
    )
    total = f"{one_by_one * limits.time_limit:g} s"
    return f"searches take at most {total} ({limits_of_methods}); compiling, files and pictures take more"


def run(
    instance: Instance,
    folder: str | Path,
    *,
    limits: Limits | None = None,
    drawing: str | Path | None = None,
    mask: str | Path | None = None,
    force: bool = False,
    progress: Progress = silent,
    stop: Stop | None = None,
) -> Report:
    """Write solver files, compute fields by every method, draw pictures, and write a report.

    The field of the method `bend` is kept, because it has the smallest mean error at hidden curves from 32
    pixels on (docs/evidence.md; on drawings by others, the difference is not significant).
    Afterwards the folder contains

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

    All files appear together at the end; until then those of an earlier run stay, also when it is killed. For
    the same instance, an earlier field of less energy and an earlier certificate of a higher bound count as
    results of this run. If a run is interrupted, earlier pictures of the same field stay. If it has less than
    an earlier run with another field, all its files go to a folder DIR/new-results.

    Orthogonal crosses, and instances on meshes, get the methods that find such fields. On a mesh there are
    two pictures, `instance` and `crosses`, and the page turns the model.

    The report names methods that failed and what interrupted the run. With more than one processor, the
    method `two-stage` runs in parallel with the search and the proof, and so does a process that draws.
    Ctrl-C ends the current methods with their best fields; then no further method is tried and nothing more
    is drawn.
    Before the solver files are written, Ctrl-C raises KeyboardInterrupt.

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
    mask
        The file of the mask with which it was read. If that is DIR/mask.png, it stays as it is.
    force
        Whether to replace files that crossfield has not written or that have changed since, and better
        results. Drawing and mask are never replaced.
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
        When a file cannot be written, or if others are in the way.

    """
    underlay = None if drawing is None else read_underlay(drawing, on=instance)
    limits, folder = Limits.finite_or_default(limits), Path(folder)
    reads = [path for path in (drawing, mask) if path is not None]
    names = [name for name in _planned_names(instance) if not _is_same_file(folder / name, mask)]
    progress(plan_sentence(limits, instance))
    with replace_results(folder, names, reads=reads, force=force) as new:
        request = Request(instance, new.path / "solve", limits, progress=progress, stop=stop_function(stop))
        report = _find_and_draw(request, new, underlay, with_earlier=not force)
        if MASK not in names:
            shutil.copyfile(folder / MASK, new.path / MASK)  # the page looks for it
            new.kept.add(MASK)
        elif has_mask(instance):
            write_mask(instance, new.path / MASK)
        has_all = not report.interrupted or _take_over(new, names)
        _write_report(report, new.path)
        return report.moved_to(folder if has_all else new.set_aside())


def _planned_names(instance: Instance) -> list[str]:
    """Names of all files that a run may write."""
    sets = [names_of_set(instance, name, DEFAULTS, compress=False) for name in list_formulations(instance)]
    solves = [method.file_names(instance) for method in methods_of(instance)]
    pictures = [*map(picture_name, PICTURES), *OVERLAY, NORMALS, SHADED]
    return [
        *(f"models/{name}" for names in sets for name in names),
        *(f"solve/{name}" for names in solves for name in names),
        *(f"field{suffix}" for suffix in (".npz", ".json", ".obj", ".sings", ".rawfield")),
        *(LOWEST, CERTIFICATE, MASK, *pictures, PAGE, REPORT),
    ]


def _is_same_file(path: Path, other: str | Path | None) -> bool:
    """Whether two paths lead to the same file."""
    return other is not None and path.exists() and Path(other).exists() and path.samefile(other)


def _find_and_draw(
    request: Request, new: NewResults, underlay: Underlay | None, *, with_earlier: bool
) -> Report:
    """Write the solver files, find fields, write them with their certificate, and draw the kept one.

    with_earlier: whether better results of an earlier run count.
    """
    instance, progress, should_stop, watch = request.instance, request.progress, request.stop, Stopwatch()
    with _open_parallel_thread(request.limits) as parallel_thread, ExitStack() as stack:
        with _compiling_in_background(instance):
            progress("greedy field")
            start = first_field(instance)
            watch.lap(START)
            manifests = write_all(
                instance, new.path / "models", start=start, progress=lambda name: progress(f"writing {name}")
            )
            watch.lap("models")
            results = _Results([Candidate(START, start, watch.stages[START])])
            request = replace(request, start=start)
            _find_fields(results, request, lambda method: not method.timed, watch)
            pressed = stack.enter_context(catch_interrupts())
            request = replace(request, stop=lambda: should_stop() or pressed())
            work = (request, new.path, underlay, results.kept_field, results.interrupted)
            parallel_work = parallel_thread.submit(_work_in_parallel, *work)
            results.interrupted = results.interrupted or _compile_functions(request)
            watch.lap(COMPILING)
        if not request.stop():
            _find_fields(results, request, lambda method: method.timed and not method.in_parallel, watch)
        others, pictures = parallel_work.result()
        results.add(others)
        watch.lap(WAITING)
        if with_earlier:
            results.add_earlier(earlier_field(new.folder / LOWEST, instance))
        report = Report(instance, results.ranked, tuple(manifests), results.failures, results.interrupted)
        _write_fields(report, new.path)
        watch.lap("fields")
        report = _write_certificate(report, new, with_earlier=with_earlier)
        watch.lap("certificate")
        if pictures is None:
            pictures = _Pictures(report.kept.field, underlay, request, report.interrupted).draw_all(new.path)
            watch.lap("pictures")
    return replace(
        report,
        surface=pictures.surface,
        failures=report.failures | pictures.failures,
        interrupted=report.interrupted or pictures.interrupted,
        stages=watch.stages,
    )


def _take_over(new: NewResults, names: list[str]) -> bool:
    """Copy what an interrupted run lacks from an earlier run with the same field.

    Returns whether the new files are then no fewer than the earlier ones.
    """
    lacking = [name for name in names if not (new.path / name).exists() and is_unchanged(new.folder / name)]
    earlier = new.folder / FIELD
    if not (is_unchanged(earlier) and earlier.read_bytes() == (new.path / FIELD).read_bytes()):
        return not lacking
    for name in lacking:
        make_folder((new.path / name).parent)
        shutil.copyfile(new.folder / name, new.path / name)
    return True


def _open_parallel_thread(limits: Limits) -> AbstractContextManager[Executor]:
    """A thread in parallel with the main thread; with one processor, the main thread, which works first."""
    return ThreadPoolExecutor(1) if _has_processors(limits) else process_pool(1)


def _has_processors(limits: Limits) -> bool:
    """Whether a run may occupy more than one processor."""
    return (limits.threads or cores()) > 1


def _work_in_parallel(
    request: Request, folder: Path, underlay: Underlay | None, kept: CrossField | None, interrupted: str
) -> tuple[_Results, _Pictures | None]:
    """Find the fields of methods that occupy one processor, and draw the kept field if it is known.

    interrupted: what was interrupted before, so that nothing is done any more.
    """
    results = _Results(interrupted=interrupted)
    _find_fields(results, request, lambda method: method.in_parallel)
    if kept is None:
        return results, None
    return results, _Pictures(kept, underlay, request, results.interrupted).draw_all(folder)


def _write_fields(report: Report, folder: Path) -> None:
    """Write the kept field and the lowest one."""
    for name in (FIELD, "field.json", "field.rawfield"):
        write_field(report.kept.field, folder / name)
    write_field(report.best.field, folder / LOWEST)


@dataclass
class _Results:
    """The fields found so far, the reasons of methods that failed, and the method that Ctrl-C ended."""

    candidates: list[Candidate] = field(default_factory=list)
    failures: dict[str, str] = field(default_factory=dict)
    interrupted: str = ""

    def add(self, others: _Results) -> None:
        """Add what another thread found; what was interrupted first here counts."""
        self.candidates += others.candidates
        self.failures |= others.failures
        self.interrupted = self.interrupted or others.interrupted

    def add_earlier(self, field: CrossField | None) -> None:
        """Add the field of an earlier run, if it is better than all that were found."""
        least = min(candidate.field.energy().total for candidate in self.candidates)
        if field is not None and field.energy().total < least - SAME * (1 + least):
            self.candidates.append(Candidate(EARLIER, field, 0.0))

    @property
    def kept_field(self) -> CrossField | None:
        """The field that is kept whatever else is found; None if that is still open."""
        return next((found.field for found in self.candidates if found.method == KEPT), None)

    @property
    def ranked(self) -> tuple[Candidate, ...]:
        """The fields by 2-norm energy, lowest first; of those equal up to rounding, the first found."""
        return tuple(
            sorted(self.candidates, key=lambda candidate: float(f"{candidate.field.energy(2).total:.9g}"))
        )


def _compiling_in_background(instance: Instance) -> AbstractContextManager[None]:
    """Compiles the functions of proofs while the run does what needs none of them, if its methods prove."""
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


def _find_fields(
    results: _Results,
    request: Request,
    is_chosen: Callable[[Method], bool],
    watch: Stopwatch | None = None,
) -> None:
    """Add the fields that some methods find, until one is interrupted; the watch has a lap for each."""
    for method in methods_of(request.instance):
        if results.interrupted:
            break
        if not is_chosen(method):
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
        if watch is not None:
            watch.lap(method.name)


def _write_certificate(report: Report, new: NewResults, *, with_earlier: bool) -> Report:
    """Write the certificate of the proven bound; return the report with the bound, a failure or Ctrl-C.

    with_earlier: whether a certificate of an earlier run with a higher bound counts.
    """
    from ...models.proof.certificate import earlier_bound  # it loads Numba

    proof = next((candidate.proof for candidate in report.candidates if candidate.proof is not None), None)
    path = new.path / CERTIFICATE
    try:
        if proof is not None:
            report = replace(report, proven=ProvenBound.write(proof, path))
    except CrossfieldError as error:
        report.failures["certificate"] = str(error)
    except KeyboardInterrupt:
        report = replace(report, interrupted="certificate")
    earlier = earlier_bound(new.folder / CERTIFICATE, report.instance) if with_earlier else None
    if earlier is not None and (report.proven is None or earlier > report.proven.bound):
        shutil.copyfile(new.folder / CERTIFICATE, path)
        report = replace(report, proven=ProvenBound(earlier, path))
    return report


@dataclass
class _Pictures:
    """Pictures of the kept field and its surface, drawn in a child process.

    In this process they would hold up the other thread, because Python runs one of them at a time.

    failures: reasons by name of what is missing. interrupted: `drawing` or `surface` if
    Ctrl-C or the caller ended that; before, what they ended earlier, so that nothing is drawn.
    """

    kept: CrossField
    underlay: Underlay | None
    request: Request
    interrupted: str
    surface: Surface | None = None
    failures: dict[str, str] = field(default_factory=dict)

    def draw_all(self, folder: Path) -> _Pictures:
        """Draw the field and its surface, unless the run was interrupted; return itself."""
        if self.interrupted:
            return self
        with replace_results(folder, ()) as new, Child() as child:
            try:
                self._draw_field(child, new.path)
                if not self.interrupted and isinstance(self.kept.instance.domain, Grid):
                    self._draw_surface(child, new.path)
            except KeyboardInterrupt:
                self.interrupted = "drawing"
        return self

    def _draw_field(self, child: Child, folder: Path) -> None:
        """Draw the field, until Ctrl-C or the caller ends that."""
        on_mesh = isinstance(self.kept.instance.domain, Mesh)
        for kind in ON_MESHES if on_mesh else PICTURES:
            if self.request.stop():
                break
            self.request.progress(f"drawing {kind}")
            subject = self.kept.instance if kind == "instance" else self.kept
            child.call(partial(draw, kind=kind), subject, folder / picture_name(kind))
        if not (on_mesh or self.request.stop()):
            self.request.progress("drawing overlay")
            child.call(draw_layers, self.kept, [folder / name for name in OVERLAY], self.underlay)
        self.interrupted = "drawing" if self.request.stop() else ""

    def _draw_surface(self, child: Child, folder: Path) -> None:
        """Lift the field to a surface, and draw it if nothing speaks against it."""
        self.request.progress("surface over the kept field")
        work = (lift_and_draw, self.kept, folder, self.underlay)
        try:
            self.surface, interrupted = child.call(*work, stop=self.request.stop)
            self.interrupted = "surface" if interrupted else ""
        except KilledError:
            self.interrupted = "surface"
        except CrossfieldError as error:
            self.failures["surface"] = str(error)


def lift_and_draw(kept: CrossField, folder: Path, underlay: Underlay | None) -> Surface:
    """Lift a field to a surface, and draw that if nothing speaks against it; for a child process."""
    deadline = Deadline.after(LONGEST_LIFT)
    lifted = surface(kept, stop=lambda: deadline.passed() or is_stopped())
    if not lifted.doubts:
        write_layers(lifted, folder, underlay)
    return lifted


def _write_report(report: Report, folder: Path) -> None:
    """Write page and report."""
    document = report.document()
    names = {path.name for path in folder.iterdir()}
    write_page(folder, document, report.manifests, names, report.kept.field)
    write_bytes(folder / REPORT, (json.dumps(document, indent=1, allow_nan=False) + "\n").encode())


def picture_name(kind: str) -> str:
    """The name of the file of a picture."""
    return f"{kind}.png"
