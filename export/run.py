"""Everything at once: an instance, all its files, every field that can be had here, pictures, and a report."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from ..models.errors import CrossfieldError
from ..models.field_file import write_field
from ..models.improvement import first_field
from ..models.instance import Instance
from ..models.storage import make_folder, write_bytes
from .formats import generator
from .manifest import Manifest, write_all
from .methods import METHODS, Candidate, Progress, Request, finite, solution_facts
from .solution import Solution
from .solvers import Limits

PICTURES: Final = ("overview", "field", "crosses", "angle")
REPORT: Final = "report.json"


def facts_with_energies(solution: Solution) -> dict[str, Any]:
    """The facts of a solution and, where it has a point, the energies of its field in both norms."""
    facts = solution_facts(solution)
    if solution.point is None:
        return facts
    return facts | {
        "energy_2_norm": finite(solution.field.energy(2).total),
        "energy_1_norm": finite(solution.field.energy(1).total),
    }


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
    progress("greedy field")
    start = first_field(instance)
    manifests = write_all(
        instance,
        folder / "models",
        start=start,
        options=options,
        dialects=dialects,
        jobs=jobs,
        progress=lambda name: progress(f"writing {name}"),
    )
    request = Request(instance, folder / "solve", limits, options or {}, start, progress=progress)
    candidates, failures = list[Candidate](), dict[str, str]()
    for method in (each for each in METHODS.values() if each.in_runs):
        try:
            for candidate in method.find(request):
                candidates.append(candidate)
        except CrossfieldError as error:
            failures[method.name] = str(error)
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
