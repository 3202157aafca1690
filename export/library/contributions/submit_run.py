"""Taking a run of a solver into a library: its dual bound, and its point, with what it was made on.

A bound is somebody's word, or what the solver's log says. It is refused where a feasible point lies below it;
the point is computed again, as `submit_point` does. The ledger keeps the best run of each solver, with its
log, so that `verify` can read that again.
"""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from ....models.errors import InputError, SolutionError, UnsupportedByFormatError, naming
from ....models.field.field import CrossField
from ....models.formulations.problem import Problem
from ....models.input_limits import MAX_LOG
from ....models.processes.progress import Progress, silent
from ....models.storage import read_bytes
from ...formats.registry import FORMATS, carried
from ...solutions.logs.registry import read_log
from ...solutions.logs.run_log import RunLog
from ...solvers_table import SOLVERS
from ..building.build import rebuilt
from ..documents.documents import Library, problem_of
from ..documents.lock import locked
from ..ledger.dual_bounds import contradicts, slack
from ..ledger.ledger import Evidence, Record, RunStatus, add_record, log_file, read_ledger
from ..ledger.standing import MAKERS, best_of_each
from .submit import (
    UNKNOWN,
    by_name,
    checked_point,
    is_better,
    settled,
    writable_library,
)

_NAMES: Final = re.compile(r"cf_[a-z0-9_]+")
_ADDED: Final = 2  # columns that a program adds: for a constant, for an objective that is not linear


@dataclass(frozen=True)
class Told:
    """What somebody says of a run; what a log says itself may be left out.

    limit: seconds it was allowed; machine: what it ran on; date: as YYYY-MM-DD.
    """

    solver: str | None = None
    version: str | None = None
    status: RunStatus | None = None
    bound: float | None = None
    seconds: float | None = None
    threads: int | None = None
    limit: float | None = None
    machine: str | None = None
    by: str | None = None
    date: str | None = None


@dataclass(frozen=True)
class RunSubmission:
    """What happened to a run: its entry, solver, bound and objective, and whether each is better.

    kept: whether it is now the run of its solver; status: of the entry afterwards.
    """

    entry: str
    solver: str
    bound: float | None
    objective: float | None
    better_point: bool
    kept: bool
    status: str

    def __str__(self) -> str:
        """One line."""
        told = [f"bound {self.bound!r}"] if self.bound is not None else []
        if self.objective is not None:
            told.append(f"objective {self.objective!r}{', the best so far' if self.better_point else ''}")
        how = "kept" if self.kept else f"not kept, for a run of {self.solver} that is known is as good"
        return f"{self.entry}: {self.solver}, {', '.join(told)}: {how}; the entry is {self.status}"


def submit_run(
    folder: str | Path,
    *,
    point: str | Path | None = None,
    log: str | Path | None = None,
    entry: str | None = None,
    told: Told | None = None,
    progress: Progress = silent,
) -> RunSubmission:
    """What happened to a run of a solver, of which there is a solution file, a log, or a bound alone.

    point, log: files as solvers write them; entry: name of the entry, by default as the files say. Raises
    InputError for what cannot be kept, SolutionError for a file of another entry, a point that is not
    feasible, a log that is none or contradicts what is told, a bound above a known point, and a status
    `optimal` without a bound.
    """
    told = told or Told()
    library = writable_library(folder)
    with locked(library.folder, "a submission of a run", progress):
        library = settled(library, progress)
        progress("checking the run")
        record, field, content, sidecar = _checked(library, point, log, entry, told)
        have = read_ledger(library.folder).of(record.entry, record.problem_sha256)
        is_new = record not in have and record in best_of_each([*have, record], record.entry)
        if is_new or field is not None:
            add_record(library.folder, record, field, content)
            library = rebuilt(library.folder, progress=progress)
        status = library.entry(sidecar["name"])["status"]
    better, kept = field is not None, is_new or field is not None
    return RunSubmission(record.entry, record.solver, record.bound, record.primal, better, kept, status)


def _checked(
    library: Library, point: str | Path | None, log: str | Path | None, entry: str | None, told: Told
) -> tuple[Record, CrossField | None, bytes | None, dict[str, Any]]:
    """The record of a run, its field where that is the best so far, its log, and the entry's sidecar."""
    said = None if log is None else read_log(log)
    name = entry or (None if said is None or point is not None else _entry_of(Path(str(log)), said, library))
    objective, field = None, None
    if point is not None:
        sidecar, problem, field, objective = checked_point(Path(point), library, name)
    elif name is None:
        raise InputError("the files do not show which entry the run is of; name the entry")
    else:
        sidecar = library.entry(name)
        problem = problem_of(library, sidecar)
    if said is not None:
        _check_same(Path(str(log)), said, sidecar["name"], problem, library)
    known = sidecar["best"]["objective"]
    best = known if objective is None else min(known, objective)
    bound, evidence = _bound(told, said, best, sidecar["name"])
    if bound is None and objective is None:
        raise InputError("there is nothing to keep; give a bound, a log that states one, or a solution file")
    content = None if log is None else read_bytes(Path(log), MAX_LOG)
    record = _record(sidecar["name"], problem, told, said, content, found=(objective, bound, evidence))
    _check_record(record, told, log)
    better = objective is not None and is_better(objective, known)
    return record, field if better else None, content, sidecar


