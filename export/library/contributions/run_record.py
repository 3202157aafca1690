"""The ledger's record of a submitted run, from its log and from what its submitter states."""

from __future__ import annotations

import hashlib
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from ....models.errors import InputError, SolutionError, UnsupportedByFormatError, naming
from ....models.formulations.problem import Problem
from ....models.input_limits import MAX_LOG
from ....models.storage import read_bytes
from ...formats.registry import FORMATS, carried
from ...solutions.logs.registry import parse_log
from ...solutions.logs.run_log import RunLog
from ...solvers_table import SOLVERS
from ..ledger.ledger import Evidence, Record, RunStatus, log_file
from ..ledger.standing import MAKERS, contradicts, slack

UNKNOWN: Final = "unknown"
_ADDED: Final = 2  # columns that a program adds: for a constant, for an objective that is not linear


@dataclass(frozen=True)
class RunFacts:
    """Facts that a submitter states about a run, named as in a record; None if not stated."""

    solver: str | None = None
    version: str | None = None
    status: RunStatus | None = None
    bound: float | None = None
    seconds: float | None = None
    threads: int | None = None
    time_limit: float | None = None
    machine: str | None = None
    by: str | None = None
    date: str | None = None


@dataclass(frozen=True)
class LogFile:
    """The log of a run: its path, its bytes, and the facts in it."""

    path: Path
    content: bytes
    log: RunLog

    @classmethod
    def read(cls, path: Path) -> LogFile:
        """Read a log. Raises InputError, and SolutionError for a log without bound and objective."""
        return cls.of(path, read_bytes(path, MAX_LOG, "give the part of the last run"))

    @classmethod
    def of(cls, path: Path, content: bytes) -> LogFile:
        """Read the bytes of a log at a path. Raises SolutionError."""
        with naming(path):
            return cls(path, content, parse_log(content))

    def check_entry(self, entry: str, problem: Problem, named: set[str]) -> None:
        """Raise SolutionError if the log is about another problem. named: entries that it names."""
        others = sorted(named - {entry}) if entry not in named else []
        if self.log.stamps - {problem.stamp}:
            others = others or [f"a problem {min(self.log.stamps - {problem.stamp})}"]
        if others:
            raise SolutionError(f"is a log of {others[0]}, not of {entry}", file=self.path)
        if "GAMS" not in self.log.text and not _has_size(self.log, problem):
            raise SolutionError(
                f"is a log of a model of {self.log.columns} columns and {self.log.rows} rows, "
                f"and {entry} has other numbers",
                file=self.path,
            )


def _has_size(log: RunLog, problem: Problem) -> bool:
    """Whether a log states no size, or the size of the problem in one of the formats."""
    if log.columns is None:
        return True
    for each in FORMATS.values():
        try:
            held = carried(problem, each)
        except UnsupportedByFormatError:
            continue
        if 0 <= log.columns - held.n_columns <= _ADDED and (log.rows or 0) <= held.n_rows + 1:
            return True
    return False


def run_record(
    entry: str,
    problem: Problem,
    facts: RunFacts,
    log: LogFile | None,
    *,
    objective: float | None,
    known: float,
) -> Record:
    """Return the record of a run; stated facts replace those in the log.

    objective: of the run's point; known: the least one of the entry's feasible points. Raises InputError for
    facts that the log denies or a ledger cannot hold, SolutionError for a bound that a point or log refutes.
    """
    read = log.log if log else RunLog("")
    best = known if objective is None else min(known, objective)
    bound, evidence = _bound(facts, read, best, entry)
    if bound is None and objective is None:
        raise InputError("there is nothing to keep; give a bound, a log with a bound, or a solution file")
    digest = hashlib.sha256(log.content).hexdigest() if log else None
    record = Record(
        entry,
        problem.sha256,
        _solver(facts, read),
        facts.version or read.version or UNKNOWN,
        _status(facts, read, objective, bound),
        primal=objective,
        bound=bound,
        seconds=read.seconds if facts.seconds is None else facts.seconds,
        threads=read.threads if facts.threads is None else facts.threads,
        time_limit=read.limit if facts.time_limit is None else facts.time_limit,
        by=facts.by,
        machine=facts.machine,
        date=facts.date,
        evidence=evidence,
        log=None if digest is None else log_file(entry, read.solver, digest),
        log_sha256=digest,
        trace=read.trace,
    )
    # First without the values of the log, so that an error names the log only for a value in it.
    measured = {name: getattr(facts, name) for name in ("seconds", "threads", "time_limit")}
    replace(record, version=facts.version or UNKNOWN, trace=(), **measured).check()
    with naming(log.path) if log else nullcontext():
        record.check()
    return record


def _bound(facts: RunFacts, log: RunLog, best: float, entry: str) -> tuple[float | None, Evidence | None]:
    """The dual bound of a run and its evidence. Raises SolutionError for a bound that cannot hold."""
    bound = log.bound if facts.bound is None else facts.bound
    evidence: Evidence = "log" if facts.bound is None else "word"
    if bound is None:
        return None, None
    if facts.bound is not None and log.bound is not None and abs(facts.bound - log.bound) <= slack(log.bound):
        bound, evidence = log.bound, "log"
    elif log.bound is not None and log.ended is not None and bound > log.bound:
        raise SolutionError(f"the bound {bound!r} differs from the log's, {log.bound!r}; omit the bound")
    if contradicts(bound, best):
        raise SolutionError(
            f"the bound {bound!r} lies above {best!r}, the objective of a feasible point of {entry}; "
            "run the solver with tighter tolerances"
        )
    return bound, evidence


def _solver(facts: RunFacts, log: RunLog) -> str:
    """The solver's title in the table of solvers, or its stated name. Raises InputError."""
    titles = {name.lower(): each.title for each in SOLVERS.values() for name in (each.name, each.title)}
    stated = None if facts.solver is None else titles.get(facts.solver.lower(), facts.solver)
    if not log.solver:
        return stated or UNKNOWN
    solver = SOLVERS[log.solver]
    if stated is not None and MAKERS.get(stated) != solver.maker:
        raise InputError(f"the solver is given as {stated}, and the log is of {solver.title}; leave it out")
    return stated or solver.title


def _status(facts: RunFacts, log: RunLog, objective: float | None, bound: float | None) -> RunStatus:
    """The result of a run. Raises InputError for a claim that the log denies or that has no bound."""
    if facts.status == "optimal" and log.ended == "limit":
        raise InputError(
            "the status is given as optimal, but the log states that the search was stopped; leave it out"
        )
    claimed = facts.status or ("optimal" if log.ended == "optimal" else None)
    if claimed == "optimal" and bound is None:
        raise InputError("an optimum is proven by a bound; give the bound, or a log that states it")
    if claimed is not None:
        return claimed
    if not log.solver and bound is None:
        return "feasible"
    return "no point" if objective is None and log.objective is None else "limit"
