"""The report of a run: its fields, and what was proven about them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from ...models.field.field import CrossField
from ...models.instance.instance import Instance
from ...models.proof.checkers.check_certificate import gap_of, status_of
from ...models.surface.surface import Surface
from ..bundle.manifest import Manifest
from ..formats.registry import FORMATS, program_version
from ..surfaces.files import SHADED, surface_facts
from .methods import Candidate

CERTIFICATE: Final = "certificate.npz"
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
    bound
        Proven lower bound of the 2-norm energy of all fields, or None.
    seconds
        Seconds of the run until its report was written.
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
    bound: float | None = None
    seconds: float = 0.0
    surface: Surface | None = None
    folder: Path = Path()

    def __repr__(self) -> str:
        bound = "" if self.bound is None else f", bound {self.bound:.6g}"
        best = (
            f", least energy {self.best.field.energy().total:.6g} by {self.best.method}"
            if self.candidates
            else ""
        )
        return f"<Report on {self.instance.name}: {len(self.candidates)} fields{best}{bound}>"

    def moved_to(self, folder: Path) -> Report:
        """The report after its files have moved to another folder."""
        manifests = tuple(manifest.moved_to(folder / "models") for manifest in self.manifests)
        return replace(self, folder=folder, manifests=manifests)

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
        """Whether there is a surface that has settled, which is therefore drawn."""
        return self.surface is not None and not self.surface.interrupted

    def facts(self, candidate: Candidate) -> dict[str, Any]:
        """Facts of a field in the report: its own, and bound and gap if there is a proven bound."""
        facts = candidate.facts()
        if self.bound is None:
            return facts
        return facts | {
            "bound_2_norm": self.bound,
            "gap_2_norm": gap_of(facts["energy_2_norm"], self.bound),
            "proven_optimal": status_of(facts["energy_2_norm"], self.bound) == "optimal",
        }

    @property
    def proof(self) -> dict[str, Any] | None:
        """The proven bound, and the gap to it of the best field; None without a bound."""
        if self.bound is None:
            return None
        facts = self.facts(self.best)
        status = "optimal" if facts["proven_optimal"] else "gap"
        stated = {key: facts[key] for key in ("bound_2_norm", "gap_2_norm")}
        return {"status": status, **stated, "certificate": CERTIFICATE}

    @property
    def files(self) -> int:
        """Number of model files, lists of names and data beside them not counted."""
        files = [entry for manifest in self.manifests for entry in manifest.document["files"]]
        return sum(FORMATS[entry["format"]].is_model(entry["name"]) for entry in files)

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
            "proof": self.proof,
            "methods": [self.facts(candidate) for candidate in self.candidates],
            "surface": self.surface
            and surface_facts(self.surface) | {"picture": SHADED if self.shaded else None},
            "seconds": self.seconds,
            "failures": self.failures,
            "interrupted": self.interrupted or None,
            "files": self.files,
            "refused": {
                m.formulation: m.document["refused"] for m in self.manifests if m.document["refused"]
            },
        }
