"""Submission of files to a library: solutions, fields, certificates, logs of runs and ledgers.

Each file is checked completely, and every improvement is added to the ledger in memory. Then the ledger is
written, and one rebuild updates the library, SHA256SUMS last. If a submission is interrupted, the checksum
of ledger.json shows it, and the next submission or build completes it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, Literal

from ....models.errors import CrossfieldError, InputError, SolutionError, naming
from ....models.field.field import CrossField
from ....models.field.file import field_of_json, read_field
from ....models.formulations.catalogue import FORMULATIONS, TWO_NORM
from ....models.formulations.problem import Violation
from ....models.instance.instance import Instance
from ....models.processes.deadline import Progress, silent
from ....models.proof.certificate import read_certificate
from ....models.storage import read_bytes
from ...formats.registry import generator
from ...solutions.readers.registry import read_raw
from ...solutions.solution import read_solution
from ..building.build import rebuilt
from ..building.index import SUMS
from ..checking.finding import FEASIBLE, is_better
from ..documents.documents import Library, about_file, folder_of, read_about, read_library
from ..documents.lock import locked
from ..ledger.ledger import FILE as LEDGER
from ..ledger.ledger import Ledger, Record, read_ledger, write_ledger
from ..ledger.points import complete_point, field_of
from ..ledger.standing import best_of_each, contradicts
from .matching import Entries, Source, sources_of
from .run_record import LogFile, RunFacts, run_record

Outcome = Literal["accepted", "not better", "refused", "skipped"]

_NOTHING_STATED: Final = RunFacts()


@dataclass(frozen=True)
class Submission:
    """Result of submitting a file, or the solution and the log of one run.

    kind: `Kind`, `bound`, or empty if unknown. outcome: `skipped` for unknown files in a submitted folder.
    entries: those that the file improves, or else all that it fits. objective, known: of its point and of the
    best point before, for the first entry; status: of that entry afterwards.
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


def submit(
    folder: str | Path,
    files: Sequence[str | Path] = (),
    *,
    entry: str | None = None,
    facts: RunFacts = _NOTHING_STATED,
    progress: Progress = silent,
) -> list[Submission]:
    """Check files against a library, keep improvements, rebuild it once, and return a result per file or run.

    files: files and folders; a solution and a log whose names differ only in the suffix are one run. entry:
    the entry of all files; by default crossfield detects it from each file. A refused file changes nothing
    and does not stop the others. Raises InputError for an archive, another version's library, an unknown
    entry, and for facts that do not fit the files; OutputError.
    """
    library = _writable(folder)
    with locked(library.folder, "a submission", progress):
        library = _settled(library, progress)
        if entry is not None:
            library.entry(entry)
        session = _Session(library, entry, facts)
        found = []
        for source in sources_of(files, facts):
            progress(f"checking {source.name}")
            found += session.results(source)
        if any(each.outcome == "accepted" for each in found):
            write_ledger(session.ledger)
            library = rebuilt(library.folder, progress=progress)
        return [
            replace(each, status=library.entry(each.entries[0])["status"]) if each.entries else each
            for each in found
        ]


def _writable(folder: str | Path) -> Library:
    """The library in a folder. Raises InputError for an archive or a library of another version."""
    library = read_library(folder_of(folder))
    if library.document["generator"] != generator():
        made = library.document["generator"]
        raise InputError(f"was built by {made}; submit with that version, or build it again", file=folder)
    return library


def _settled(library: Library, progress: Progress) -> Library:
    """The library, rebuilt if an earlier submission was interrupted before its rebuild."""
    digest = hashlib.sha256(read_bytes(library.folder / LEDGER)).hexdigest()
    sums = read_bytes(library.folder / SUMS).decode("utf-8", "replace").splitlines()
    return library if f"{digest}  {LEDGER}" in sums else rebuilt(library.folder, progress=progress)


