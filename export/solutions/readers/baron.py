"""Files of BARON: the results res.lst, and the line tim.lst for the status only.

    ...                                      res.lst: log of all points found, by number; not read
                *** Normal completion ***    how the search ended
    The best solution found is:

      variable        xlo     xbest    xup
      x               0       10       10    name, lower bound, value, upper bound, until an empty line

    The above solution has an objective value of:  -14.4

Normal completion is a global proof: of the optimum, of infeasibility without a table, of unboundedness
when a ray follows it. It is not a proof when the options FirstFeas or FirstLoc stopped the search: then the
point counts as feasible. Only tim.lst reports missing bounds, without which nothing is proven. sum.lst begins
like res.lst and has no values: it is refused. A tim.lst has one line:

    problem 2 16 10189 50 0.18 0.19 1 1 0 13 5 3 0.24 0.37

These are name, constraints, variables, (two more,) lower and upper bound, solver status, model status,
missing bounds, iterations, node of the best point (-3: there is none), nodes in memory, seconds of processor
and clock; older versions have fewer at the end. We always minimise. Model status 1 also occurs with
FirstFeas, which tim.lst does not report. Layouts: BARON 26.5.27; codes: BARON.jl and Pyomo's reader.
"""

from __future__ import annotations

import re
from typing import Final

from ....models.errors import SolutionError
from ....models.instance.grid import Floats
from .text import (
    Bytes,
    Cursor,
    RawSolution,
    Reader,
    Status,
    begins,
    is_number,
    labelled_numbers,
    one_line,
    shown,
    without_point,
)

_SUMMARY: Final = b"\n Best solution found at node:"
_BANNER = re.compile(rb"^ *\*\*\* ([^*\n]{3,100}?) \*\*\* *$", re.MULTILINE)
_TABLE: Final = b"\nThe best solution found is"
_HEADER: Final = b"variable"
_OBJECTIVE: Final = b"The above solution has an objective value of:"
_FIRST = re.compile(rb"^ +first(?:feas|loc) += +1$", re.MULTILINE)
_POINT: Final = b">>> Objective value is:"
_INFINITE: Final = 1e50
_RAY: Final = b"unbounded ray:"
_NORMAL: Final = b"Normal completion"
_STOPPED = re.compile(rb"max\. allowable|memory|interrupt", re.IGNORECASE)

_FEWEST_WORDS: Final = 9
_MOST_WORDS: Final = 20
_MODEL: Final = {
    1: (Status.OPTIMAL_GLOBAL, "optimal"),
    2: (Status.INFEASIBLE, "infeasible"),
    3: (Status.UNBOUNDED, "unbounded"),
    4: (Status.FEASIBLE, "feasible"),
    5: (Status.LIMIT_WITHOUT_POINT, "unknown"),
}
_SOLVER: Final = {
    1: "normal completion",
    2: "out of memory for nodes",
    3: "iteration limit",
    4: "time limit",
    5: "numerical difficulties",
    6: "user interrupt",
    7: "out of memory",
    8: "insufficient progress",
    9: "terminated by BARON",
    10: "syntax error",
    11: "licensing error",
}
_LIMITS: Final = {2, 3, 4, 6, 7}
_UNPROVEN: Final = {
    Status.OPTIMAL_GLOBAL: Status.OPTIMAL_LOCAL,
    Status.INFEASIBLE: Status.LIMIT_WITHOUT_POINT,
}
"""Remaining status of a claim when bounds of columns are missing."""

_NO_NODE: Final = b"-3"


def _recognises_times(head: bytes) -> bool:
    """Whether a file with this start is a tim.lst: one line of a name and numbers."""
    words = head.split()
    alone = len(head.strip().splitlines()) == 1 and _FEWEST_WORDS <= len(words) <= _MOST_WORDS
    return alone and not is_number(words[0]) and all(map(is_number, words[1:]))


def parse_results(data: bytes) -> RawSolution:
    """Read a res.lst. Raises SolutionError for a sum.lst, a cut, and words that are not numbers."""
    if _SUMMARY in data:
        raise SolutionError("this is the summary of BARON, which holds no values; give its results, res.lst")
    banners = [found[1] for found in _BANNER.finditer(data)]
    if not banners:
        raise SolutionError("the file is cut off: the end of the search is missing; let BARON write it again")
    words = one_line(banners[-1])
    at = data.rfind(_TABLE)
    status = _status(banners[-1], has_table=at >= 0, unbounded=_RAY in data[max(at, 0) :])
    if status is Status.OPTIMAL_GLOBAL and _FIRST.search(data):
        status = Status.FEASIBLE
    if at < 0 or status is Status.UNBOUNDED:
        if at < 0 and _POINT in data:
            raise SolutionError(
                "the file is cut off: points were found, and the table of the best is not there"
            )
        return without_point(status, words)
    names, values, objective = _table(data, at + 1)
    if abs(objective) >= _INFINITE:
        return without_point(Status.UNBOUNDED, words)
    return RawSolution(status, words, objective, names, values)


def _status(banner: bytes, *, has_table: bool, unbounded: bool) -> Status:
    if banner == _NORMAL:
        proven = Status.OPTIMAL_GLOBAL if has_table else Status.INFEASIBLE
        return Status.UNBOUNDED if unbounded else proven
    if has_table:
        return Status.LIMIT_WITH_POINT
    return Status.LIMIT_WITHOUT_POINT if _STOPPED.search(banner) else Status.ERROR


def _table(data: bytes, position: int) -> tuple[Bytes, Floats, float]:
    """Names and values of the best solution, and its objective."""
    cursor = Cursor(data, position)
    for _ in range(2):
        cursor.line("the table of the best solution")
    cursor.after(_HEADER, "the head of the table")
    stop = data.find(b"\n\n", cursor.position - 1) + 1
    if not stop:
        raise cursor.fault("the table is cut off")
    names, values = labelled_numbers(data, cursor.position, stop, 4, label=0, numeric=(2,))
    cursor.position = stop + 1
    return names, values[:, 0], cursor.number(cursor.after(_OBJECTIVE, "the objective"))


def parse_times(data: bytes) -> RawSolution:
    """Read the status in a tim.lst, without a point. Raises SolutionError for unknown codes or a cut."""
    if not data.endswith(b"\n"):
        raise SolutionError("line 1: the line is cut off; let BARON write the file again")
    words = data.split()
    solver, model = _code(words[7]), _code(words[8])
    status, text = _MODEL.get(model, (Status.ERROR, f"model status {model}"))
    found = words[11:12] != [_NO_NODE]
    if status is Status.FEASIBLE and solver in _LIMITS:
        status = Status.LIMIT_WITH_POINT if found else Status.LIMIT_WITHOUT_POINT
    if words[9:10] not in ([], [b"0"]):
        status, text = _UNPROVEN.get(status, status), f"{text}, bounds are missing"
    if status is Status.LIMIT_WITHOUT_POINT and solver not in _LIMITS | {1}:
        status = Status.ERROR
    return without_point(status, f"{text}; {_SOLVER.get(solver, f'solver status {solver}')}")


def _code(word: bytes) -> int:
    if not re.fullmatch(rb"\d{1,3}", word):
        raise SolutionError(
            f"line 1: {shown(word)} is not the number of a status; let BARON write the file again"
        )
    return int(word)


READERS: Final = (
    Reader("baron-res", "BARON results (res.lst)", begins(rb"=+\n BARON version "), parse_results),
    Reader("baron-tim", "BARON times (tim.lst), for the status alone", _recognises_times, parse_times),
)
