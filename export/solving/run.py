"""The whole pipeline: an instance, its files, fields by all methods that can run here, pictures, a report."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from ...models.arguments import check_arguments
from ...models.errors import CrossfieldError, SolverError
from ...models.field.field import CrossField
from ...models.field.file import write_field
from ...models.instance.instance import Instance
from ...models.processes.deadline import Clock, Deadline, Over, Progress, Stop, never, silent, stop_function
from ...models.processes.groups import catch_interrupts
from ...models.processes.limits import Limits
from ...models.search.starts import first_field
from ...models.storage import make_folder, remove_file, replacing_files, write_bytes
from ...models.surface.lift import surface
from ...models.surface.surface import Surface
from ..bundle.manifest import Manifest, write_all
from ..formats.registry import FORMATS, generator
from ..pictures.drawing import Drawing, read_drawing
from ..pictures.mask import has_mask, write_mask
from ..surfaces.files import SHADED, surface_facts, write_shaded
from .methods import METHODS, Candidate, Request, instance_facts
from .proven import Proven
from .run_page import REPORT, write_page

PICTURES: Final = ("overview", "field", "crosses", "angle", "instance")
OVERLAY: Final = ("overlay.svg", "overlay.png")
"""The field over its drawing: layers in the drawing's coordinates, and the same as a picture."""
LONGEST_LIFT: Final = 10.0
"""Seconds after which the surface's present heights are kept; grids up to 64 pixels take a few."""
MASK: Final = "mask.png"
KEPT: Final = "bend"
"""The method whose field is kept; docs/evidence.md has the measurements."""
LOWEST: Final = "lowest.npz"
"""The field of least 2-norm energy."""
CERTIFICATE: Final = "certificate.npz"
START: Final = "start"
"""Name of the field from which the methods of a run start: `first_field`, or the given one."""
COMPILING: Final = "compiling"


@dataclass(frozen=True, eq=False)
class Report:
    """Results of a run.

    Parameters
    ----------
    instance
        The instance.
    candidates
        Every field that was found, lowest 2-norm energy first.
    manifests
        The sets of model files that were written.
    failures
        Reasons by name of the method that failed.
    interrupted
        The method, `compiling`, `certificate`, `drawing` or `surface` during which the run was interrupted;
        else empty.
    proven
        Proven bound of the 2-norm energy of all fields, or None.
    stages
        Seconds of each stage, in order.
    surface
        Surface over the kept field; None if the run stopped earlier.

    """

    instance: Instance
    candidates: tuple[Candidate, ...]
    manifests: tuple[Manifest, ...]
    failures: dict[str, str] = field(default_factory=dict)
    interrupted: str = ""
    proven: Proven | None = None
    stages: dict[str, float] = field(default_factory=dict)
    surface: Surface | None = None

    @property
    def best(self) -> Candidate:
        """The field of least 2-norm energy."""
        return self.candidates[0]

    @property
    def kept(self) -> Candidate:
        """The field that is kept and drawn: the bend field, or the best one without it."""
        return next((each for each in self.candidates if each.method == KEPT), self.best)

    @property
    def field(self) -> CrossField:
        """The field that is kept."""
        return self.kept.field

    @property
    def shaded(self) -> bool:
        """Whether there is no doubt about the surface, which is therefore drawn."""
        return self.surface is not None and not self.surface.doubts

    def facts(self, candidate: Candidate) -> dict[str, Any]:
        """Facts of a field in the report: its own, and bound and gap if they are proven."""
        facts = candidate.facts()
        return facts if self.proven is None else facts | self.proven.facts(facts["energy_2_norm"])

    @property
    def files(self) -> int:
        """Number of model files, lists of names and data beside them not counted."""
        files = [entry for manifest in self.manifests for entry in manifest.document["files"]]
        return sum(FORMATS[entry["format"]].is_model(entry["name"]) for entry in files)

    @property
    def seconds(self) -> float:
        """All seconds of the run until its report was written: the sum of the stages."""
        return round(sum(self.stages.values()), 3)

    def document(self) -> dict[str, Any]:
        """The report as JSON: instance, methods, files."""
        instance = self.instance
        return {
            "format": "crossfield-report",
            "version": 1,
            "generator": generator(),
            "instance": instance_facts(instance),
            "warnings": list(instance.reading.warnings if instance.reading else ()),
            "kept": self.kept.method,
            "best": self.best.method,
            "proof": self.proven and self.proven.document(self.best.field.energy(2).total),
            "methods": [self.facts(candidate) for candidate in self.candidates],
            "surface": self.surface
            and surface_facts(self.surface) | {"picture": SHADED if self.shaded else None},
            "seconds": self.seconds,
            "stages": self.stages,
            "failures": self.failures,
            "interrupted": self.interrupted or None,
            "files": self.files,
            "refused": {
                m.formulation: m.document["refused"] for m in self.manifests if m.document["refused"]
            },
        }