@dataclass
class _Session:
    """A submission in progress: the ledger with all accepted records."""

    library: Library
    entry: str | None
    facts: RunFacts
    fields: dict[str, list[CrossField]] = field(default_factory=dict)
    bounds: dict[str, float] = field(default_factory=dict)
    certified: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.ledger = read_ledger(self.library.folder)
        self.entries = Entries(self.library)

    def results(self, source: Source) -> list[Submission]:
        """Check a source and add its improvements to the ledger."""
        before = self.ledger
        try:
            if source.error is not None:
                raise source.error
            if not source.kind and source.listed:
                what = "is no solution, field, certificate, log or ledger; give one of these"
                raise InputError(what, file=source.path)
            if not source.kind:
                return [Submission(source.files, "", "skipped")]
            if source.kind == "ledger":
                return list(self._ledger(source))
            check = {"field": self._field, "certificate": self._certificate}.get(source.kind, self._run)
            return [check(source)]
        except CrossfieldError as error:
            self.ledger = before
            return [Submission(source.files, source.kind, "refused", error=error)]

    def _run(self, source: Source) -> Submission:
        """Check the solution, the log and the stated bound of a run."""
        log = LogFile.read(source.log) if source.log else None
        sidecar = self.library.entry(self.entry or self._name_of(source, log))
        found = None if source.path is None else self._point(source.path, sidecar)
        return self._kept(source, sidecar, self.facts, log, found)

    def _name_of(self, source: Source, log: LogFile | None) -> str:
        name = self.entries.of_log(log.log, log.path) if log else ""
        if source.path is not None:
            raw = read_raw(source.path)
            if not raw.has_point:
                raise SolutionError(f"holds no point ({raw.status})", file=source.path)
            return (name if not raw.stamp else "") or self.entries.of_solution(raw, source.path)
        if not name:
            raise InputError("the entry of the run is unknown; name the entry", file=source.log)
        return name

    def _kept(
        self,
        source: Source,
        sidecar: dict[str, Any],
        facts: RunFacts,
        log: LogFile | None,
        found: CrossField | None,
    ) -> Submission:
        """Add a run to the ledger if it is the best of its solver or has a better point."""
        name, problem = sidecar["name"], self.entries.problem(sidecar)
        if log is not None:
            log.check_entry(name, problem, self.entries.named_in(log.log.text))
        known = self.known(sidecar)
        objective = None if found is None else problem.objective_value(complete_point(problem, found))
        record = run_record(name, problem, facts, log, objective=objective, known=known)
        better = objective is not None and is_better(objective, known)
        is_run = log is not None or record.bound is not None
        have = self.ledger.of(name, problem.sha256)
        is_best = is_run and record not in have and record in best_of_each([*have, record], name)
        if better or is_best:
            self._add(record, sidecar, found if better else None, log)
        return Submission(
            source.files,
            source.kind,
            "accepted" if better or is_best else "not better",
            (name,),
            objective=objective,
            known=None if objective is None else known,
            bound=record.bound,
            better_point=better,
        )

    def _add(
        self,
        record: Record,
        sidecar: dict[str, Any],
        found: CrossField | None = None,
        log: LogFile | None = None,
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

    def known(self, sidecar: dict[str, Any]) -> float:
        """Return the least objective of an entry at its best point and at fields accepted in this call."""
        problem = self.entries.problem(sidecar)
        accepted = self.fields.get(sidecar["instance"]["sha256"], [])
        values = [problem.objective_value(complete_point(problem, each)) for each in accepted]
        return float(min([sidecar["best"]["objective"], *values]))

    def _point(self, path: Path, sidecar: dict[str, Any]) -> CrossField:
        """The field of a solution. Raises SolutionError unless its angles and jumps are feasible."""
        name, problem = sidecar["name"], self.entries.problem(sidecar)
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
        problem = self.entries.problem(sidecar)
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

    def _field(self, source: Source) -> Submission:
        """Check a field on every entry of its instance."""
        assert source.path is not None
        found = self._read_field(source.path)
        checked = []
        for sidecar in self._on(source.path, "field", found.instance):
            objective = self._objective(source.path, sidecar, found)
            checked.append((sidecar, objective, self.known(sidecar)))
        improved = [each for each in checked if is_better(each[1], each[2])]
        optima = set()
        for sidecar, objective, _ in improved:
            # One record per optimum, because a field counts for all entries of its instance.
            optimum = FORMULATIONS[sidecar["formulation"]].minimises, sidecar["options"]["facet"]
            if optimum not in optima:
                optima.add(optimum)
                problem, known = self.entries.problem(sidecar), self.known(sidecar)
                record = run_record(
                    sidecar["name"], problem, self.facts, None, objective=objective, known=known
                )
                self._add(record, sidecar, found)
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

    def _read_field(self, path: Path) -> CrossField:
        name = self.entry or (self.entries.by_file_name(path) if path.suffix.lower() == ".rawfield" else "")
        on = self.entries.problem(self.library.entry(name)).instance if name else None
        if path.suffix.lower() in (".rawfield", ".npz"):
            return read_field(path, on=on)
        with naming(path):
            data = read_bytes(path)
            if data.startswith(b"PK"):
                raise InputError("is an .npz by its content; let its name end in .npz")
            found = field_of_json(data)
            if on is not None:
                found.check_instance(on)
            return found

    def _on(self, path: Path, kind: str, instance: Instance) -> list[dict[str, Any]]:
        """The sidecars of an instance, or of the one entry that was named. Raises InputError without any."""
        found = [
            each
            for each in self.library.entries
            if each["instance"]["sha256"] == instance.sha256 and self.entry in (None, each["name"])
        ]
        if not found:
            what = f"is a {kind} of an instance that is not in the library: {instance.summary}"
            raise InputError(what, file=path)
        return found

    def _certificate(self, source: Source) -> Submission:
        """Check a certificate and keep it if it proves more than the one before."""
        assert source.path is not None
        found = read_certificate(source.path)
        instance = found.field.instance
        sidecars = [
            each
            for each in self._on(source.path, "certificate", instance)
            if FORMULATIONS[each["formulation"]].minimises == TWO_NORM
        ]
        if not sidecars:
            raise InputError(
                f"proves a bound of the 2-norm, which no entry of {instance.name} minimises", file=source.path
            )
        names = tuple(each["name"] for each in sidecars)
        self._objective(source.path, sidecars[0], found.field)
        stem = sidecars[0]["instance"]["file"].removesuffix(".instance.json")
        known, before = self.known(sidecars[0]), self._certified_bound(stem)
        better_point = is_better(found.energy, known)
        improves = (
            before is None or is_better(-found.bound, -before) or (better_point and found.bound >= before)
        )
        if improves:
            self.ledger = self.ledger.certified(stem, instance.sha256, read_bytes(source.path), self.facts.by)
            self.certified[stem] = found.bound
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

    def _certified_bound(self, instance: str) -> float | None:
        """The bound of the certificate that the library has of an instance."""
        about = read_about(self.library.folder / about_file(instance))
        stated: float | None = about.get("certificate", {}).get("bound")
        return self.certified.get(instance, stated)

    def _ledger(self, source: Source) -> Iterator[Submission]:
        """Check the runs, points and certificates of another ledger with their files."""
        assert source.path is not None
        other = read_ledger(source.path.parent, source.path.name)
        found = 0
        for record in other.records:
            if record in self.ledger.records or (record.bound, record.point) == (None, None):
                continue
            found += 1
            try:
                yield self._of_ledger(source, record, other)
            except CrossfieldError as error:
                yield Submission(source.files, source.kind, "refused", error=error)
        for each in other.certificates:
            if each in self.ledger.certificates:
                continue
            found += 1
            certificate = Source("certificate", other.folder / each.file)
            try:
                other.content(each.file, each.sha256)
            except CrossfieldError as error:
                certificate = replace(certificate, error=error)
            yield from self.results(certificate)
        if not found:
            yield Submission(source.files, source.kind, "not better")

    def _of_ledger(self, source: Source, record: Record, other: Ledger) -> Submission:
        """Check a record of another ledger, whose bound counts as stated unless its log shows it."""
        assert source.path is not None
        sidecar = self.library.entry(record.entry)
        problem = self.entries.problem(sidecar)
        if record.problem_sha256 != problem.sha256:
            raise InputError(f"has a record of {record.entry} about another problem", file=source.path)
        log = LogFile.of(other.folder / str(record.log), other.log(record)) if record.log else None
        found = other.field(record) if record.point else None
        if found is not None:
            found.check_instance(problem.instance)
            self._objective(other.folder / str(record.point), sidecar, found)
        facts = RunFacts(**{name: getattr(record, name) for name in RunFacts.__dataclass_fields__})
        return self._kept(source, sidecar, facts, log, found)


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
