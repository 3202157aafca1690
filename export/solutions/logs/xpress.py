"""Logs of Xpress, whose tables have columns of fixed width.

The best solution is blank until there is one.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from .run_log import LogReader, RunLog, Step, last, number, seconds, whole

_BEST, _BOUND = slice(9, 22), slice(22, 35)
_HEADER: Final = re.compile(r" +(?:Its Type|Node) +BestSoln +BestBound .* Time$")
_ROW: Final = re.compile(r"[A-Za-z* ].{34}.* (\d+)$")
_SIZE: Final = r"^Original problem has:\n +{} rows +{} cols"


def _parse(text: str) -> RunLog:
    bound, complete = number(last(r"^Final MIP bound +: (\S+)$", text)), "*** Search completed ***" in text
    finished = complete or "*** Search unfinished ***" in text
    time = last(r"^ +Solution time / primaldual integral : +([\d.]+s)", text)
    return RunLog(
        "xpress",
        ended=None if not finished else "optimal" if complete and bound is not None else "limit",
        bound=bound,
        objective=number(last(r"^Final MIP objective +: (\S+)$", text)),
        seconds=None if time is None else seconds(time),
        threads=whole(last(r"using (?:up to )?(\d+) threads?", text)),
        limit=number(last(r"^TIMELIMIT = (\S+)$", text)),
        columns=whole(last(_SIZE.format(r"\d+", r"(\d+)"), text)),
        rows=whole(last(_SIZE.format(r"(\d+)", r"\d+"), text)),
        trace=tuple(_steps(text)),
    )


def _steps(text: str) -> Iterator[Step]:
    """The rows below a header, up to the next empty line."""
    inside = False
    for line in text.splitlines():
        inside = bool(_HEADER.match(line)) or (inside and bool(line.strip()))
        row = _ROW.match(line) if inside else None
        if row and (bound := number(line[_BOUND].strip())) is not None:
            yield Step(float(row[1]), bound, number(line[_BEST].strip()))


READER: Final = LogReader(
    "Xpress", re.compile(r"^FICO Xpress .*v\d", re.MULTILINE), _parse, r"Xpress.* v([\d.]+)"
)
