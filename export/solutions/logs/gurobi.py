"""Logs of Gurobi, which adds each run to the end of its file."""

from __future__ import annotations

import re
from typing import Final

from .run_log import LogReader, RunLog, Step, last, number, step, table_steps, whole

_END: Final = r"^Best objective {}, best bound {}, gap"
_STOPPED: Final = re.compile(r"^(?:\w+ limit reached|Interrupt request received)", re.MULTILINE)


def _row(words: list[str]) -> Step | None:
    """From the right: time, iterations a node, gap, bound, objective."""
    if len(words) < 7 or not words[-1].endswith("s") or not (words[-3] == "-" or words[-3].endswith("%")):
        return None
    return step(words[-1], words[-4], words[-5])


def _parse(text: str) -> RunLog:
    bound = number(last(_END.format(r"\S+", r"(\S+)"), text))
    proven = re.search(r"^Optimal solution found", text, re.MULTILINE)
    return RunLog(
        "gurobi",
        ended="optimal" if proven else "limit" if _STOPPED.search(text) else None,
        bound=bound,
        objective=number(last(_END.format(r"(\S+)", r"\S+"), text)),
        seconds=number(last(r"^Explored .* in (\S+) seconds", text)),
        threads=whole(last(r"using up to (\d+) threads?", text)),
        limit=number(last(r"^TimeLimit  (\S+)$", text)),
        columns=whole(last(r"^Optimize a model with \d+ rows, (\d+) columns", text)),
        rows=whole(last(r"^Optimize a model with (\d+) rows", text)),
        trace=table_steps(text, _row),
    )


READER: Final = LogReader(
    "Gurobi",
    re.compile(r"^Gurobi Optimizer version ", re.MULTILINE),
    _parse,
    r"^Gurobi Optimizer version (\S+)",
)
