"""Everything at once: an instance, all its files, every field that can be had here, pictures, and a report."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from ..models.errors import CrossfieldError
from ..models.field import CrossField
from ..models.field_file import write_field
from ..models.greedy import greedy, power_field
from ..models.instance import Instance
from ..models.storage import make_folder, write_bytes
from .formats import generator
from .manifest import Manifest, write_all
from .solution import Solution
from .solvers import Limits
from .stages import find_jumps, fit_angles

Progress = Callable[[str], None]
PICTURES: Final = ("overview", "field", "crosses", "angle")
REPORT: Final = "report.json"


@dataclass(frozen=True, eq=False)
class Candidate:
    """A field and how it was found: method, seconds, and the solution file's facts where a solver gave it."""

    method: str
    field: CrossField
    seconds: float
    solution: Solution | None = None

    def facts(self) -> dict[str, Any]:
        """What the report says of it: energies in both norms, singularities, skew, and claims beside recomputed values."""
        answer = self.field
        facts: dict[str, Any] = {
            "method": self.method,
            "energy_2_norm": answer.energy(2).total,
            "energy_1_norm": answer.energy(1).total,
            "singularities": len(answer.singularities.index),
            "degenerate_pixels": int(answer.degenerate.sum()),
            "mean_abs_beta_degrees": float(np.degrees(np.abs(answer.beta).mean())),
            "seconds": round(self.seconds, 3),
        }
        return facts if self.solution is None else facts | solution_facts(self.solution)


def solution_facts(solution: Solution) -> dict[str, Any]:
    """What a solution file claims, beside what was recomputed from the instance."""
    violation = solution.violation
    facts = {
        "formulation": solution.problem.name,
        "status": str(solution.status),
        "message": solution.message,
        "objective_reported": solution.reported,
        "objective_recomputed": solution.objective,
        "dual_bound": solution.bound,
        "worst_violation": None if violation is None else violation.worst,
        "worst_family": None if violation is None else violation.worst_family,
        "furthest_rounding": solution.rounded,
        "unknown_names": solution.unknown,
        "interrupted": solution.interrupted,
        "seconds": None if solution.seconds is None else round(solution.seconds, 3),
    }
    return {key: _finite(value) for key, value in facts.items()}


def facts_with_energies(solution: Solution) -> dict[str, Any]:
    """The facts of a solution and, where it has a point, the energies of its field in both norms."""
    facts = solution_facts(solution)
    if solution.point is None:
        return facts
    return facts | {
        "energy_2_norm": solution.field.energy(2).total,
        "energy_1_norm": solution.field.energy(1).total,
    }


def _finite(value: Any) -> Any:
    """The value; None for an infinity, which JSON has not."""
    return None if isinstance(value, float) and not np.isfinite(value) else value


@dataclass(frozen=True, eq=False)
class Report:
    """What a run found. candidates: every field, best (lowest 2-norm energy) first; manifests: the written sets."""

    instance: Instance
    candidates: tuple[Candidate, ...]
    manifests: tuple[Manifest, ...]
    failures: dict[str, str] = field(default_factory=dict)

    @property
    def best(self) -> Candidate:
        """The field that is kept and drawn."""
        return self.candidates[0]

    @property
    def files(self) -> int:
        """Number of solver files, lists of names not counted."""
        names = [entry["name"] for manifest in self.manifests for entry in manifest.document["files"]]
        return sum(not name.removesuffix(".gz").endswith((".row", ".col")) for name in names)

    def document(self) -> dict[str, Any]:
        """The report as JSON: instance, methods, files."""
        instance = self.instance
        return {
            "format": "crossfield-report",
            "version": 1,
            "generator": generator(),
            "instance": {
                "name": instance.name,
                "source": instance.source,
                "gauge": instance.gauge,
                "sha256": instance.sha256,
                "height": instance.grid.height,
                "width": instance.grid.width,
                "pixels": instance.grid.size,
                "pairs": len(instance.grid.first),
                "stroke_pixels": len(instance.theta),
                "parts": instance.grid.parts,
                "pixel_size": instance.pixel_size,
            },
            "best": self.best.method,
            "methods": [candidate.facts() for candidate in self.candidates],
            "failures": self.failures,
            "files": self.files,
            "refused": {
                m.formulation: m.document["refused"] for m in self.manifests if m.document["refused"]
            },
        }


