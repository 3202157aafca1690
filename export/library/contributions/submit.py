"""Submission of files to a library: solutions, fields, certificates, and logs of runs.

Each file is checked completely, and every improvement is added to the ledger in memory. Then the ledger is
written, and one rebuild updates the library, SHA256SUMS last. If a submission is interrupted, the checksum
of ledger.json shows it, and the next submission or build completes it.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, Literal

from ....models.errors import (
    CrossfieldError,
    InputError,
    SolutionError,
    naming,
)
from ....models.field.field import CrossField, Norm
from ....models.field.file import read_field
from ....models.formulations.catalogue import FORMULATIONS
from ....models.formulations.problem import Problem, Violation, stamp_of
from ....models.instance.instance import Instance
from ....models.processes.deadline import Progress, silent
from ....models.proof.certificate import read_certificate
from ....models.storage import read_bytes
from ...formats.registry import generator
from ...solutions.readers.registry import read_raw
from ...solutions.solution import read_solution
from ...statuses import closes
from ...writing.stamps import is_stated
from ..building.build import has_unbuilt_records, rebuilt
from ..documents.documents import Library, about_file, folder_of, problem_of, read_about, read_library
from ..documents.lock import locked
from ..ledger.ledger import FILE as LEDGER
from ..ledger.ledger import Record, RunStatus, log_file, read_ledger, write_ledger
from ..ledger.points import complete_point, field_of
from ..ledger.standing import FEASIBLE, SAME, best_of_each, contradicts, is_better
from ..plan.recipe import norm_minimised
from .logs import SubmittedLog, solver_of
from .sources import Source, sources_of

Outcome = Literal["accepted", "not better", "refused", "skipped"]

_ENTRY: Final = re.compile(r"cf_[a-z0-9_]+")


@dataclass(frozen=True)
class RunFacts:
    """Facts that a submitter states, named as in a record; None if not stated. The log has all others."""

    solver: str | None = None
    version: str | None = None
    machine: str | None = None
    by: str | None = None
    date: str | None = None

    @property
    def record(self) -> Record:
        """A record of these facts alone."""
        solver, version = self.solver or "unknown", self.version or "unknown"
        return Record(
            "cf_none", "0" * 64, solver, version, "feasible", by=self.by, machine=self.machine, date=self.date
        )


_NOTHING_STATED: Final = RunFacts()


@dataclass(frozen=True)
class Submission:
    """Result of submitting a file, or the solution and the log of one run.

    kind: of `Source`. outcome: `skipped` for unknown files in a submitted folder. entries: those that the
    file improves, or else all that it fits. objective, known: of its point and of the best point before, for
    the first entry; status: of that entry afterwards.
    """

    files: tuple[Path, ...]
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
        names = " and ".join(path.name for path in self.files)
        if self.objective is None or self.known is None:
            return f"{names}: not better than the runs of {self.entries[0]} that the library has"
        least = f"a better one is lower by more than {SAME:g} of it"
        return f"{names}: not better: objective {self.objective!r}, and {self.known!r} is known; {least}"


def submit(
    folder: str | Path,
    files: Sequence[str | Path],
    *,
    entry: str | None = None,
    facts: RunFacts = _NOTHING_STATED,
    progress: Progress = silent,
) -> list[Submission]:
    """Check files against a library, keep improvements, rebuild it once, and return a result per file or run.

    files: files and folders; a solution and a log whose names differ only in the suffix are one run. entry:
    the entry of all files; by default crossfield detects it from each file. A refused file changes nothing
    and does not stop the others. Raises InputError for an archive, another version's library, an unknown
    entry, no files, and facts that a ledger cannot hold; OutputError.
    """
    facts.record.check()
    library = read_library(folder_of(folder))
    if library.document["generator"] != generator():
        made = library.document["generator"]
        raise InputError(f"was built by {made}; submit with that version, or build it again", file=folder)
    with locked(library.folder, "a submission", progress):
        if has_unbuilt_records(library):
            library = rebuilt(library.folder, progress=progress)
        if entry is not None:
            library.entry(entry)
        session = _Session(library, entry, facts)
        found = []
        for source in sources_of(files):
            progress(f"checking {' and '.join(each.name for each in source.files)}")
            found.append(session.result(source))
        if any(each.outcome == "accepted" for each in found):
            write_ledger(session.ledger)
            library = rebuilt(library.folder, progress=progress)
        return [
            replace(each, status=library.entry(each.entries[0])["status"]) if each.entries else each
            for each in found
        ]


@dataclass
class _Session:
    """A submission in progress: the ledger with all accepted records."""

    library: Library
    entry: str | None
    facts: RunFacts
    problems: dict[str, Problem] = field(default_factory=dict)
    fields: dict[str, list[CrossField]] = field(default_factory=dict)
    bounds: dict[str, float] = field(default_factory=dict)
    certified: dict[tuple[str, Norm], float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.ledger = read_ledger(self.library.folder)

    def result(self, source: Source) -> Submission:
        """Check a source and add its improvements to the ledger."""
        try:
            if source.error is not None:
                raise source.error
            if source.path and source.kind == "field":
                return self._field(source, source.path)
            if source.path and source.kind == "certificate":
                return self._certificate(source, source.path)
            if source.kind:
                return self._run(source)
            if source.listed:
                what = "is no solution, field, certificate or log; give one of these"
                raise InputError(what, file=source.path)
        except CrossfieldError as error:
            return Submission(source.files, source.kind, "refused", error=error)
        return Submission(source.files, "", "skipped")

    def _problem(self, sidecar: dict[str, Any]) -> Problem:
        """The problem of an entry, formulated once."""
        name = sidecar["name"]
        if name not in self.problems:
            self.problems[name] = problem_of(self.library, sidecar)
        return self.problems[name]

    # the entry of a file

    def _name_of(self, source: Source, log: SubmittedLog | None) -> str:
        """The entry of a run by the stamp of its problem, a name in the log, or the name of a file."""
        stamps = set(log.run.stamps) if log else set()
        path = source.path or source.files[0]
        if source.path is not None:
            raw = read_raw(source.path)
            if not raw.has_point:
                raise SolutionError(f"holds no point ({raw.status})", file=source.path)
            stamps = set(raw.stamps) or stamps
        entries = self.library.entries if stamps else ()
        stamped = {each["name"] for each in entries if is_stated(stamp_of(each["problem_sha256"]), stamps)}
        for found in (stamped, self._named_in(log), {self._by_file_name(path)}):
            if len(found) == 1 and any(found):
                return found.pop()
        raise InputError("does not show its entry; name the entry", file=path)

    def _named_in(self, log: SubmittedLog | None) -> set[str]:
        """The entries that a log names."""
        names = _ENTRY.findall(log.run.text) if log else ()
        return {name for name in names if name in self.library.document["sha256"]}

    def _by_file_name(self, path: Path) -> str:
        """The longest name of an entry with which the file's name begins; empty if there is none."""
        names = self.library.document["entries"]
        return max((each for each in names if re.match(rf"{each}([._-]|$)", path.name)), key=len, default="")

    # runs

    def _run(self, source: Source) -> Submission:
        """Check the solution and the log of a run; keep the best run of its solver, and a better point."""
        log = SubmittedLog.read(source.log) if source.log else None
        sidecar = self.library.entry(self.entry or self._name_of(source, log))
        name, problem = sidecar["name"], self._problem(sidecar)
        found = None if source.path is None else self._point(source.path, sidecar)
        if log is not None:
            log.check(name, problem, self._named_in(log))
        known = self._known(sidecar)
        objective = None if found is None else problem.objective_value(complete_point(problem, found))
        record = self._record(sidecar, log, objective, known)
        better = objective is not None and is_better(objective, known)
        have = self.ledger.of(name, problem.sha256)
        best = log is not None and record not in have and record in best_of_each([*have, record], name)
        if better or best:
            self._add(record, sidecar, found if better else None, log)
        return Submission(
            source.files,
            source.kind,
            "accepted" if better or best else "not better",
            (name,),
            objective=objective,
            known=None if objective is None else known,
            bound=record.bound,
            better_point=better,
        )

    def _record(
        self, sidecar: dict[str, Any], log: SubmittedLog | None, objective: float | None, known: float
    ) -> Record:
        """The record of a run. known: the least objective of the entry's feasible points.

        Raises InputError for facts that the log denies or a ledger cannot hold, SolutionError for a bound
        that a point refutes.
        """
        stated = replace(
            self.facts.record,
            entry=sidecar["name"],
            problem_sha256=sidecar["problem_sha256"],
            solver=solver_of(self.facts.solver, log),
            primal=objective,
        )
        if log is None:
            return stated
        run, digest = log.run, hashlib.sha256(log.content).hexdigest()
        best = known if objective is None else min(known, objective)
        with naming(log.path):
            if run.bound is not None and contradicts(run.bound, best):
                raise SolutionError(
                    f"the bound {run.bound!r} lies above {best!r}, the objective of a feasible point of "
                    f"{stated.entry}; run the solver with tighter tolerances"
                )
            without = objective is None and run.objective is None
            if without and run.bound is None:
                raise InputError("there is nothing to keep; give a log with a bound, or a solution file")
            proves = run.ended == "optimal" and run.bound is not None
            if run.objective is None and run.bound is not None:  # the log could not compare its numbers
                proves = proves and closes(run.bound, best)
            status: RunStatus = "optimal" if proves else "no point" if without else "limit"
            record = replace(
                stated,
                version=self.facts.version or run.version or stated.version,
                status=status,
                bound=run.bound,
                seconds=run.seconds,
                threads=run.threads,
                time_limit=run.limit,
                log=log_file(stated.entry, run.solver, digest),
                log_sha256=digest,
            )
            record.check()
        return record

    def _add(
        self,
        record: Record,
        sidecar: dict[str, Any],
        found: CrossField | None = None,
        log: SubmittedLog | None = None,
    ) -> None:
        self.ledger, _ = self.ledger.added(record, found, log.content if log else None)
        if found is not None:
            self.fields.setdefault(sidecar["instance"]["sha256"], []).append(found)
        if record.bound is not None:
            relatives = [each["entry"] for each in sidecar["equivalent"] if each["entry"] is not None]
            self._raise_bounds([sidecar["name"], *relatives], record.bound)

    def _raise_bounds(self, names: Iterable[str], bound: float) -> None:
        for name in names:
            self.bounds[name] = max(bound, self.bounds.get(name, bound))

    # points

    def _known(self, sidecar: dict[str, Any]) -> float:
        """The least objective of an entry at its best point and at fields accepted in this call."""
        problem = self._problem(sidecar)
        accepted = self.fields.get(sidecar["instance"]["sha256"], [])
        values = [problem.objective_value(complete_point(problem, each)) for each in accepted]
        return float(min([sidecar["best"]["objective"], *values]))

    def _point(self, path: Path, sidecar: dict[str, Any]) -> CrossField:
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
        found = field_of(solution.problem, solution.point)
        self._objective(path, sidecar, found, replace(violation, integrality=solution.violation.integrality))
        return found

    def _objective(
        self, path: Path, sidecar: dict[str, Any], found: CrossField, violation: Violation | None = None
    ) -> float:
        """The objective of a field. Raises SolutionError if it is not feasible or lies below a dual bound."""
        problem = self._problem(sidecar)
        point = complete_point(problem, found)
        _check_feasible(path, sidecar["name"], violation or problem.violation(point))
        objective = problem.objective_value(point)
        bounds = [sidecar["bound"], self.bounds.get(sidecar["name"])]
        bound = max((each for each in bounds if each is not None), default=None)
        if bound is not None and contradicts(bound, objective):
            raise SolutionError(
                f"is feasible with objective {objective!r}, "
                f"but the library has the dual bound {bound!r} of {sidecar['name']}; "
                f"that bound is wrong, take its record out of {LEDGER} first",
                file=path,
            )
        return float(objective)

    def _field(self, source: Source, path: Path) -> Submission:
        """Check a field on every entry of its instance."""
        name = self.entry or (self._by_file_name(path) if path.suffix.lower() == ".rawfield" else "")
        found = read_field(path, on=self._problem(self.library.entry(name)).instance if name else None)
        checked = []
        for sidecar in self._on(path, "field", found.instance):
            objective = self._objective(path, sidecar, found)
            checked.append((sidecar, objective, self._known(sidecar)))
        improved = [each for each in checked if is_better(each[1], each[2])]
        optima = set()
        for sidecar, objective, known in improved:
            # One record per optimum, because a field counts for all entries of its instance.
            optimum = FORMULATIONS[sidecar["formulation"]].minimises, sidecar["options"]["facet"]
            if optimum not in optima:
                optima.add(optimum)
                self._add(self._record(sidecar, None, objective, known), sidecar, found)
        chosen = improved or checked
        return Submission(
            source.files,
            source.kind,
            "accepted" if improved else "not better",
            tuple(sidecar["name"] for sidecar, _, _ in chosen),
            objective=chosen[0][1],
            known=chosen[0][2],
            better_point=bool(improved),
        )

    def _on(self, path: Path, kind: str, instance: Instance) -> list[dict[str, Any]]:
        """The sidecars of an instance, or of the one entry that was named. Raises InputError without any."""
        found = [
            each
            for each in self.library.entries
            if each["instance"]["sha256"] == instance.sha256
            and (self.entry == each["name"] or (self.entry is None and "tightened" not in each))
        ]
        if not found:
            what = f"is a {kind} of an instance that is not in the library: {instance.summary}"
            raise InputError(what, file=path)
        return found

    def _certificate(self, source: Source, path: Path) -> Submission:
        """Check a certificate and keep it if it proves more than the one before."""
        found = read_certificate(path)
        instance, norm = found.field.instance, found.norm
        sidecars = [
            each
            for each in self._on(path, "certificate", instance)
            if norm_minimised(each["formulation"], each["options"]["facet"]) == norm
        ]
        if not sidecars:
            what = f"proves a bound in the norm {norm}, which no entry of {instance.name} minimises"
            raise InputError(what, file=path)
        names = tuple(each["name"] for each in sidecars)
        self._objective(path, sidecars[0], found.field)
        stem = sidecars[0]["instance"]["file"].removesuffix(".instance.json")
        known, before = self._known(sidecars[0]), self._certified_bound(stem, norm)
        better_point = is_better(found.energy, known)
        improves = (
            before is None or is_better(-found.bound, -before) or (better_point and found.bound >= before)
        )
        if improves:
            self.ledger = self.ledger.certified(stem, norm, instance.sha256, read_bytes(path), self.facts.by)
            self.certified[stem, norm] = found.bound
            self.fields.setdefault(instance.sha256, []).append(found.field)
            self._raise_bounds(names, found.bound)
        return Submission(
            source.files,
            source.kind,
            "accepted" if improves else "not better",
            names,
            objective=found.energy,
            known=known,
            bound=found.bound,
            better_point=improves and better_point,
        )

    def _certified_bound(self, instance: str, norm: Norm) -> float | None:
        """The bound of the certificate that the library has of an instance in a norm."""
        about = read_about(self.library.folder / about_file(instance))
        stated: float | None = about.get("certificates", {}).get(str(norm), {}).get("bound")
        return self.certified.get((instance, norm), stated)


def _check_feasible(path: Path, entry: str, found: Violation) -> None:
    """Raise SolutionError, with the worst violations, unless a point is feasible."""
    if found.worst <= FEASIBLE:
        return
    worst = f" (family {found.worst_family})" if found.rows > FEASIBLE else ""
    raise SolutionError(
        f"is not a feasible point of {entry}: violations of rows {found.rows:.3g}{worst}, "
        f"bounds {found.bounds:.3g}, integrality "
        f"{found.integrality:.3g}, and {FEASIBLE:g} is allowed; let the solver use tighter tolerances",
        file=path,
    )
