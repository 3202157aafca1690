"""Logs of HiGHS, of its search over integers; logs of LPs and QPs state no bound."""

from __future__ import annotations

import re
from typing import Final

from .run_log import LogReader, RunLog, Step, last, number, step, table_steps, whole

_SIZE: Final = r"^\S+ .*has {} rows; {} cols;"


def _row(words: list[str]) -> Step | None:
    """From the right: time, iterations, conflicts, two counts, gap, objective, bound, share explored."""
    if len(words) < 11 or not words[-1].endswith("s") or not words[-9].endswith("%"):
        return None
    return step(words[-1], words[-8], words[-7])


def _parse(text: str) -> RunLog:
    bound, status = number(last(r"^ +Dual bound +(\S+)$", text)), last(r"^ +Status +(\S.*)$", text)
    return RunLog(
        "highs",
        ended=None if status is None else "optimal" if status == "Optimal" else "limit",
        bound=bound,
        objective=number(last(r"^ +Primal bound +(\S+)$", text)),
        seconds=number(last(r"^ +Timing +(\S+)", text)),
        threads=whole(last(r"^ +Thread count (\d+) ", text)),
        columns=whole(last(_SIZE.format(r"\d+", r"(\d+)"), text)),
        rows=whole(last(_SIZE.format(r"(\d+)", r"\d+"), text)),
        trace=table_steps(text, _row),
    )


READER: Final = LogReader(
    "HiGHS", re.compile(r"^Running HiGHS ", re.MULTILINE), _parse, r"^Running HiGHS (\S+)"
)
