"""Solution files of Xpress: .slx and .asc.

    NAME          mip                          .slx: NAME .. ENDATA for each solution, the first is taken
      C x                       10
    ENDATA                                     only ENDATA: there was no solution

    1,"c1      ","G","BS",11,0.3,0,11.3,0      .asc: number, name and blanks, kind, state, value, ...
    3,"x       ","C","SB",10,0.1,0,10,0        columns have the kind C and come after the rows

Neither has a status: the point counts as feasible. Without an integer solution
Xpress writes the relaxation, which the recomputed violation reveals. .prt has six decimals and
.hdr no columns: they are not read. Layouts: Xpress 9.9.1.
"""

from __future__ import annotations

import re
from typing import Final

from ....models.errors import SolutionError
from .text import (
    Cursor,
    RawSolution,
    Reader,
    Status,
    begins,
    fault,
    labelled_numbers,
    without_point,
    words_of_line,
)

_END: Final = b"ENDATA"
_COLUMN: Final = b"\n  C "
_NO_COLUMN = re.compile(rb"\n(?!  C )")
_APART = bytes.maketrans(b',"', b"  ")
_FIRST_COLUMN = re.compile(rb'^ *\d+,"[^"\n]*","C",', re.MULTILINE)


def parse_slx(data: bytes) -> RawSolution:
    """Read an .slx; of several solutions, the first, which the message then states.

    Raises SolutionError for words that are not numbers and for a file that is cut off.
    """
    if not data.rstrip().endswith(_END):
        raise SolutionError("the file is cut off: it has no line ENDATA; let Xpress write it again")
    cursor = Cursor(data if data.endswith(b"\n") else data + b"\n")
    line = cursor.line("NAME")
    if line == _END:
        return without_point(Status.NO_POINT, "the file holds no solution")
    start = cursor.position
    stop = data.find(b"\n" + _END, start - 1) + 1
    _check_kinds(data, start, stop)
    names, values = labelled_numbers(data, start, stop, 3, label=1, numeric=(2,))
    solutions = data.count(b"\n" + _END)
    words = f"the first of {solutions} solutions" if solutions > 1 else ""
    return RawSolution(Status.FEASIBLE, words, None, names, values[:, 0])


def _check_kinds(data: bytes, start: int, stop: int) -> None:
    """Refuse a block without lines, or with lines that are not of a column."""
    lines = data.count(b"\n", start, stop)
    if not lines:
        raise SolutionError("the file holds no columns; let Xpress write it again")
    if data.count(_COLUMN, start - 1, stop) != lines:
        wrong = _NO_COLUMN.search(data, start - 1, stop)
        at = start if wrong is None else wrong.start() + 1
        raise fault(data, at, "this line is of no column (C)")


def parse_asc(data: bytes) -> RawSolution:
    """Read an .asc. Raises SolutionError for words that are not numbers and for a cut file."""
    found = _FIRST_COLUMN.search(data)
    if found is None:
        raise SolutionError("the file holds no line of a column (kind C); let Xpress write it again")
    spaced = data.translate(_APART)
    per_line = len(words_of_line(spaced, found.start()))
    names, values = labelled_numbers(spaced, found.start(), len(data), per_line, label=1, numeric=(4,))
    return RawSolution(Status.FEASIBLE, "", None, names, values[:, 0])


_BLOCK: Final = rb"NAME\b[^\n]*\n(?: +[A-Z]+ |ENDATA)|ENDATA[ \t]*(?:\n|\Z)"
_LINE: Final = rb' *\d+,"[^"\n]*","[A-Z]","[A-Z*]{2}",'

READERS: Final = (
    Reader("xpress-slx", "Xpress .slx", begins(_BLOCK), parse_slx),
    Reader("xpress-asc", "Xpress .asc", begins(_LINE), parse_asc),
)
