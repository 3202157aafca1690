"""The whole pipeline: an instance, its files, fields by all methods that can run here, pictures, a report."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from ...models.errors import CrossfieldError, SolverError
from ...models.field.field import CrossField
from ...models.field.file import SAME, earlier_field, write_field
from ...models.formulations.choice import list_formulations
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
from ...models.storage import NewResults, replace_results, write_bytes
from ...models.surface.lift import surface
from ...models.surface.surface import Surface
from ...models.written_files import is_unchanged
from ..bundle.problem_files import names_of_set, write_all
from ..formats.registry import DEFAULTS
from ..pictures.draw import ON_MESHES, draw, draw_layers
from ..pictures.mask import has_mask, write_mask
from ..pictures.underlay import Underlay, read_underlay
from ..surfaces.files import NORMALS, SHADED, write_layers
from .methods import METHODS, Candidate, Method, Request, methods_of, time_candidate
from .page import PAGE, REPORT, write_page
from .proven import certify
from .report import CERTIFICATE, KEPT, Report

PICTURES: Final = ("overview", "field", "crosses", "angle", "instance")
OVERLAY: Final = ("overlay.svg", "overlay.png")
"""The field over its drawing: layers in the drawing's coordinates, and the same as a picture."""
LONGEST_LIFT: Final = 10.0
"""Seconds after which the surface's present heights are kept; grids up to 64 pixels take a few."""
MASK: Final = "mask.png"
FIELD: Final = "field.npz"
LOWEST: Final = "lowest.npz"
"""The field of least 2-norm energy."""
START: Final = "start"
"""Name of the field from which the methods of a run start: `first_field`, or the given one."""
EARLIER: Final = "earlier run"
"""Name of a better field that an earlier run in the same folder has found."""
COMPILING: Final = "compiling"


def plan_sentence(limits: Limits, instance: Instance) -> str:
    """A sentence on the time limit of a run's searches, in all and each, and on what has no limit."""
    timed = [method for method in methods_of(instance) if method.timed]
    one_by_one = sum(not (method.in_parallel and _has_processors(limits)) for method in timed)
    names, limit = ", ".join(method.name for method in timed), limits.time_limit
    return (
        f"searches take at most {one_by_one * limit:g} s ({names}: {limit:g} s each); "
        "compiling, files and pictures take more"
    )


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
    - DIR/normals.png, shaded.png: its surface on the page of the drawing, unless time was over
    - DIR/lowest.npz: the field of minimum 2-norm energy
    - DIR/mask.png: the mask, as `read_sketch` accepts it; not for an instance from a file
    - DIR/certificate.npz: the certificate of the proven bound, with the field of the method `prove`
    - DIR/index.html: a page that shows all of these
    - DIR/report.json: written last

    All files appear together at the end; until then those of an earlier run stay, also when it is killed. For
    the same instance, an earlier field of less energy and an earlier certificate of a higher bound count as
    results of this run. If a run is interrupted and has fewer files than an earlier one, all of them go to a
    folder DIR/new-results.

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
        lacking = [name for name in names if not (new.path / name).exists()]
        has_all = not report.interrupted or not any(is_unchanged(folder / name) for name in lacking)
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
    begin = time.perf_counter()
    instance, progress, should_stop = request.instance, request.progress, request.stop
    with _open_parallel_thread(request.limits) as parallel_thread, ExitStack() as stack:
        with _compiling_in_background(instance):
            progress("greedy field")
            start = time_candidate(START, lambda: first_field(instance))
            manifests = write_all(
                instance,
                new.path / "models",
                start=start.field,
                progress=lambda name: progress(f"writing {name}"),
            )
            results = _Results([start])
            request = replace(request, start=start.field)
            _find_fields(results, request, lambda method: not method.timed)
            pressed = stack.enter_context(catch_interrupts())
            request = replace(request, stop=lambda: should_stop() or pressed())
            kept = next((found.field for found in results.candidates if found.method == KEPT), None)
            work = (request, new.path, underlay, kept, results.interrupted)
            parallel_work = parallel_thread.submit(_work_in_parallel, *work)
            results.interrupted = results.interrupted or _compile_functions(request)
        if not request.stop():
            _find_fields(results, request, lambda method: method.timed and not method.in_parallel)
        results.add(parallel_work.result())
        if with_earlier:
            results.add_earlier(earlier_field(new.folder / LOWEST, instance))
        report = Report(instance, results.ranked, tuple(manifests), results.failures)
        for name in (FIELD, "field.json", "field.rawfield"):
            write_field(report.kept.field, new.path / name)
        write_field(report.best.field, new.path / LOWEST)
        bound = _write_certificate(results, new, with_earlier=with_earlier)
        if kept is None:
            draw_pictures(results, report.kept.field, underlay, request, new.path)
    seconds = round(time.perf_counter() - begin, 3)
    return replace(
        report, bound=bound, surface=results.surface, interrupted=results.interrupted, seconds=seconds
    )