def run(
    instance: Instance,
    folder: str | Path,
    *,
    limits: Limits | None = None,
    options: dict[str, Any] | None = None,
    dialects: dict[str, str] | None = None,
    jobs: int = 1,
    progress: Progress = lambda _: None,
) -> Report:
    """The report of a run; the folder then holds instance, solver files, the best field, pictures and report.json.

        DIR/models     every formulation in every format, manifests, the instance
        DIR/solve      what the local solvers read and left
        DIR/field.npz, .json, .rawfield + .obj; overview.png, field.png, ...
        DIR/report.json   written last: where it is, the run is complete

    A solver that fails is noted in the report; the fields that were found stand. Ctrl-C during a solve ends that solve with
    its best point. Raises OutputError.
    """
    folder = make_folder(folder)
    (folder / REPORT).unlink(missing_ok=True)
    limits = limits or Limits()
    progress("greedy baseline")
    baseline = _timed("greedy", lambda: greedy(instance))
    manifests = write_all(
        instance,
        folder / "models",
        start=baseline.field,
        options=options,
        dialects=dialects,
        jobs=jobs,
        progress=lambda name: progress(f"writing {name}"),
    )
    candidates, failures = [baseline], dict[str, str]()
    for method, search in SEARCHES.items():
        try:
            for candidate in search(baseline.field, folder / "solve", limits, options or {}, progress):
                candidates.append(candidate)  # noqa: PERF402 - those before a failure count
        except CrossfieldError as error:
            failures[method] = str(error)
    # Equal but for rounding: the one that was found first.
    ranked = sorted(candidates, key=lambda candidate: float(f"{candidate.field.energy(2).total:.9g}"))
    report = Report(instance, tuple(ranked), tuple(manifests), failures)
    for suffix in (".npz", ".json", ".rawfield"):
        write_field(report.best.field, folder / f"field{suffix}")
    _draw(report, folder, progress)
    write_bytes(folder / REPORT, (json.dumps(report.document(), indent=1, allow_nan=False) + "\n").encode())
    return report


def _draw(report: Report, folder: Path, progress: Progress) -> None:
    from .draw import draw

    for kind in PICTURES:
        progress(f"drawing {kind}")
        draw(report.best.field, folder / f"{kind}.png", kind=kind)
    draw(report.instance, folder / "instance.png", kind="instance")


def _timed(method: str, find: Callable[[], CrossField]) -> Candidate:
    begin = time.perf_counter()
    found = find()
    return Candidate(method, found, time.perf_counter() - begin)


def _of(method: str, solution: Solution) -> Candidate:
    return Candidate(method, solution.field, solution.seconds or 0.0, solution)


Search = Callable[[CrossField, Path, Limits, dict[str, Any], Progress], Iterator[Candidate]]
"""From the baseline, a folder, limits and options to the fields of a method, one by one: a later one may fail."""


def _fitted(
    start: CrossField, folder: Path, limits: Limits, _options: dict[str, Any], progress: Progress
) -> Iterator[Candidate]:
    progress("Ipopt: angles for the greedy jumps")
    yield _of("greedy + QP", fit_angles(start, folder / "greedy", limits=limits))


def _power(
    start: CrossField, folder: Path, limits: Limits, _options: dict[str, Any], progress: Progress
) -> Iterator[Candidate]:
    progress("power field")
    power = _timed("power field", lambda: power_field(start.instance))
    yield power
    progress("Ipopt: angles for the jumps of the power field")
    yield _of("power field + QP", fit_angles(power.field, folder / "power", limits=limits))


def _two_stages(
    start: CrossField, folder: Path, limits: Limits, options: dict[str, Any], progress: Progress
) -> Iterator[Candidate]:
    progress(f"HiGHS: MILP for the jumps, at most {limits.seconds:g} s; Ctrl-C keeps the best point so far")
    milp = find_jumps(start.instance, folder / "two-stage", limits=limits, start=start, **options)
    yield _of("MILP", milp)
    progress("Ipopt: angles for the jumps of the MILP")
    yield _of("MILP + QP", fit_angles(milp.field, folder / "two-stage", limits=limits))


SEARCHES: Final[dict[str, Search]] = {
    "greedy + QP": _fitted,
    "power field + QP": _power,
    "MILP + QP": _two_stages,
}
"""What a run tries beyond the baseline, by the method it ends with."""
