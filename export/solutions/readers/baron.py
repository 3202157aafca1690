"""Results of BARON, res.lst.

    ...                                      res.lst: log of all points found, by number; not read
                *** Normal completion ***    how the search ended
    The best solution found is:

      variable        xlo     xbest    xup
      x               0       10       10    name, lower bound, value, upper bound, until an empty line

    The above solution has an objective value of:  -14.4

Normal completion proves an optimum within the gaps that the file states, infeasibility without a table,
unboundedness when a ray follows it. It proves nothing when an option may have ended the search earlier
(FirstFeas, FirstLoc, DeltaTerm, Target): then the point counts as feasible. sum.lst begins like
res.lst and has no values: it is refused. Layouts: BARON 26.5.27; codes: BARON.jl and Pyomo's reader.
"""

from __future__ import annotations

import re
from typing import Final

from ....models.errors import SolutionError
from ....models.instance.domain import Floats
from ...statuses import Status, status_of_baron
from .grammar import EntryForm, float_of, is_number
from .text import (
    Bytes,
    Cursor,
    RawSolution,
    Reader,
    one_line,
    read_entries,
    solution_without_point,
    starts_with,
)

_SUMMARY: Final = b"\n Best solution found at node:"
_BANNER = re.compile(rb"^ *\*\*\* ([^*\n]{3,100}?) \*\*\* *$", re.MULTILINE)
_TABLE: Final = b"\nThe best solution found is"
_HEADER: Final = b"variable"
_ROW: Final = EntryForm("name number value number")
_OBJECTIVE: Final = b"The above solution has an objective value of:"
_EARLY = re.compile(
    rb"^ +(?:first(?:feas|loc)|deltaterm) += +1$|^ +target += +(?!-0\.1000E\+52)", re.MULTILINE
)
_GAP = re.compile(rb"^ +eps(a|r) += +(\S+)$", re.MULTILINE)
_POINT: Final = b">>> Objective value is:"
_INFINITE: Final = 1e50
_RAY: Final = b"unbounded ray:"


def parse_results(data: bytes) -> RawSolution:
    """Read a res.lst. Raises SolutionError for a sum.lst, a cut, and words that are not numbers."""
    if _SUMMARY in data:
        raise SolutionError("this is the summary of BARON, which holds no values; give its results, res.lst")
    banners = [match[1] for match in _BANNER.finditer(data)]
    if not banners:
        raise SolutionError("the file is cut off: the end of the search is missing; let BARON write it again")
    words = one_line(banners[-1])
    at = data.rfind(_TABLE)
    status = status_of_baron(words, has_table=at >= 0, unbounded=_RAY in data[max(at, 0) :])
    if status.is_optimal and _EARLY.search(data):
        status = Status.FEASIBLE
    if at < 0 or status is Status.UNBOUNDED:
        if at < 0 and _POINT in data:
            raise SolutionError(
                "the file is cut off: points were found, and the table of the best is not there"
            )
        return solution_without_point(status, words)
    names, values, objective = _table(data, at + 1)
    if abs(objective) >= _INFINITE:
        return solution_without_point(Status.UNBOUNDED, words)
    bound = _bound(data, objective) if status.is_optimal else None
    return RawSolution(status, words, objective, names, values, bound=bound)


def _bound(data: bytes, objective: float) -> float | None:
    """The dual bound that an optimum within the stated gaps proves; None if the file does not state them."""
    gaps = {name: float_of(word) for name, word in _GAP.findall(data) if is_number(word)}
    return objective - max(gaps[b"a"], gaps[b"r"] * abs(objective)) if len(gaps) > 1 else None


def _table(data: bytes, position: int) -> tuple[Bytes, Floats, float]:
    """Names and values of the best solution, and its objective."""
    cursor = Cursor(data, position)
    cursor.line("the table of the best solution")
    cursor.after(_HEADER, "the head of the table")
    table = read_entries(data, cursor.position, _ROW)
    cursor.position = table.end
    line = cursor.line("the objective")
    if not line.startswith(_OBJECTIVE):
        cut = b"\n" not in data[cursor.before :]
        raise cursor.fault("the table is cut off" if cut else _ROW.fault(line))
    return table.names, table.values, cursor.number(line.removeprefix(_OBJECTIVE).strip())


READER: Final = Reader(
    "baron-res", "BARON results (res.lst)", starts_with(rb"\s*=+\n\s*BARON version "), parse_results
)
