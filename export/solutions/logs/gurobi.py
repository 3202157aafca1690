"""Logs of Gurobi, which adds each run to the end of its file."""

from __future__ import annotations

import re
from typing import Final

from .run_log import LogReader, RunLog, last, number, table_steps, whole

_ROW: Final = re.compile(
    r"^[H* ].*?(?P<best>\S+)\s+(?P<bound>\S+)\s+(?:-|[\d.]+%)\s+\S+\s+(?P<time>\d+s)$", re.MULTILINE
)
_END: Final = r"^Best objective {}, best bound {}, gap"
_STOPPED: Final = re.compile(r"^(?:\w+ limit reached|Interrupt request received)", re.MULTILINE)


def _parse(text: str) -> RunLog:
    bound = number(last(_END.format(r"\S+", r"(\S+)"), text))
    proven = re.search(r"^Optimal solution found", text, re.MULTILINE)
    return RunLog(
        "gurobi",
        version=last(r"^Gurobi Optimizer version (\S+)", text),
        ended="optimal" if proven else "limit" if _STOPPED.search(text) else None,
        bound=bound,
        objective=number(last(_END.format(r"(\S+)", r"\S+"), text)),
        seconds=number(last(r"^Explored .* in (\S+) seconds", text)),
        threads=whole(last(r"using up to (\d+) threads?", text)),
        limit=number(last(r"^TimeLimit  (\S+)$", text)),
        columns=whole(last(r"^Optimize a model with \d+ rows, (\d+) columns", text)),
        rows=whole(last(r"^Optimize a model with (\d+) rows", text)),
        trace=table_steps(_ROW.finditer(text)),
    )


READER: Final = LogReader("Gurobi", re.compile(r"^Gurobi Optimizer version ", re.MULTILINE), _parse)
