"""Logs of CPLEX: of its own shell, of its Python API, and of GAMS.

Its table has columns of fixed width, with bounds to four decimals and the time on separate lines. The Python
API writes only this table; then the bound is the least number that rounds to the printed one.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from .run_log import LogReader, RunLog, Step, at_least, last, number, whole

_BEST, _BOUND = slice(33, 47), slice(47, 61)
_HEADER: Final = "   Node  Left     Objective  IInf  Best Integer    Best Bound"
_NODE: Final = re.compile(r"[* ] {0,7}\d+\+? +\d+ ")
_TIME: Final = re.compile(r"Elapsed time = +(\S+) sec\.|Total \(root\+branch&cut\) = +(\S+) sec\.")
_OBJECTIVE: Final = r"^MIP - Integer optimal solution: +Objective = +(\S+)"


def _parse(text: str) -> RunLog:
    rows = list(_rows(text))
    exact = last(r"^Current MIP best bound = +(\S+)", text) or last(_OBJECTIVE, text)
    printed = last(r"^Best possible: +(\S+)", text) or next((b for b, _ in reversed(rows) if number(b)), None)
    bound = at_least(printed) if exact is None else number(exact)
    proven = re.search(r"^(?:MIP - Integer optimal|Proven optimal solution)", text, re.MULTILINE)
    stopped = re.search(r"^MIP - .*(?:limit|abort|exceeded)", text, re.MULTILINE)
    spent = last(r"^Total \(root\+branch&cut\) = +(\S+) sec", text) or last(
        r"^Solution time = +(\S+) sec", text
    )
    return RunLog(
        "cplex",
        ended="optimal" if proven else "limit" if stopped else None,
        bound=bound,
        objective=number(last(r"^MIP - .*Objective = +(\S+)", text) or last(r"^MIP Solution: +(\S+)", text)),
        seconds=number(spent),
        threads=whole(last(r"using (?:up to )?(\d+) threads?\.", text)),
        limit=number(last(r"^CPXPARAM_TimeLimit +(\S+)$", text)),
        trace=tuple(_steps(text)),
    )


def _rows(text: str) -> Iterator[tuple[str, str]]:
    """Bound and best objective of each row of the table, as printed."""
    yield from (_cells(line) for line in _table(text) if _NODE.match(line))


def _table(text: str) -> list[str]:
    _, _, below = text.partition(_HEADER)
    return below.splitlines()[1:]


def _cells(line: str) -> tuple[str, str]:
    return line[_BOUND].strip(), line[_BEST].strip()


def _steps(text: str) -> Iterator[Step]:
    """Steps from the table, at each line with a time."""
    bound: float | None = None
    best: float | None = None
    for line in _table(text):
        if _NODE.match(line):
            cells = [number(cell) for cell in _cells(line)]
            bound, best = (
                new if new is not None else old for new, old in zip(cells, (bound, best), strict=True)
            )
        elif (time := _TIME.match(line)) and (spent := number(time[1] or time[2])) is not None:
            yield Step(spent, bound, best)


READER: Final = LogReader(
    "CPLEX",
    re.compile(
        r"^(?:Version identifier: \d|Welcome to IBM.*CPLEX|--- GAMS/CPLEX|IBM ILOG CPLEX)", re.MULTILINE
    ),
    _parse,
    r"(?:Version identifier:|Interactive Optimizer) +([\d.]+)",
)
