"""Logs of SCIP, with or without the statistics that may follow a run."""

from __future__ import annotations

import re
from typing import Final

from .run_log import LogReader, RunLog, last, number, table_steps, whole

_ROW: Final = re.compile(
    r"^.?\s*(?P<time>[\d.]+[smhd])\|[^\n]*\|\s*(?P<bound>[^\s|]+)\s*\|\s*(?P<best>[^\s|]+)\s*\|[^|\n]*\|[^|\n]*$",
    re.MULTILINE,
)
_SIZE: Final = r"^original problem has (\d+) variables \([^)]*\) and (\d+) constraints"


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
        trace=table_steps(_ROW.finditer(text)),
    )


READER: Final = LogReader(
    "SCIP", re.compile(r"^(?:SCIP version |original problem has \d+ variables)", re.MULTILINE), _parse
)
