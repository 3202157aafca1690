"""Progress and root bound of a run from its log."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator
from typing import Final

Row = tuple[str, str, str]
"""Words of a row of a table of progress: time (empty if the row has none), dual bound, best objective."""
Step = tuple[float, float | None, float | None]
"""Seconds, dual bound and best objective."""
_COIN: Final = re.compile(
    r"^Cbc00\d\dI (?:After \d+ nodes, \d+ on tree, (\S+) best solution, best possible (\S+)"
    r"|Integer solution of (\S+) found.*) \((\S+) seconds\)$",
    re.MULTILINE,
)
_ROOT: Final = {
    "highs": r"^ .? +0 +\d+ +\d+ +\S+% +(\S+) +\S+ +\S+ .*s$",
    "scip": r"^.? *\S+s\| +1 \|(?:[^|]*\|){12} *(\S+) \|",
    "cbc": r"^Continuous objective value is (\S+) -|^Cbc0013I At root node, .* to (\S+) in \d+ pass",
}
"""Patterns of the lower bound at the root, whose last match counts. Bonmin's log has none."""

_LONGEST: Final = 300  # most characters of a line of a table
_HUGE: Final = 1e19  # solvers write infinity as 1e20 and more
_TIMES: Final = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}


def _number(word: str | None) -> float | None:
    """The number in a word, None for anything else and for infinity."""
    try:
        value = float(word or "nan")
    except ValueError:
        return None
    return value if math.isfinite(value) and abs(value) < _HUGE else None


def _seconds(word: str) -> float | None:
    """A time as `6.4s`, `12m`, `3h`, or a plain number of seconds."""
    unit = _TIMES.get(word[-1:])
    value = _number(word if unit is None else word[:-1])
    return None if value is None or value < 0 else value * (unit or 1.0)


def _lines(text: str) -> Iterator[str]:
    return (line for line in text.splitlines() if len(line) < _LONGEST)


def _highs_rows(text: str) -> Iterator[Row]:
    """From the right: time, iterations, conflicts, two counts, gap, objective, bound, share explored."""
    for words in map(str.split, _lines(text)):
        if len(words) >= 11 and words[-1].endswith("s") and words[-9].endswith("%"):
            yield words[-1], words[-8], words[-7]


def _gurobi_rows(text: str) -> Iterator[Row]:
    """From the right: time, iterations per node, gap, bound, objective."""
    for words in map(str.split, _lines(text)):
        if len(words) >= 7 and words[-1].endswith("s") and (words[-3] == "-" or words[-3].endswith("%")):
            yield words[-1], words[-4], words[-5]


_SCIP_HEADER: Final = r"^ *time +\|.*\| *dualbound *\| *primalbound *\|.*$"


def _scip_rows(text: str) -> Iterator[Row]:
    """The header gives the columns of bounds, which differ between versions; a letter precedes the time."""
    header = re.search(_SCIP_HEADER, text, re.MULTILINE)
    if header is None:
        return
    names = [cell.strip() for cell in header[0].split("|")]
    bound, best = names.index("dualbound"), names.index("primalbound")
    for line in _lines(text):
        cells = line.split("|")
        if len(cells) == len(names) and cells[0].strip():
            yield cells[0].split()[-1], cells[bound].strip(), cells[best].strip()


_XPRESS_HEADER: Final = re.compile(r" +(?:Its Type|Node) +BestSoln +BestBound .* Time$")
_XPRESS_ROW: Final = re.compile(r"[A-Za-z* ].{34}.* (\d+)$")


def _xpress_rows(text: str) -> Iterator[Row]:
    """The rows below a header, up to the next empty line; columns have a fixed width and may be blank."""
    inside = False
    for line in text.splitlines():
        inside = bool(_XPRESS_HEADER.match(line)) or (inside and bool(line.strip()))
        row = _XPRESS_ROW.match(line) if inside else None
        if row and _number(line[22:35].strip()) is not None:
            yield row[1], line[22:35].strip(), line[9:22].strip()


_CPLEX_HEADER: Final = "   Node  Left     Objective  IInf  Best Integer    Best Bound"
_CPLEX_NODE: Final = re.compile(r"[* ] {0,7}\d+\+? +\d+ ")
_CPLEX_TIME: Final = re.compile(r"Elapsed time = +(\S+) sec\.|Total \(root\+branch&cut\) = +(\S+) sec\.")


def _cplex_rows(text: str) -> Iterator[Row]:
    """Columns have a fixed width and may be blank; the time is on separate lines."""
    bound = best = ""
    for line in text.partition(_CPLEX_HEADER)[2].splitlines()[1:]:
        if _CPLEX_NODE.match(line):
            shown, integer = line[47:61].strip(), line[33:47].strip()
            bound, best = (
                new if _number(new) is not None else old for new, old in ((shown, bound), (integer, best))
            )
            yield "", bound, best
        elif time := _CPLEX_TIME.match(line):
            yield time[1] or time[2], bound, best


_BARON_BEFORE: Final = re.compile(r" *Lower bound is +(\S+)$")


def _baron_rows(text: str) -> Iterator[Row]:
    """Iteration, time, memory, bound, objective, progress; earlier versions have no memory and progress."""
    for line in _lines(text):
        words = [word for word in line.split() if word != "*" and not word.endswith(("B", "%"))]
        if len(words) == 4 and words[0].isdecimal() and _number(words[2]) is not None:
            yield words[1], words[2], words[3]
        elif before := _BARON_BEFORE.match(line):
            yield "", before[1], ""


_ROWS: Final[dict[str, Callable[[str], Iterable[Row]]]] = {
    "baron": _baron_rows,
    "highs": _highs_rows,
    "gurobi": _gurobi_rows,
    "scip": _scip_rows,
    "xpress": _xpress_rows,
    "cplex": _cplex_rows,
}
"""Functions that yield the rows of the table of progress of a log, by solver."""


def progress(solver: str, text: str) -> Iterator[Step]:
    """Every step that a log shows."""
    if solver in _ROWS:
        for row in _ROWS[solver](text):
            if (time := _seconds(row[0])) is not None:
                yield time, _number(row[1]), _number(row[2])
        return
    bound = best = None
    for objective, possible, incumbent, time in _COIN.findall(text):
        bound = _within(possible) if possible else bound
        best = _within(incumbent or objective) or best
        yield float(time), bound, best


def _within(word: str) -> float | None:
    """A number that is not one of the huge ones by which these programs mean none."""
    value = _number(word)
    return None if value is None or abs(value) > 1e49 else value


def root_bound(solver: str, text: str) -> float | None:
    """The last lower bound before the first branching, as the log rounds it; None where it has none."""
    bounds = re.findall(_ROOT[solver], text, re.MULTILINE) if solver in _ROOT else []
    if not bounds:
        return None
    return _number(bounds[-1] if isinstance(bounds[-1], str) else "".join(bounds[-1]))
