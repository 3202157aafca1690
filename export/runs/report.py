"""The report of a run: its fields, what was proven about them, and the seconds of its stages."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from ...models.field.field import CrossField
from ...models.instance.instance import Instance
from ...models.processes.deadline import Clock
from ...models.surface.surface import Surface
from ..bundle.manifest import Manifest
from ..formats.registry import FORMATS, program_version
from ..surfaces.files import SHADED, surface_facts
from .methods import Candidate
from .proven import ProvenBound

KEPT: Final = "bend"
"""The method whose field is kept; docs/evidence.md has the measurements."""


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
        Seconds of each stage, in order; `waiting` is the wait for what is computed during others.
    surface
        Surface over the kept field; None if the run stopped earlier.
    folder
        The folder of the files.

    """

    instance: Instance
    candidates: tuple[Candidate, ...]
    manifests: tuple[Manifest, ...]
    failures: dict[str, str] = field(default_factory=dict)
    interrupted: str = ""
    proven: ProvenBound | None = None
    stages: dict[str, float] = field(default_factory=dict)
    surface: Surface | None = None
    folder: Path = Path()

    def moved_to(self, folder: Path) -> Report:
        """The report after its files have moved to another folder."""
        manifests = tuple(manifest.moved_to(folder / "models") for manifest in self.manifests)
        proven = self.proven and ProvenBound(self.proven.bound, folder / self.proven.certificate.name)
        return replace(self, folder=folder, manifests=manifests, proven=proven)

    @property
    def best(self) -> Candidate:
        """The field of least 2-norm energy."""
        return self.candidates[0]

    @property
    def kept(self) -> Candidate:
        """The field that is kept and drawn: the bend field, or the best one without it."""
        return next((candidate for candidate in self.candidates if candidate.method == KEPT), self.best)

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
            "generator": program_version(),
            "instance": instance.facts(),
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
