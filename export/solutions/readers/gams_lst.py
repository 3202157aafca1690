"""Listings of GAMS (.lst), for the status only: values have four decimals, too few for a point.

                   S O L V E      S U M M A R Y
    **** SOLVER STATUS     1 Normal Completion
    **** MODEL STATUS      2 Locally Optimal

Several solves write several summaries: the last one counts, and `**** FILE SUMMARY` ends the listing. A model
that does not compile has none, but `**** 2 ERROR(S)`. Layout: GAMS 54.6.1.
"""

from __future__ import annotations

import re
from typing import Final

from ....models.errors import SolutionError
from .gams_csv import status_of
from .text import RawSolution, Reader, Status, begins, without_point

_SUMMARY: Final = b"S O L V E      S U M M A R Y"
_LONGEST_SUMMARY: Final = 4096
_END: Final = b"\n**** FILE SUMMARY"
_STATES = re.compile(
    rb"^\*\*\*\* SOLVER STATUS +(\d{1,3})\b[^\n]*\n\*\*\*\* MODEL STATUS +(\d{1,3})\b[^\n]*\n", re.MULTILINE
)
_ERRORS = re.compile(rb"^\*\*\*\* +(\d+ ERROR\(S\)[^\n]*|USER ERROR\(S\) ENCOUNTERED)", re.MULTILINE)


def parse(data: bytes) -> RawSolution:
    """The status of the last solve in a listing, without a point.

    Raises SolutionError when it is cut off or has neither a solve nor an error.
    """
    at = data.rfind(_SUMMARY)
    if at < 0:
        return _without_solve(data)
    states = _STATES.search(data, at, at + _LONGEST_SUMMARY)
    if states is None:
        raise SolutionError("the listing is cut off in the summary of its last solve; run GAMS again")
    if data.find(_END, states.end()) < 0:
        raise SolutionError("the listing is cut off after a solve: it has no FILE SUMMARY; run GAMS again")
    status, words = status_of(int(states[2]), int(states[1]))
    return without_point(status, words)


def _without_solve(data: bytes) -> RawSolution:
    found = _ERRORS.search(data)
    if found is None:
        raise SolutionError("the listing has no summary of a solve; let the GAMS file run to its end")
    return without_point(Status.ERROR, found[1])


_PAGE: Final = rb"(?m)GAMS [^\n]{1,200} Page 1[ \t]*$"

READERS: Final = (Reader("gams-lst", "GAMS listing (.lst), for the status alone", begins(_PAGE), parse),)
