"""Logs of BARON, by itself or in GAMS, which adds the bound with all its digits."""

from __future__ import annotations

import re
from typing import Final

from .run_log import LogReader, RunLog, at_least, last, number, table_steps

_ROW: Final = re.compile(
    r"^\*?\s+\d+\s+(?P<time>[\d.]+)\s+(?:\d+[KMG]B\s+)?(?P<bound>[-+.\dE]+)\s+(?P<best>[-+.\dE]+)(?:\s+[\d.]+%)?$",
    re.MULTILINE,
)


def _parse(text: str) -> RunLog:
    rows, exact = list(_ROW.finditer(text)), last(r"^Best possible += +(\S+)$", text)
    bound = number(exact) if exact else at_least(rows[-1]["bound"]) if rows else None
    told = last(r"^ +\*\*\* (.+?) \*\*\* *$", text)
    best = last(r"^Solution += +(\S+)", text) or (rows[-1]["best"] if rows else None)
    return RunLog(
        "baron",
        version=last(r"^ *BARON version (\d[\d.]*\d)", text),
        ended=None if told is None else "optimal" if told == "Normal completion" else "limit",
        bound=bound,
        objective=number(best),
        seconds=number(last(r"^ *Wall clock time: +(\S+)$", text)),
        trace=table_steps(rows),
    )


READER: Final = LogReader("BARON", re.compile(r"^ *BARON version \d", re.MULTILINE), _parse)