def _open_parallel_thread(limits: Limits) -> AbstractContextManager[Executor]:
    """A thread in parallel with the main thread; with one processor, the main thread, which works first."""
    return ThreadPoolExecutor(1) if _has_processors(limits) else process_pool(1)


def _has_processors(limits: Limits) -> bool:
    """Whether a run may occupy more than one processor."""
    return (limits.threads or cores()) > 1


def _work_in_parallel(
    request: Request, folder: Path, underlay: Underlay | None, kept: CrossField | None, interrupted: str
) -> _Results:
    """Find the fields of methods that occupy one processor, and draw the kept field if it is known.

    interrupted: what was interrupted before, so that nothing is done any more.
    """
    results = _Results(interrupted=interrupted)
    _find_fields(results, request, lambda method: method.in_parallel)
    if kept is not None:
        draw_pictures(results, kept, underlay, request, folder)
    return results


@dataclass
class _Results:
    """Fields so far, the surface over the kept one, reasons of what failed, and what Ctrl-C ended first."""

    candidates: list[Candidate] = field(default_factory=list)
    failures: dict[str, str] = field(default_factory=dict)
    interrupted: str = ""
    surface: Surface | None = None

    def add(self, others: _Results) -> None:
        """Add what another thread found; what was interrupted first here counts."""
        self.candidates += others.candidates
        self.failures |= others.failures
        self.interrupted = self.interrupted or others.interrupted
        self.surface = others.surface

    def add_earlier(self, field: CrossField | None) -> None:
        """Add the field of an earlier run, if it is better than all that were found."""
        least = min(candidate.field.energy().total for candidate in self.candidates)
        if field is not None and field.energy().total < least - SAME * (1 + least):
            self.candidates.append(Candidate(EARLIER, field, 0.0))

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


def _find_fields(results: _Results, request: Request, is_chosen: Callable[[Method], bool]) -> None:
    """Add the fields that some methods find, until one is interrupted."""
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


def _write_certificate(results: _Results, new: NewResults, *, with_earlier: bool) -> float | None:
    """Write the certificate of the proven bound and return the bound, None without one.

    with_earlier: whether a certificate of an earlier run with a higher bound counts.
    """
    from ...models.proof.certificate import earlier_bound  # it loads Numba

    bound, path, earlier = None, new.path / CERTIFICATE, new.folder / CERTIFICATE
    try:
        proof = next((found.proof for found in results.candidates if found.proof is not None), None)
        bound = None if proof is None else certify(proof, path).bound
    except CrossfieldError as error:
        results.failures["certificate"] = str(error)
    except KeyboardInterrupt:
        results.interrupted = "certificate"
    known = earlier_bound(earlier, results.candidates[0].field.instance) if with_earlier else None
    if known is None or (bound is not None and known <= bound):
        return bound
    shutil.copyfile(earlier, path)
    return known


def draw_pictures(
    results: _Results, kept: CrossField, underlay: Underlay | None, request: Request, folder: Path
) -> None:
    """Draw the kept field and its surface until Ctrl-C or the caller ends that; not after an interruption.

    A child process draws. Here it would hold up the other thread, because Python runs one of them at a time.
    """
    if results.interrupted:
        return
    on_mesh = isinstance(kept.instance.domain, Mesh)
    stage, subjects = "drawing", {"instance": kept.instance}
    with replace_results(folder, ()) as new, Child() as child:
        calls: dict[str, tuple[Any, ...]] = {
            kind: (partial(draw, kind=kind), subjects.get(kind, kept), new.path / picture_name(kind))
            for kind in (ON_MESHES if on_mesh else PICTURES)
        }
        if not on_mesh:
            calls["overlay"] = (draw_layers, kept, [new.path / name for name in OVERLAY], underlay)
        try:
            for kind, call in calls.items():
                if request.stop():
                    break
                request.progress(f"drawing {kind}")
                child.call(*call)
            results.interrupted = stage if request.stop() else ""
            if not (on_mesh or results.interrupted):
                stage = "surface"
                request.progress("surface over the kept field")
                work = (lift_and_draw, kept, new.path, underlay)
                results.surface, stopped = child.call(*work, stop=request.stop)
                results.interrupted = stage if stopped else ""
        except (KilledError, KeyboardInterrupt):
            results.interrupted = stage
        except CrossfieldError as error:
            results.failures[stage] = str(error)


def lift_and_draw(kept: CrossField, folder: Path, underlay: Underlay | None) -> Surface:
    """Lift a field to a surface, and draw that unless time was over; for a child process."""
    deadline = Deadline.after(LONGEST_LIFT)
    lifted = surface(kept, stop=lambda: deadline.passed() or is_stopped())
    if not lifted.interrupted:
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
