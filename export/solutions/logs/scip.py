"""Logs of SCIP, with or without the statistics that may follow a run."""

from __future__ import annotations

import re
from typing import Final

from .run_log import LogReader, RunLog, Step, last, number, step, table_steps, whole

_SIZE: Final = r"^original problem has (\d+) variables \([^)]*\) and (\d+) constraints"


def _row(cells: list[str]) -> Step | None:
    """The time behind a letter in the first cell; from the right: share done, gap, objective, bound."""
    if len(cells) < 8 or not cells[0].strip():
        return None
    return step(cells[0].split()[-1], cells[-4].strip(), cells[-3].strip())


def _parse(text: str) -> RunLog:
    status, bound = last(r"^SCIP Status +: (.+)$", text), number(last(r"^Dual Bound +: (\S+)", text))
    size = re.search(_SIZE, text, re.MULTILINE)
    return RunLog(
        "scip",
        version=last(r"^SCIP version (\S+)", text),
        ended=None if status is None else "optimal" if "optimal solution found" in status else "limit",
        bound=bound,
        objective=number(last(r"^Primal Bound +: (\S+)", text)),
        seconds=number(last(r"^Solving Time \(sec\) : (\S+)$", text)),
        columns=whole(size[1]) if size else None,
        rows=whole(size[2]) if size else None,
        trace=table_steps(text, _row, "|"),
    )


READER: Final = LogReader(
    "SCIP", re.compile(r"^(?:SCIP version |original problem has \d+ variables)", re.MULTILINE), _parse
)
