"""Logs of HiGHS, of its search over integers; those of LPs and QPs tell no bound."""

from __future__ import annotations

import re
from typing import Final

from .run_log import LogReader, RunLog, last, number, table_steps, whole

_ROW: Final = re.compile(
    r"^ ?[A-Za-z]?\s+\S+\s+\S+\s+\S+\s+[\d.]+%\s+(?P<bound>\S+)\s+(?P<best>\S+)\s+\S+(?:\s+\S+){4}\s+"
    r"(?P<time>[\d.]+s)$",
    re.MULTILINE,
)
_SIZE: Final = r"^\S+ .*has {} rows; {} cols;"


def _parse(text: str) -> RunLog:
    bound, status = number(last(r"^ +Dual bound +(\S+)$", text)), last(r"^ +Status +(\S.*)$", text)
    return RunLog(
        "highs",
        version=last(r"^Running HiGHS (\S+)", text),
        ended=None if status is None else "optimal" if status == "Optimal" else "limit",
        bound=bound,
        objective=number(last(r"^ +Primal bound +(\S+)$", text)),
        seconds=number(last(r"^ +Timing +(\S+)$", text)),
        threads=whole(last(r"^ +Thread count (\d+) ", text)),
        columns=whole(last(_SIZE.format(r"\d+", r"(\d+)"), text)),
        rows=whole(last(_SIZE.format(r"(\d+)", r"\d+"), text)),
        trace=table_steps(_ROW.finditer(text)),
    )


READER: Final = LogReader("HiGHS", re.compile(r"^Running HiGHS ", re.MULTILINE), _parse)
