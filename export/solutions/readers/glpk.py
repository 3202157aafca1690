"""Solution files of GLPK, `glpsol -w file`: no names, columns by their number.

    c Problem:    tiny                     comments; an LP file has no name, an MPS file the one after NAME
    ...
    s mip 2 5 o -14.4                      kind, rows, columns, status, objective
    i 1 1.3                                rows; s ipt adds the dual value, s bas a letter and the dual value
    j 1 10                                 columns, in the order of the LP or MPS file
    e o f

Status letters: o optimal, f feasible, i infeasible point, n no solution, u undefined; s bas has one for the
primal and one for the dual side. The problem's name determines the order of the columns. Our LP files put ONE
first and have no name, our MPS files put it last; in a .mod the objective is named energy, which is the first
row too. `glpsol -o` writes six digits and breaks lines: it is not read. HiGHS writes the same layout as its
style 2 and counts the objective as one more row, which the comparison of sizes detects. Layouts:
GLPK 5.0.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

import numpy as np

from ....models.errors import SolutionError
from ....models.instance.domain import Floats
from ...statuses import Status, claim_of
from ...writing.canonical import ColumnOrder
from .grammar import EntryForm, line_error, place_of_entry, quoted
from .text import Cursor, RawSolution, Reader, read_entries, solution_without_point

_SUMMARY = re.compile(rb"s (mip|bas|ipt) (\d{1,12}) (\d{1,12}) (.+) (\S+)")
_END: Final = b"e o f"
_BEGIN = re.compile(rb"^[ \t]*(?:c Problem:|s (?:mip|bas|ipt) )", re.MULTILINE)
_LAST = re.compile(rb"^[ \t]*e o f[ \t]*$", re.MULTILINE)
_GOAL_OF_MOD: Final = b"energy ="
_FORMS: Final = {
    b"mip": EntryForm("j index value"),
    b"ipt": EntryForm("j index value number"),
    b"bas": EntryForm("j index word value number"),
}
_COLUMNS = re.compile(rb"^[ \t\f\v]*j[ \t\f\v]", re.MULTILINE)


class _Summary(NamedTuple):
    """The line that begins with s: kind, rows, columns, status and objective."""

    form: EntryForm
    rows: int
    columns: int
    status: Status
    objective: float


def parse(data: bytes) -> RawSolution:
    """Read a file. Raises SolutionError for counts that do not fit and for a cut file."""
    data = _without_other_text(data)
    cursor = Cursor(data)
    comments = _comments(cursor)
    order = _order(comments)
    summary = _summary(cursor)
    message = comments.get(b"Status", b"").decode(errors="replace").lower()
    if not data.rstrip().endswith(b"\n" + _END):
        raise SolutionError("the file is cut off: it has no line `e o f`; let the solver write it again")
    if summary.status in {Status.INFEASIBLE, Status.UNBOUNDED}:
        return solution_without_point(summary.status, message, rows=summary.rows)
    values = _columns(data, cursor.position, summary)
    return RawSolution(
        summary.status, message, summary.objective, None, values, rows=summary.rows, order=order
    )


def _without_other_text(data: bytes) -> bytes:
    """The answer in a text, in its lines: empty lines replace the text before it."""
    begin, end = _BEGIN.search(data), _LAST.search(data)
    start = begin.start() if begin else 0
    return b"\n" * data.count(b"\n", 0, start) + data[start : end.end() if end else len(data)]


def _comments(cursor: Cursor) -> dict[bytes, bytes]:
    """The content of the comments; the cursor moves to the line after them."""
    comments: dict[bytes, bytes] = {}
    start = cursor.position
    while re.match(rb"c(?:\s|$)", cursor.line("the line of counts and status")):
        label, _, text = cursor.data[cursor.before : cursor.position].strip()[1:].partition(b":")
        comments.setdefault(label.strip(), text.strip())
        start = cursor.position
    cursor.position = start
    return comments


def _order(comments: dict[bytes, bytes]) -> ColumnOrder:
    if comments.get(b"Objective", b"").startswith(_GOAL_OF_MOD):
        return "mod"
    return "mps" if comments.get(b"Problem") else "lp"


def _summary(cursor: Cursor) -> _Summary:
    line = cursor.line("the line of counts and status")
    match = _SUMMARY.fullmatch(line)
    if match is None:
        raise cursor.fault(f"{quoted(line)} is not kind, rows, columns, status and objective")
    status, _ = claim_of(match[4].decode(errors="replace"), "glpk")
    return _Summary(_FORMS[match[1]], int(match[2]), int(match[3]), status, cursor.number(match[5]))


def _columns(data: bytes, start: int, summary: _Summary) -> Floats:
    first = _COLUMNS.search(data, start)
    start = first.start() if first else data.rfind(_END)
    columns = read_entries(data, start, summary.form)
    following = data[columns.end :].lstrip()
    if not following.startswith(_END):
        line = following.split(b"\n", 1)[0]
        raise line_error(data, columns.end, summary.form.fault(line))
    if len(columns.values) != summary.columns:
        raise line_error(
            data, start, f"{summary.columns} columns are announced, {len(columns.values)} lines follow"
        )
    wrong = columns.numbers != np.arange(1, summary.columns + 1)
    if wrong.any():
        at = int(np.argmax(wrong))
        raise line_error(data, place_of_entry(data, start, at), f"this is not the line of column {at + 1}")
    return columns.values


READER: Final = Reader("glpk", "GLPK, glpsol -w", lambda head: _BEGIN.search(head) is not None, parse)
