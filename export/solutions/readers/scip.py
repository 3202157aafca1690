r"""Solution files of SCIP.

    solution status: optimal solution found          the shell writes this line, the library does not
    objective value:                                -14.4
    b                                                   1 \t(obj:-3)

The columns are in no particular order and those at 0 are omitted, unless write/printzeros is set. Values may
be +infinity or -infinity; a partial solution has the value `unknown`, which no point can have. Without a
point the last line is `no solution available`. SCIP adds columns of its own (nlobjvar, quadobjvar,
qmatrixvar, objconstvar). Without a status a point counts as feasible. Layouts: SCIP 10.0; words
of the status: SCIPprintStatus.
"""

from __future__ import annotations

from typing import Final

from ..statuses import Status, of_scip
from .text import (
    Cursor,
    RawSolution,
    Reader,
    begins,
    labelled_numbers,
    one_line,
    shown,
    without_point,
    words_of_line,
)

_STATUS_LABEL: Final = b"solution status:"
_OBJECTIVE_LABEL: Final = b"objective value:"
_UNKNOWN: Final = b"unknown"
_NONE: Final = b"no solution available"


def parse(data: bytes) -> RawSolution:
    """Read a file. Raises SolutionError for `unknown`, other words that are not numbers, and a cut."""
    cursor = Cursor(data)
    words, status = b"", Status.FEASIBLE
    line = cursor.line("the status or the objective")
    if line.startswith(_STATUS_LABEL):
        words = line.removeprefix(_STATUS_LABEL).strip()
        status = of_scip(words.decode(errors="replace"))
        line = cursor.line("the objective")
    if line == _NONE:
        silent = status is Status.FEASIBLE
        return without_point(Status.NO_POINT if silent else status.without_point, words or line)
    if not line.startswith(_OBJECTIVE_LABEL):
        raise cursor.fault(f"{shown(line)} stands where the objective should")
    text = line.removeprefix(_OBJECTIVE_LABEL).strip()
    if text == _UNKNOWN:
        raise cursor.fault("this is a partial solution, with columns of unknown value")
    objective = cursor.number(text)
    per_line = 3 if len(words_of_line(data, cursor.position)) == 3 else 2  # the cost is the third word
    names, values = labelled_numbers(data, cursor.position, len(data), per_line, label=0, numeric=(1,))
    return RawSolution(status, one_line(words), objective, names, values[:, 0], omits_zeros=True)


READERS: Final = (
    Reader("scip", "SCIP .sol", begins(b"|".join((_STATUS_LABEL, _OBJECTIVE_LABEL, _NONE))), parse),
)
