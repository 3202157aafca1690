"""Solution files of Gurobi, .sol; lists like its .sol: of COPT, of MIPLIB, and plain ones.

    # Solution for model obj               comment lines, which vary; the first may be missing
    # Objective value = -1.44e+01
    x 10                                   name and value of every column, zeros too

A .sol has no status: the point counts as feasible. A MIP start (.mst) looks like one
and holds only the integer columns. Layouts: Gurobi 13.0.3.

MIPLIB's .sol begins with `=obj= value`, and columns at 0 may be omitted. `=infeas=` instead denotes an
infeasible instance (MIPLIB's solution checker). There is no other status: a point counts as feasible.
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
    is_number,
    named_numbers,
    shown,
    without_point,
)

_MARK = re.compile(rb"# ?(?:Solution for model|Objective value|MIP start)\b", re.IGNORECASE)
_OBJECTIVE = re.compile(rb"# ?Objective value ?=? *(\S+)", re.IGNORECASE)
_START = re.compile(rb"# ?MIP start\b", re.IGNORECASE)
_LINES_TO_TELL: Final = 5


def _recognises(head: bytes) -> bool:
    """Whether a file with this start is a .sol of Gurobi, or a list of names and values without comments."""
    if _MARK.match(head):
        return True
    lines = head[: head.rfind(b"\n") + 1].splitlines()
    lines = lines[next((at for at, line in enumerate(lines) if not line.startswith(b"#")), len(lines)) :]
    return bool(lines) and all(map(_is_pair, lines[:_LINES_TO_TELL]))


def _is_pair(line: bytes) -> bool:
    words = line.split()
    return (
        len(words) == 2
        and words[0][-1:] not in b":=,;"
        and not words[0].startswith(b"=")
        and not is_number(words[0])
        and is_number(words[1])
    )


def parse(data: bytes) -> RawSolution:
    """Read a .sol. Raises SolutionError for a MIP start, no values, and words that are not numbers."""
    cursor, objective = Cursor(data), None
    while data.startswith(b"#", cursor.position):
        line = cursor.line("the end of a comment")
        if _START.match(line):
            raise cursor.fault("this is a MIP start, with the integer columns only; the .sol is needed")
        if found := _OBJECTIVE.fullmatch(line):
            objective = cursor.number(found[1])
    names, values = named_numbers(data, cursor.position, len(data), 2)
    if not len(values):
        raise SolutionError("the file holds no values; let the solver write it again")
    return RawSolution(Status.FEASIBLE, "", objective, names, values)


def parse_miplib(data: bytes) -> RawSolution:
    """Read a .sol of MIPLIB. Raises SolutionError for words that are not numbers, and for a cut."""
    cursor = Cursor(data)
    label, *rest = cursor.line("the objective").split()
    if label == b"=infeas=":
        return without_point(Status.INFEASIBLE, label)
    if label != b"=obj=" or len(rest) != 1:
        raise cursor.fault(f"{shown(b' '.join([label, *rest]))} is not =obj= and a number")
    objective = cursor.number(rest[0])
    names, values = named_numbers(data, cursor.position, len(data), 2)
    return RawSolution(Status.FEASIBLE, "", objective, names, values, omits_zeros=True)


READERS: Final = (
    Reader("miplib", "MIPLIB .sol", begins(rb"=obj=|=infeas="), parse_miplib),
    Reader("gurobi", "Gurobi .sol, or any list of names and values", _recognises, parse),
)
