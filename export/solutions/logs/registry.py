"""The table of readers of logs, and the choice among them by content."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

from ....models.errors import SolutionError, naming
from ....models.input_limits import MAX_LOG
from ....models.storage import read_bytes
from . import baron, cplex, gurobi, highs, scip, xpress
from .run_log import LogReader, RunLog, Step, last, stamps, thinned

LOG_READERS: Final[tuple[LogReader, ...]] = tuple(
    module.READER for module in (baron, highs, gurobi, scip, xpress, cplex)
)
"""The first one that recognises a log reads it: BARON and GAMS name the solvers that they call."""


def read_log(path: str | Path) -> RunLog:
    """Read a solver's log for the last run that it describes.

    Raises InputError when the file cannot be opened or has more than MAX_LOG bytes. Raises SolutionError when
    it is not a log of a known solver, or states neither a bound nor an objective.
    """
    data = read_bytes(Path(path), MAX_LOG, "give the part of the last run")
    with naming(path):
        return parse_log(data)


def parse_log(data: bytes) -> RunLog:
    """Read the content of a log. Raises SolutionError."""
    text = data.decode("utf-8-sig", "replace").replace("\r\n", "\n")
    for reader in LOG_READERS:
        starts = [found.start() for found in reader.start.finditer(text)]
        if starts:
            found = reader.parse(text[starts[-1] :])
            if (found.bound, found.objective) == (None, None) and not found.trace:
                raise SolutionError(
                    f"this log of {reader.title} states neither a bound nor an objective; give one of a run "
                    "that began its search"
                )
            version = last(reader.version, text)
            return replace(found, version=version, trace=_trace(found), stamps=stamps(text), text=text)
    known = ", ".join(sorted(reader.title for reader in LOG_READERS))
    raise SolutionError(f"this is not a log of a known solver; give one of {known}, or the bound itself")


def _trace(found: RunLog) -> tuple[Step, ...]:
    """The steps of a run, including its end if the log states it."""
    if found.seconds is None:
        return thinned(found.trace, found.bound)
    before = found.trace[-1].objective if found.trace else None
    best = before if found.objective is None else found.objective
    return thinned((*found.trace, Step(found.seconds, found.bound, best)), found.bound)
