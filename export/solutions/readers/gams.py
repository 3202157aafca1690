"""Answers of GAMS: the CSV that our own files write.

After `gams x.gms --RESULTS=x.csv` the CSV has lines `name,value`:

    model_status,1
    solver_status,1
    problem,sha256_1a2b3c4d5e6f               older files have no such line
    objective, 5.565360828459345E-01
    alpha_00_00, 1.146018366025520E-01     every column in order

EPS is a zero, +INF and -INF occur, NA and UNDF are not values. GAMS's numbers of the two states are in the
manual under modelStat and solveStat. If the model status promises no point, GAMS keeps the start in the
levels: values are then not read.

A listing (.lst) has four decimals, too few for a point, and is not read. Layout: GAMS 54.6.1.
"""

from __future__ import annotations

import re
from typing import Final

from ..statuses import of_gams
from .text import Cursor, RawSolution, Reader, begins, named_numbers, shown, without_point

_EPS = re.compile(rb",[ ]*EPS[ ]*$", re.MULTILINE)
_NO_VALUE: Final = {b"NA", b"UNDF"}


def parse_csv(data: bytes) -> RawSolution:
    """Read a CSV. Raises SolutionError for NA, UNDF, other words that are not numbers, and a cut."""
    cursor = Cursor(data)
    status, words = of_gams(_state(cursor, "model_status"), _state(cursor, "solver_status"))
    if data.startswith(b"problem,", cursor.position):
        cursor.line("problem")  # the caller for every kind of file checks it
    text = cursor.after(b"objective,", "objective")
    objective = None if text in _NO_VALUE else cursor.number(b"0" if text == b"EPS" else text)
    if not status.promises_point:
        return without_point(status, words)
    if b"EPS" in data:
        data = _EPS.sub(b",0", data)
    names, values = named_numbers(data.replace(b",", b" "), cursor.position, len(data), 2)
    if not len(values):
        raise cursor.fault("no columns follow")
    return RawSolution(status, words, objective, names, values)


def _state(cursor: Cursor, expected: str) -> int:
    text = cursor.after(f"{expected},".encode(), expected)
    if not re.fullmatch(rb"\d{1,3}", text):
        raise cursor.fault(f"{shown(text)} is not the number of a state")
    return int(text)


READERS: Final = (
    Reader(
        "gams-csv", "GAMS, the CSV that our models write with --RESULTS", begins(rb"model_status,"), parse_csv
    ),
)
