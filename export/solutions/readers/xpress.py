"""Solution files of Xpress, .slx.

    NAME          mip                          NAME .. ENDATA for each solution
      C x                       10
    ENDATA                                     only ENDATA: there was no solution

There is no status: the point counts as feasible. Without an integer solution Xpress writes the relaxation,
which the recomputed violation reveals. .prt has six decimals, .hdr no columns, and .asc the same values: they
are not read. Layouts: Xpress 9.9.1.
"""

from __future__ import annotations

import re
from typing import Final

from ....models.errors import SolutionError
from ..statuses import Status
from .text import (
    Cursor,
    RawSolution,
    Reader,
    begins,
    fault,
    labelled_numbers,
    pooled,
    without_point,
)

_END: Final = b"ENDATA"
_COLUMN: Final = b"\n  C "
_NO_COLUMN = re.compile(rb"\n(?!  C )")


def parse_slx(data: bytes) -> RawSolution:
    """Read an .slx with all its solutions.

    Raises SolutionError for words that are not numbers and for a file that is cut off.
    """
    if not data.rstrip().endswith(_END):
        raise SolutionError("the file is cut off: it has no line ENDATA; let Xpress write it again")
    cursor = Cursor(data if data.endswith(b"\n") else data + b"\n")
    solutions = []
    while cursor.data[cursor.position :].strip() and cursor.line("NAME") != _END:
        start = cursor.position
        cursor.position = stop = data.find(b"\n" + _END, start - 1) + 1
        _check_kinds(data, start, stop)
        names, values = labelled_numbers(data, start, stop, 3, label=1, numeric=(2,))
        solutions.append(RawSolution(Status.FEASIBLE, "", None, names, values[:, 0]))
        cursor.line("ENDATA")
    if not solutions:
        return without_point(Status.NO_POINT, "the file holds no solution")
    return pooled(solutions)


def _check_kinds(data: bytes, start: int, stop: int) -> None:
    """Refuse a block without lines, or with lines that are not of a column."""
    lines = data.count(b"\n", start, stop)
    if not lines:
        raise SolutionError("the file holds no columns; let Xpress write it again")
    if data.count(_COLUMN, start - 1, stop) != lines:
        wrong = _NO_COLUMN.search(data, start - 1, stop)
        at = start if wrong is None else wrong.start() + 1
        raise fault(data, at, "this line is of no column (C)")


_BLOCK: Final = rb"NAME\b[^\n]*\n(?: +[A-Z]+ |ENDATA)|ENDATA[ \t]*(?:\n|\Z)"

READERS: Final = (Reader("xpress-slx", "Xpress .slx", begins(_BLOCK), parse_slx),)
