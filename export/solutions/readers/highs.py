"""Solution files of HiGHS: style 0 (raw) and style 4 (sparse).

Layout, as HiGHS 1.16.0 writes it (HighsModelUtils.cpp, writeModelSolution):

    Model status
    Time limit reached              words with blanks
                                    an empty line
    # Primal solution values
    Feasible                        or Infeasible; or None, and then no point follows
    Objective -14.4                 with the constant of the objective
    Objective_bound -14.5           since 1.16, of problems with integers: the dual bound
    MIP_rel_gap 0.007               likewise
    # Columns 5                     style 4: `-3 sparse`, with the number of columns that are not zero
    x 10                            name and value; style 4: and the column's number
    ...
    # Rows 2                        only style 0; rows, dual values and a basis follow, not needed here

Values below 1e-13 in size are written as 0. Styles 1 and 3 round to some six digits: they are refused. Style
2 has GLPK's layout and goes to its reader. HiGHS reports `Optimal` for local points of non-convex quadratic
problems, which are outside its documented classes. The caller checks the class of the problem.
"""

from __future__ import annotations

import re
from typing import Final

import numpy as np

from ....models.errors import SolutionError
from ....models.instance.grid import Floats
from ..statuses import HIGHS, Status
from .text import Bytes, Cursor, RawSolution, Reader, named_numbers, one_line, shown

_OTHER_STYLES: Final = {
    re.compile(rb"Columns\n +Index +Status"): "style 1 (pretty), which has six digits only",
    re.compile(rb"Problem:"): "style 3 (GLPK pretty), which has six digits only",
}
_COLUMNS = re.compile(rb"# Columns (-?)(\d{1,12})( sparse)?")


def parse(data: bytes) -> RawSolution:
    """Read a file of style 0 or 4.

    Raises SolutionError for other styles, a cut, words that are not numbers, and counts that do not fit.
    """
    if (style := _other_style(data)) is not None:
        raise SolutionError(
            f"this is HiGHS {style}; write it with write_solution_style = 0 (raw) or 4 (sparse)"
        )
    cursor = Cursor(data)
    words = _words(cursor)
    primal = cursor.line("Feasible, Infeasible or None")
    if primal == b"None":
        return _without_point(words)
    if primal not in {b"Feasible", b"Infeasible"}:
        raise cursor.fault(f"{shown(primal)} is not Feasible, Infeasible or None")
    objective = cursor.number(cursor.after(b"Objective ", "the objective"))
    bound = _optional(cursor, b"Objective_bound ")
    _optional(cursor, b"MIP_rel_gap ")
    sparse, names, values = _columns(cursor)
    status = _status(words, feasible=primal == b"Feasible")
    rows = _rows(cursor)
    return RawSolution(status, one_line(words), objective, names, values, sparse, rows, bound=bound)


def _other_style(head: bytes) -> str | None:
    return next((style for pattern, style in _OTHER_STYLES.items() if pattern.match(head)), None)


def _words(cursor: Cursor) -> bytes:
    """Read the model status, with the heads before and after it."""
    _expect(cursor, b"Model status")
    words = cursor.line("the model status")
    _expect(cursor, b"")
    _expect(cursor, b"# Primal solution values")
    return words


def _optional(cursor: Cursor, head: bytes) -> float | None:
    """The number on the next line, if that line begins with a head and the number is finite."""
    if not cursor.data.startswith(head, cursor.position):
        return None
    value = cursor.number(cursor.after(head, "a number"))
    return value if np.isfinite(value) else None


def _expect(cursor: Cursor, expected: bytes) -> None:
    label = repr(expected.decode()) if expected else "an empty line"
    line = cursor.line(label)
    if line != expected:
        raise cursor.fault(f"{shown(line)} stands where {label} should")


def _status(words: bytes, *, feasible: bool) -> Status:
    status = HIGHS.get(words.decode(errors="replace"), Status.ERROR)
    return status if feasible else status.without_point


def _without_point(words: bytes) -> RawSolution:
    if words == b"Optimal":
        raise SolutionError("line 5: the file is Optimal but holds no point; let the solver write it again")
    return RawSolution(
        _status(words, feasible=False), one_line(words), None, np.empty(0, dtype="S1"), np.empty(0)
    )


def _columns(cursor: Cursor) -> tuple[bool, Bytes, Floats]:
    """Whether zeros are omitted, names and values; the cursor moves behind them."""
    line = cursor.line("the number of columns")
    found = _COLUMNS.fullmatch(line)
    if found is None:
        raise cursor.fault(f"{shown(line)} is not the number of columns")
    count = int(found[2])
    # Before 1.16, a sparse file of the point 0 had `# Columns 0` too.
    sparse = bool(found[1] or found[3]) or count == 0
    start, data = cursor.position, cursor.data
    rows = data.find(b"\n# Rows ", start - 1) + 1
    stop = len(data) if rows == 0 else rows
    held = data.count(b"\n", start, stop)
    if held != count:
        raise cursor.fault(f"{count} columns are announced, {held} whole lines follow")
    names, values = named_numbers(data, start, stop, 3 if sparse else 2)
    cursor.position = stop
    return sparse, names, values


def _rows(cursor: Cursor) -> int | None:
    """The number of rows, if the file continues with rows."""
    if cursor.at_end:
        return None
    cursor.line("the number of rows")
    return Cursor(cursor.data[cursor.before + len(b"# Rows ") : cursor.position]).count("the number of rows")


def _recognises(head: bytes) -> bool:
    return head.startswith(b"Model status\n") or _other_style(head) is not None


READERS: Final = (Reader("highs", "HiGHS, solution style 0 (raw) or 4 (sparse)", _recognises, parse),)
