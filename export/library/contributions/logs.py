"""Submitted logs, and what a log states about its problem and its solver."""

from __future__ import annotations

from dataclasses import dataclass
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
from ...writing.stamps import is_identified
from ..ledger.standing import MAKERS

_ADDED: Final = 2  # columns that a program adds: for a constant, for an objective that is not linear


@dataclass(frozen=True)
class SubmittedLog:
    """The log of a run: its path, its bytes, and the facts in it."""

    path: Path
    content: bytes
    run: RunLog

    @classmethod
    def read(cls, path: Path) -> SubmittedLog:
        """Read a log. Raises InputError, and SolutionError for a log without bound and objective."""
        content = read_bytes(path, MAX_LOG, "give the part of the last run")
        with naming(path):
            return cls(path, content, parse_log(content))

    def check(self, entry: str, problem: Problem, named: set[str]) -> None:
        """Raise SolutionError unless the log states its problem. named: the entries that it names."""
        others = sorted(named - {entry}) if entry not in named else []
        if others:
            raise SolutionError(f"is a log of {others[0]}, not of {entry}", file=self.path)
        if "GAMS" not in self.run.text and not has_size(self.run, problem):
            raise SolutionError(
                f"is a log of a model of {self.run.columns} columns and {self.run.rows} rows, "
                f"and {entry} has other numbers",
                file=self.path,
            )
        with naming(self.path):
            if not is_identified(self.run.stamps, problem.stamp) and not named:
                raise SolutionError(
                    f"does not state its problem: neither {entry} nor {problem.stamp} is in it; "
                    "let the solver read the model under its name in the library"
                )


def has_size(log: RunLog, problem: Problem) -> bool:
    """Return whether a log states no size, or the size of the problem in one of the formats."""
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


def solver_of(stated: str | None, log: SubmittedLog | None) -> str:
    """Return the solver's title in the table of solvers, or its stated name. Raises InputError."""
    titles = {name.lower(): each.title for each in SOLVERS.values() for name in (each.name, each.title)}
    title = None if stated is None else titles.get(stated.lower(), stated)
    if log is None:
        return title or "unknown"
    solver = SOLVERS[log.run.solver]
    if title is not None and MAKERS.get(title) != solver.maker:
        raise InputError(f"the solver is given as {title}, and the log is of {solver.title}; leave it out")
    return title or solver.title
