"""Logs of SCIP, with or without the statistics that may follow a run."""

from __future__ import annotations

import re
from typing import Final

from .run_log import LogReader, RunLog, Step, last, number, step, table_steps, whole

_HEADER: Final = r"^ *time +\|.*\| *dualbound *\| *primalbound *\|.*$"
_SIZE: Final = r"^original problem has (\d+) variables \([^)]*\) and (\d+) constraints"


def _rows(text: str) -> tuple[Step, ...]:
    """The rows of the table; its header gives the columns of bounds, which differ between versions."""
    header = re.search(_HEADER, text, re.MULTILINE)
    if header is None:
        return ()
    names = [cell.strip() for cell in header[0].split("|")]
    bound, best = names.index("dualbound"), names.index("primalbound")

    def row(cells: list[str]) -> Step | None:
        """A row whose first cell holds the time after a letter."""
        if len(cells) != len(names) or not cells[0].strip():
            return None
        return step(cells[0].split()[-1], cells[bound].strip(), cells[best].strip())

    return table_steps(text, row, "|")


def _parse(text: str) -> RunLog:
    status, bound = last(r"^SCIP Status +: (.+)$", text), number(last(r"^Dual Bound +: (\S+)", text))
    size = re.search(_SIZE, text, re.MULTILINE)
    return RunLog(
        "scip",
        ended=None if status is None else "optimal" if "optimal solution found" in status else "limit",
        bound=bound,
        objective=number(last(r"^Primal Bound +: (\S+)", text)),
        seconds=number(last(r"^Solving Time \(sec\) : (\S+)$", text)),
        columns=whole(size[1]) if size else None,
        rows=whole(size[2]) if size else None,
        trace=_rows(text),
    )


READER: Final = LogReader(
    "SCIP",
    re.compile(r"^(?:SCIP version |original problem has \d+ variables)", re.MULTILINE),
    _parse,
    r"^SCIP version (\S+)",
)
