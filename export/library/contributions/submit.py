"""Submission of files to a library: solutions, fields and certificates.

Each file is checked completely, and every improvement is added to the ledger in memory. Then the ledger is
written, and one rebuild updates the library, SHA256SUMS last. If a submission is interrupted, the checksum
of ledger.json shows it, and the next submission or build completes it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, Literal

from ....models.errors import CrossfieldError, InputError, SolutionError
from ....models.field.field import CrossField, Norm
from ....models.field.file import read_field
from ....models.formulations.catalogue import FORMULATIONS
from ....models.formulations.problem import Problem, Violation, stamp_of
from ....models.instance.instance import Instance
from ....models.processes.deadline import Progress, silent
from ....models.proof.certificate import read_certificate
from ....models.storage import read_bytes
from ...formats.registry import program_version
from ...solutions.readers.registry import read_raw
from ...solutions.solution import read_solution
from ...solvers_table import SOLVERS
from ...writing.stamps import is_stated
from ..building.build import has_unbuilt_records, rebuild_locked
from ..documents.documents import Library, about_file, existing_folder, problem_of, read_about, read_library
from ..documents.lock import library_lock
from ..ledger.grades import FEASIBLE, SAME, is_better
from ..ledger.ledger import Record, read_ledger, write_ledger
from ..ledger.points import clipped_field, complete_point
from ..plan.recipe import norm_minimised
from .submitted_files import SubmittedFile, find_submitted_files

Outcome = Literal["accepted", "not better", "refused", "skipped"]

_TITLES: Final = {
    name.lower(): solver.title for solver in SOLVERS.values() for name in (solver.name, solver.title)
}
"""Titles of solvers by their names and titles in lower case."""


@dataclass(frozen=True)
class RunFacts:
    """Facts that a submitter states, named as in a record; None if not stated."""

    solver: str | None = None
    version: str | None = None
    machine: str | None = None
    by: str | None = None
    date: str | None = None

    def record(self, sidecar: dict[str, Any], objective: float) -> Record:
        """Return the record of a point of an entry."""
        solver = self.solver or "unknown"
        return Record(
            sidecar["name"],
            sidecar["problem_sha256"],
            _TITLES.get(solver.lower(), solver),
            self.version or "unknown",
            "feasible",
            primal=objective,
            by=self.by,
            machine=self.machine,
            date=self.date,
        )


_NOTHING_STATED: Final = RunFacts()


@dataclass(frozen=True)
class Submission:
    """Result of submitting a file.

    kind: of `SubmittedFile`. outcome: `skipped` for unknown files in a submitted folder. entries: those that
    the file improves, or else all that it fits. objective, known: of its point and of the best point before,
    for the first entry; status: of that entry afterwards.
    """

    file: Path
    kind: str
    outcome: Outcome
    entries: tuple[str, ...] = ()
    objective: float | None = None
    known: float | None = None
    bound: float | None = None
    better_point: bool = False
    status: str | None = None
    error: CrossfieldError | None = None

    @property
    def reason(self) -> str:
        """Why nothing was kept, with the tolerance; empty for an accepted or skipped file."""
        if self.error is not None:
            return str(self.error)
        if self.outcome != "not better":
            return ""
        return (
            f"{self.file.name}: not better: objective {self.objective!r}, and {self.known!r} is known; "
            f"a better one is lower by more than {SAME:g} of it"
        )


def submit(
    folder: str | Path,
    files: Sequence[str | Path],
    *,
    entry: str | None = None,
    facts: RunFacts = _NOTHING_STATED,
    progress: Progress = silent,
) -> list[Submission]:
    """Check files against a library, keep improvements, rebuild it once, and return a result per file.

    files: files and folders; entry: the entry of all files; by default crossfield detects it from each file.
    A refused file changes nothing and does not stop the others. Raises InputError for an archive, another
    version's library, an unknown entry, no files, and facts that a ledger cannot hold; OutputError.
    """
    facts.record({"name": "cf_none", "problem_sha256": "0" * 64}, 0.0).check()
    library = read_library(existing_folder(folder))
    if library.document["generator"] != program_version():
        builder = library.document["generator"]
        raise InputError(f"was built by {builder}; submit with that version, or build it again", file=folder)
    with library_lock(library.folder, "a submission", progress):
        if has_unbuilt_records(library):
            library = rebuild_locked(library.folder, progress=progress)
        if entry is not None:
            library.entry(entry)
        session = _SubmitSession(library, entry, facts)
        results = []
        for submitted in find_submitted_files(files):
            progress(f"checking {submitted.path.name}")
            results.append(session.check(submitted))
        if any(result.outcome == "accepted" for result in results):
            write_ledger(session.ledger)
            library = rebuild_locked(library.folder, progress=progress)
        return [
            replace(result, status=library.entry(result.entries[0])["status"]) if result.entries else result
            for result in results
        ]


@dataclass
class _SubmitSession:
    """A submission in progress: the ledger with all accepted records.

    problems: by entry; fields: accepted ones by the SHA-256 of their instance; certified: accepted bounds by
    instance and norm.
    """

    library: Library
    entry: str | None
    facts: RunFacts
    problems: dict[str, Problem] = field(default_factory=dict)
    fields: dict[str, list[CrossField]] = field(default_factory=dict)
    certified: dict[tuple[str, Norm], float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.ledger = read_ledger(self.library.folder)

    def check(self, submitted: SubmittedFile) -> Submission:
        """Check a file and add its improvements to the ledger."""
        checks = {
            "solution": self._check_solution,
            "field": self._check_field,
            "certificate": self._check_certificate,
        }
        try:
            if submitted.error is not None:
                raise submitted.error
            if submitted.kind:
                return checks[submitted.kind](submitted.path)
            if submitted.listed:
                reason = "is no solution, field or certificate; give one of these"
                raise InputError(reason, file=submitted.path)
        except CrossfieldError as error:
            return Submission(submitted.path, submitted.kind, "refused", error=error)
        return Submission(submitted.path, "", "skipped")

    def _problem(self, sidecar: dict[str, Any]) -> Problem:
        """The problem of an entry, formulated once."""
        name = sidecar["name"]
        if name not in self.problems:
            self.problems[name] = problem_of(self.library, sidecar)
        return self.problems[name]

    # solutions

    def _check_solution(self, path: Path) -> Submission:
        """Check the solution of an entry, and keep its field if it is better."""
        sidecar = self.library.entry(self.entry or self._entry_of_solution(path))
        solved, known = self._read_field_of_solution(path, sidecar), self._least_objective(sidecar)
        problem = self._problem(sidecar)
        objective = problem.objective_value(complete_point(problem, solved))
        better = is_better(objective, known)
        if better:
            self._keep_field(solved, sidecar, objective)
        return Submission(
            path,
            "solution",
            "accepted" if better else "not better",
            (sidecar["name"],),
            objective=objective,
            known=known,
            better_point=better,
        )

    def _entry_of_solution(self, path: Path) -> str:
        """The entry of a solution by the stamp of its problem, or the name of the file."""
        raw = read_raw(path)
        if not raw.has_point:
            raise SolutionError(f"holds no point ({raw.status})", file=path)
        entries = self.library.entries if raw.stamps else ()
        stamped: set[str] = {
            sidecar["name"]
            for sidecar in entries
            if is_stated(stamp_of(sidecar["problem_sha256"]), raw.stamps)
        }
        if len(stamped) == 1:
            return stamped.pop()
        if name := self._entry_in_file_name(path):
            return name
        raise InputError("does not show its entry; name the entry", file=path)

    def _entry_in_file_name(self, path: Path) -> str:
        """The longest name of an entry with which the file's name begins; empty if there is none."""
        names = self.library.document["entries"]
        return max((name for name in names if re.match(rf"{name}([._-]|$)", path.name)), key=len, default="")

    def _read_field_of_solution(self, path: Path, sidecar: dict[str, Any]) -> CrossField:
        """The field of a solution. Raises SolutionError unless its angles and jumps are feasible."""
        name, problem = sidecar["name"], self._problem(sidecar)
        solution = read_solution(path, problem)
        if solution.point is None or solution.violation is None:
            raise SolutionError(f"holds no point ({solution.status})", file=path)
        if solution.unknown:
            raise SolutionError(
                f"{solution.unknown} of its names are not in {name}; name the entry of this point",
                file=path,
            )
        # Every other column follows from angles and jumps, so a solver's tolerance there does not count.
        violation = problem.violation(complete_point(problem, solution.field))
        clipped = clipped_field(solution.problem, solution.point)
        integrality = solution.violation.integrality
        self._check_objective(path, sidecar, clipped, replace(violation, integrality=integrality))
        return clipped

    # fields

    def _check_field(self, path: Path) -> Submission:
        """Check a field on every entry of its instance, and keep it if it is better on one of them."""
        name = self.entry or (self._entry_in_file_name(path) if path.suffix.lower() == ".rawfield" else "")
        submitted = read_field(path, on=self._problem(self.library.entry(name)).instance if name else None)
        checked = []
        for sidecar in self._sidecars_of(path, "field", submitted.instance):
            objective = self._check_objective(path, sidecar, submitted)
            checked.append((sidecar, objective, self._least_objective(sidecar)))
        improved = [(sidecar, value, known) for sidecar, value, known in checked if is_better(value, known)]
        optima = set()
        for sidecar, objective, _ in improved:
            # One record per optimum, because a field counts for all entries of its instance.
            optimum = FORMULATIONS[sidecar["formulation"]].minimises, sidecar["options"]["facet"]
            if optimum not in optima:
                optima.add(optimum)
                self._keep_field(submitted, sidecar, objective)
        fitting = improved or checked
        return Submission(
            path,
            "field",
            "accepted" if improved else "not better",
            tuple(sidecar["name"] for sidecar, _, _ in fitting),
            objective=fitting[0][1],
            known=fitting[0][2],
            better_point=bool(improved),
        )

    def _sidecars_of(self, path: Path, kind: str, instance: Instance) -> list[dict[str, Any]]:
        """The sidecars of an instance, or of the one entry that was named. Raises InputError without any."""
        sidecars = [
            sidecar
            for sidecar in self.library.entries
            if sidecar["instance"]["sha256"] == instance.sha256
            and (self.entry == sidecar["name"] or (self.entry is None and "tightened" not in sidecar))
        ]
        if not sidecars:
            reason = f"is a {kind} of an instance that is not in the library: {instance.summary}"
            raise InputError(reason, file=path)
        return sidecars

    # certificates

    def _check_certificate(self, path: Path) -> Submission:
        """Check a certificate and keep it if it proves more than the one before."""
        certificate = read_certificate(path)
        instance, norm = certificate.field.instance, certificate.norm
        sidecars = [
            sidecar
            for sidecar in self._sidecars_of(path, "certificate", instance)
            if norm_minimised(sidecar["formulation"], sidecar["options"]["facet"]) == norm
        ]
        if not sidecars:
            reason = f"proves a bound in the norm {norm}, which no entry of {instance.name} minimises"
            raise InputError(reason, file=path)
        names = tuple(sidecar["name"] for sidecar in sidecars)
        self._check_objective(path, sidecars[0], certificate.field)
        stem = sidecars[0]["instance"]["file"].removesuffix(".instance.json")
        known, before = self._least_objective(sidecars[0]), self._certified_bound(stem, norm)
        better_point = is_better(certificate.energy, known)
        improves = (
            before is None
            or is_better(-certificate.bound, -before)
            or (better_point and certificate.bound >= before)
        )
        if improves:
            data = read_bytes(path)
            self.ledger = self.ledger.with_certificate(stem, norm, instance.sha256, data, self.facts.by)
            self.certified[stem, norm] = certificate.bound
            self.fields.setdefault(instance.sha256, []).append(certificate.field)
        return Submission(
            path,
            "certificate",
            "accepted" if improves else "not better",
            names,
            objective=certificate.energy,
            known=known,
            bound=certificate.bound,
            better_point=improves and better_point,
        )

    def _certified_bound(self, instance: str, norm: Norm) -> float | None:
        """The bound of the certificate that the library has of an instance in a norm."""
        about = read_about(self.library.folder / about_file(instance))
        stated: float | None = about.get("certificates", {}).get(str(norm), {}).get("bound")
        return self.certified.get((instance, norm), stated)

    # points

    def _keep_field(self, better: CrossField, sidecar: dict[str, Any], objective: float) -> None:
        self.ledger, _ = self.ledger.with_record(self.facts.record(sidecar, objective), better)
        self.fields.setdefault(sidecar["instance"]["sha256"], []).append(better)

    def _least_objective(self, sidecar: dict[str, Any]) -> float:
        """The least objective of an entry at its best point and at fields accepted in this call."""
        problem = self._problem(sidecar)
        accepted = self.fields.get(sidecar["instance"]["sha256"], [])
        values = [problem.objective_value(complete_point(problem, field)) for field in accepted]
        return float(min([sidecar["best"]["objective"], *values]))

    def _check_objective(
        self, path: Path, sidecar: dict[str, Any], checked: CrossField, violation: Violation | None = None
    ) -> float:
        """The objective of a field. Raises SolutionError if it is not feasible."""
        problem = self._problem(sidecar)
        point = complete_point(problem, checked)
        _check_feasible(path, sidecar["name"], violation or problem.violation(point))
        return float(problem.objective_value(point))


def _check_feasible(path: Path, entry: str, violation: Violation) -> None:
    """Raise SolutionError, with the worst violations, unless a point is feasible."""
    if violation.worst <= FEASIBLE:
        return
    worst = f" (family {violation.worst_family})" if violation.rows > FEASIBLE else ""
    raise SolutionError(
        f"is not a feasible point of {entry}: violations of rows {violation.rows:.3g}{worst}, "
        f"bounds {violation.bounds:.3g}, integrality "
        f"{violation.integrality:.3g}, and {FEASIBLE:g} is allowed; let the solver use tighter tolerances",
        file=path,
    )
