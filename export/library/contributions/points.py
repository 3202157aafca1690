"""Points, fields and certificates of others: a library keeps those that improve it.

Angles and jumps of a point have to be feasible; everything else is computed again.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Final

from ....models.errors import CrossfieldError, InputError, SolutionError
from ....models.field import file as fields
from ....models.field.field import CrossField, Norm
from ....models.formulations.catalogue import FORMULATIONS
from ....models.input_limits import MAX_SOLUTION
from ....models.instance.instance import Instance
from ....models.processes.deadline import Progress, silent
from ....models.proof.certificate import read_certificate
from ....models.storage import read_bytes
from ...solutions.read import read_solution
from ...solutions.readers.registry import head_of, recognising_readers
from ..documents.documents import Library, about_file, existing_folder, problem_of, read_about
from ..documents.lock import library_lock
from ..ledger.grades import ACCEPTED_VIOLATION, is_better
from ..ledger.ledger import Record, read_ledger, write_ledger
from ..ledger.points import clipped_field, complete_point
from ..plan.recipe import norm_minimised

_OF_CERTIFICATES: Final = (b"cuts.npy", b"cases.npy")  # names of arrays in the directory of an archive


def add_points(
    library: Library, folder: str | Path, progress: Progress = silent
) -> tuple[dict[Path, list[str]], dict[Path, str]]:
    """Add the files of a folder that improve a library to its ledger; the next build brings it up to date.

    Returns the entries that each point or certificate improves, and the reasons why others are refused. Files
    of other kinds are passed over.
    """
    improved: dict[Path, list[str]] = {}
    refused: dict[Path, str] = {}
    with library_lock(library.folder, "a check of points", progress):
        check = _Check(library)
        for path in sorted(path for path in existing_folder(folder).rglob("*") if path.is_file()):
            progress(f"checking {path}")
            try:
                if (names := check.improved_by(path)) is not None:
                    improved[path] = names
            except CrossfieldError as error:
                refused[path] = str(error)
        write_ledger(library.folder, check.ledger)
    return improved, refused


class _Check:
    """A check of files: the ledger with all improvements so far."""

    def __init__(self, library: Library) -> None:
        self.library, self.ledger = library, read_ledger(library.folder)
        self._bounds: dict[tuple[str, Norm], float] = {}

    def improved_by(self, path: Path) -> list[str] | None:
        """Add a file to the ledger where it is better; return what it improves, None for another kind."""
        data = read_bytes(path, MAX_SOLUTION)
        if any(array in data for array in _OF_CERTIFICATES):
            return self._add_certificate(path, data)
        if path.suffix == ".npz" or fields.FORMAT.encode() in data[:200]:
            return self._add_field(fields.read_field(path), path)
        readers = recognising_readers(head_of(data))
        if not readers or (readers[0].name == "json" and b"alpha_" not in data):  # any JSON may be an answer
            return None
        return self._add_field(self._field_of_solution(path), path)

    def _field_of_solution(self, path: Path) -> CrossField:
        """The field of a solution of the entry with whose name the file's name begins."""
        names = self.library.document["entries"]
        name = max((name for name in names if re.match(rf"{name}([._-]|$)", path.name)), key=len, default="")
        if not name:
            raise InputError("states no entry; begin its name with the name of the entry", file=path)
        problem = problem_of(self.library, self.library.entry(name))
        solution = read_solution(path, problem)
        if solution.point is None or solution.violation is None or solution.unknown:
            raise SolutionError(f"holds no point of {name} ({solution.status})", file=path)
        # Every other column follows from angles and jumps, so a solver's tolerance there does not count.
        violation = problem.violation(complete_point(problem, solution.field))
        worst = max(violation.worst, solution.violation.integrality)
        if worst > ACCEPTED_VIOLATION:
            raise SolutionError(
                f"violates {name} by {worst:.3g}, and {ACCEPTED_VIOLATION:g} is allowed; "
                "use tighter tolerances",
                file=path,
            )
        return clipped_field(solution.problem, solution.point)

    def _add_field(self, field: CrossField, path: Path) -> list[str]:
        """Add a field; return the entries that it improves. One record per optimum holds for all of them."""
        improved, optima = [], set()
        for sidecar in self._sidecars(field.instance, path):
            name, problem = sidecar["name"], problem_of(self.library, sidecar)
            objective = problem.objective_value(complete_point(problem, field))
            if is_better(objective, sidecar["best"]["objective"]):
                improved.append(name)
                optimum = FORMULATIONS[sidecar["formulation"]].minimises, sidecar["options"]["facet"]
                if optimum not in optima:
                    optima.add(optimum)
                    run = Record(name, problem.sha256, "unknown", "unknown", "feasible", objective)
                    self.ledger, _ = self.ledger.with_record(run, field)
        return improved

    def _add_certificate(self, path: Path, data: bytes) -> list[str]:
        """Add a certificate if its bound is better; return the entries whose optimum it bounds."""
        certificate = read_certificate(path)
        instance, norm = certificate.field.instance, certificate.norm
        sidecars = self._sidecars(instance, path, norm)
        stem = sidecars[0]["instance"]["file"].removesuffix(".instance.json")
        stated = read_about(self.library.folder / about_file(stem)).get("certificates", {})
        known = self._bounds.get((stem, norm), stated.get(str(norm), {}).get("bound"))
        if known is not None and not is_better(-certificate.bound, -known):
            return self._add_field(certificate.field, path)
        self._bounds[stem, norm] = certificate.bound
        self.ledger = self.ledger.with_certificate(stem, norm, instance.sha256, data)
        return [sidecar["name"] for sidecar in sidecars]

    def _sidecars(self, instance: Instance, path: Path, norm: Norm | None = None) -> list[dict[str, Any]]:
        """The sidecars of an instance, or of those that minimise a norm. Raises InputError without any."""
        sidecars = [
            sidecar
            for sidecar in self.library.entries
            if sidecar["instance"]["sha256"] == instance.sha256 and "tightened" not in sidecar
            if norm in (None, norm_minimised(sidecar["formulation"], sidecar["options"]["facet"]))
        ]
        if not sidecars:
            raise InputError(f"fits no entry of the library: {instance.summary}, norm {norm}", file=path)
        return sidecars