def _check_record(record: Record, told: Told, log: str | Path | None) -> None:
    """Raise InputError unless a ledger can hold the record, naming the log where that is at fault."""
    stated = replace(
        record,
        version=told.version or UNKNOWN,
        seconds=told.seconds,
        threads=told.threads,
        time_limit=told.limit,
        trace=(),
    )
    stated.check()
    if log is not None:
        with naming(log):
            record.check()


def _entry_of(file: Path, said: RunLog, library: Library) -> str | None:
    """The entry that a log is of, by the file's name, the problem or the entry that it names."""
    if found := by_name(file, library):
        return found
    named = {name for name in _NAMES.findall(said.text) if name in library.document["sha256"]}
    if not named and said.stamps:
        named = {each["name"] for each in library.entries if problem_of(library, each).stamp in said.stamps}
    return named.pop() if len(named) == 1 else None


def _check_same(file: Path, said: RunLog, entry: str, problem: Problem, library: Library) -> None:
    """Nothing, when nothing in a log says that it is of another problem. Raises SolutionError."""
    named = {name for name in _NAMES.findall(said.text) if name in library.document["sha256"]}
    others = sorted(named - {entry}) if entry not in named else []
    if said.stamps - {problem.stamp}:
        others = others or [f"a problem {min(said.stamps - {problem.stamp})}"]
    if others:
        raise SolutionError(f"is a log of {others[0]}, not of {entry}", file=file)
    if said.columns is not None and "GAMS" not in said.text and not _is_of_size(said, problem):
        raise SolutionError(
            f"is a log of a model of {said.columns} columns and {said.rows} rows, which {entry} has not",
            file=file,
        )


def _is_of_size(said: RunLog, problem: Problem) -> bool:
    """Whether a model of that size may be the problem in one of the formats."""
    assert said.columns is not None
    for each in FORMATS.values():
        try:
            held = carried(problem, each)
        except UnsupportedByFormatError:
            continue
        if 0 <= said.columns - held.n_columns <= _ADDED and (said.rows or 0) <= held.n_rows + 1:
            return True
    return False


def _bound(told: Told, said: RunLog | None, best: float, entry: str) -> tuple[float | None, Evidence | None]:
    """The dual bound of a run, and what it rests on. Raises SolutionError for one that cannot be."""
    read = None if said is None else said.bound
    bound = read if told.bound is None else told.bound
    evidence: Evidence = "log" if told.bound is None else "word"
    if bound is None:
        return None, None
    if told.bound is not None and read is not None and abs(told.bound - read) <= slack(read):
        bound, evidence = read, "log"
    elif said is not None and read is not None and said.ended is not None and bound > read:
        raise SolutionError(f"the bound {bound!r} is not that of the log, {read!r}; leave the bound out")
    if contradicts(bound, best):
        raise SolutionError(
            f"the bound {bound!r} lies above {best!r}, the objective of a feasible point of {entry}; "
            "it is none, let the solver use tighter tolerances"
        )
    return bound, evidence


def _record(
    entry: str,
    problem: Problem,
    told: Told,
    said: RunLog | None,
    content: bytes | None,
    *,
    found: tuple[float | None, float | None, Evidence | None],
) -> Record:
    """The record of a run; what is told goes before what the log says, unless that contradicts it."""
    objective, bound, evidence = found
    said = said or RunLog("")
    digest = None if content is None else hashlib.sha256(content).hexdigest()
    return Record(
        entry,
        problem.sha256,
        _solver(told, said),
        told.version or said.version or UNKNOWN,
        _status(told, said, objective, bound),
        primal=objective,
        bound=bound,
        seconds=said.seconds if told.seconds is None else told.seconds,
        threads=said.threads if told.threads is None else told.threads,
        time_limit=said.limit if told.limit is None else told.limit,
        by=told.by,
        machine=told.machine,
        date=told.date,
        evidence=evidence,
        log=None if digest is None else log_file(entry, said.solver, digest),
        log_sha256=digest,
        trace=said.trace,
    )


def _solver(told: Told, said: RunLog) -> str:
    """The solver's title, as the table of solvers has it where it is there. Raises InputError."""
    titles = {name.lower(): each.title for each in SOLVERS.values() for name in (each.name, each.title)}
    stated = None if told.solver is None else titles.get(told.solver.lower(), told.solver)
    if not said.solver:
        return stated or UNKNOWN
    solver = SOLVERS[said.solver]
    if stated is not None and MAKERS.get(stated) != solver.maker:
        raise InputError(f"the solver is given as {stated}, and the log is of {solver.title}; leave it out")
    return stated or solver.title


def _status(told: Told, said: RunLog, objective: float | None, bound: float | None) -> RunStatus:
    """What a run came to. Raises InputError for a claim that the log denies or that has no bound."""
    if told.status == "optimal" and said.ended == "limit":
        raise InputError(
            "the status is given as optimal, but the log states that the search was stopped; leave it out"
        )
    claimed = told.status or ("optimal" if said.ended == "optimal" else None)
    if claimed == "optimal" and bound is None:
        raise InputError("an optimum is proven by a bound; give the bound, or a log that states it")
    if claimed is not None:
        return claimed
    return "no point" if objective is None and said.objective is None else "limit"