@dataclass
class Stopwatch:
    """The seconds of consecutive stages, to 3 decimals: their sum is the whole time until the last lap."""

    clock: Clock = time.perf_counter
    stages: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Begin the first stage."""
        self._begin = self.clock()

    def lap(self, stage: str) -> None:
        """End a stage and begin the next one; the rounding error goes to the next one too."""
        passed = self.clock() - self._begin - sum(self.stages.values())
        self.stages[stage] = round(self.stages.get(stage, 0.0) + max(passed, 0.0), 3)


def plan(limits: Limits) -> str:
    """A sentence on the time limit of a run's searches, in all and each."""
    timed = [method.name for method in METHODS.values() if method.timed]
    each = ", ".join(f"{name} {limits.time_limit:g}" for name in timed)
    return f"at most {len(timed) * limits.time_limit:g} s: {each}; files and pictures on top"


@check_arguments
def run(
    instance: Instance,
    folder: str | Path,
    *,
    limits: Limits | None = None,
    options: dict[str, Any] | None = None,
    dialects: dict[str, str] | None = None,
    drawing: str | Path | None = None,
    jobs: int = 1,
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
    - DIR/shaded.png: its surface, without doubts; otherwise report.json has the reasons
    - DIR/lowest.npz: the field of minimum 2-norm energy
    - DIR/mask.png: the mask, as `read_sketch` accepts it; not for an instance from a file
    - DIR/certificate.npz: the certificate of the proven bound, with the field of the method `prove`
    - DIR/index.html: a page that shows all of these
    - DIR/report.json: written last

    Files of an earlier run stay until the new ones of their kind are complete, also when the run is killed.

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
    options
        Options as for `formulate`.
    dialects, jobs
        As for `write_all`.
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
    over = stop_function(stop)
    below = None if drawing is None else read_drawing(drawing, on=instance)
    limits, folder = Limits.bounded(limits), make_folder(folder)
    progress(plan(limits))
    watch = Stopwatch()
    progress("greedy field")
    start = first_field(instance)
    watch.lap(START)
    from ...models.proof.compiling import compiling  # it loads Numba

    with compiling():
        with replacing_files(folder / "models") as new:
            sets = write_all(
                instance,
                new,
                start=start,
                options=options,
                dialects=dialects,
                jobs=jobs,
                progress=lambda name: progress(f"writing {name}"),
            )
        manifests = tuple(replace(each, path=folder / "models" / each.path.name) for each in sets)
        watch.lap("models")
        request = Request(
            instance, folder / "solve", limits, options or {}, start, progress=progress, stop=over
        )
        found = _Found([Candidate(START, start, watch.stages[START])], interrupted=_compiled(request))
        watch.lap(COMPILING)
    if not found.interrupted:
        _find(found, request, watch)
    report = Report(instance, found.ranked, manifests, found.failures, found.interrupted)
    fresh = _write_fields(report, folder)
    watch.lap("fields")
    report = _certified(report, folder / CERTIFICATE)
    fresh |= {CERTIFICATE} if report.proven else set()
    watch.lap("certificate")
    # An exception at Ctrl-C could be raised in a callback, where Python discards it.
    with catch_interrupts() as pressed, replacing_files(folder) as new:
        if not report.interrupted:
            report = _drawn(report, new, below, progress, lambda: over() or pressed())
            watch.lap("pictures")
        if not report.interrupted:
            report = _shaded(report, new, progress, lambda: over() or pressed())
            watch.lap("surface")
        fresh |= {path.name for path in new.iterdir()}
    report = replace(report, stages=watch.stages)
    document = report.document()
    write_page(folder, document, report.manifests, fresh)
    for name in {CERTIFICATE, MASK, SHADED, *OVERLAY, *map(_picture, PICTURES)} - fresh:
        remove_file(folder / name)
    write_bytes(folder / REPORT, (json.dumps(document, indent=1, allow_nan=False) + "\n").encode())
    return report


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
class _Found:
    """The fields found so far, the reasons of methods that failed, and the method that Ctrl-C ended."""

    candidates: list[Candidate] = field(default_factory=list)
    failures: dict[str, str] = field(default_factory=dict)
    interrupted: str = ""

    @property
    def ranked(self) -> tuple[Candidate, ...]:
        """The fields by 2-norm energy, lowest first; of those equal up to rounding, the first found."""
        return tuple(sorted(self.candidates, key=lambda each: float(f"{each.field.energy(2).total:.9g}")))


def _compiled(request: Request) -> str:
    """Compile what methods need, so that a first run finds what later ones find; the stage if interrupted."""
    from ...models.proof.compiling import compile_proofs

    try:
        return "" if compile_proofs(request.progress, request.stop) else COMPILING
    except KeyboardInterrupt:
        return COMPILING
    except SolverError as error:  # the method `prove` tries again, and its failure is in the report
        request.progress(str(error))
    return ""


def _find(found: _Found, request: Request, watch: Stopwatch) -> None:
    """Add the fields that the methods of a run find in turn, until one is interrupted."""
    for method in METHODS.values():
        try:
            for candidate in method.find(request):
                found.candidates.append(candidate)
                found.interrupted = found.interrupted or (method.name if candidate.interrupted else "")
        except CrossfieldError as error:
            found.failures[method.name] = str(error)
        except KeyboardInterrupt:
            found.interrupted = method.name
        if request.stop():
            found.interrupted = found.interrupted or method.name
        watch.lap(method.name)
        if found.interrupted:
            break


def _certified(report: Report, path: Path) -> Report:
    """The report with the proven bound, whose certificate is at the path; a failure or Ctrl-C is recorded."""
    proof = next((each.proof for each in report.candidates if each.proof is not None), None)
    if proof is None:
        return report
    try:
        return replace(report, proven=Proven.by(proof, path))
    except CrossfieldError as error:
        report.failures["certificate"] = str(error)
    except KeyboardInterrupt:
        return replace(report, interrupted="certificate")
    return report


def _drawn(report: Report, folder: Path, below: Drawing | None, progress: Progress, stop: Over) -> Report:
    """The report, its pictures drawn, or marked where Ctrl-C or the caller ended that."""
    from ..pictures.draw import LAYERS, draw

    ended = replace(report, interrupted="drawing")
    try:
        for kind in PICTURES:
            if stop():
                return ended
            progress(f"drawing {kind}")
            subject = report.instance if kind == "instance" else report.kept.field
            draw(subject, folder / _picture(kind), kind=kind)
        for name in OVERLAY:
            if stop():
                return ended
            progress(f"drawing {name}")
            draw(report.kept.field, folder / name, kind=LAYERS, underlay=below)
    except KeyboardInterrupt:
        return ended
    return report


def _shaded(report: Report, folder: Path, progress: Progress, stop: Over = never) -> Report:
    """The report with the surface over its field, which is drawn if nothing speaks against it."""
    deadline = Deadline.after(LONGEST_LIFT)
    try:
        progress("surface over the kept field")
        found = surface(report.kept.field, stop=lambda: deadline.passed() or stop(), progress=progress)
        report = replace(report, surface=found, interrupted="surface" if stop() else "")
        if report.surface is not None and report.shaded:
            write_shaded(report.surface, folder / SHADED)
    except CrossfieldError as error:
        report.failures["surface"] = str(error)
    except KeyboardInterrupt:
        return replace(report, interrupted="surface")
    return report


def _picture(kind: str) -> str:
    return f"{kind}.png"
