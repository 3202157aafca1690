"""Logs of BARON, by itself or in GAMS, which adds the bound with all its digits."""

from __future__ import annotations

import re
from typing import Final

from .run_log import LogReader, RunLog, at_least, last, number, step, whole

_CELLS: Final = 4


def _row(words: list[str]) -> tuple[str, ...]:
    """Time, bound and objective of a line: iteration, time, memory, bound, objective, progress.

    Earlier versions have no memory and no progress. Empty for another line.
    """
    shown = [word for word in words if word != "*" and not word.endswith(("B", "%"))]
    is_row = len(shown) == _CELLS and whole(shown[0]) is not None and number(shown[2]) is not None
    return tuple(shown[1:]) if is_row else ()


def _parse(text: str) -> RunLog:
    rows = [row for line in text.splitlines() if (row := _row(line.split()))]
    trace = tuple(each for row in rows if (each := step(*row)))
    exact = last(r"^Best possible += +(\S+)$", text)
    before = last(r"^ *Lower bound is +(\S+)$", text)
    bound = number(exact) if exact else at_least(rows[-1][1] if rows else before)
    found = number(last(r"^Solution += +(\S+)", text))
    shown = last(r"^ +\*\*\* (.+?) \*\*\* *$", text)
    return RunLog(
        "baron",
        ended=None if shown is None else "optimal" if shown == "Normal completion" else "limit",
        bound=bound,
        objective=trace[-1].objective if found is None and trace else found,
        seconds=number(last(r"^ *Wall clock time: +(\S+)$", text)),
        trace=trace,
    )


READER: Final = LogReader(
    "BARON", re.compile(r"^ *BARON version \d", re.MULTILINE), _parse, r"^ *BARON version (\d[\d.]*\d)"
)
