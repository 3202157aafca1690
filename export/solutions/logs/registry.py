"""The table of readers of logs, one entry per solver, and the choice among them by content."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Final, Literal

from ....models.errors import SolutionError, naming
from ....models.input_limits import MAX_LOG
from ....models.storage import read_bytes
from ...statuses import (
    CPLEX_LOG,
    GUROBI_LOG,
    HIGHS,
    OPTIMAL_GAP,
    XPRESS_LOG,
    Status,
    closes,
    of_baron,
    of_log,
    of_scip,
)
from ...writing.stamps import digits_in_text
from .run_log import RunLog, Step, at_least, last, number, seconds, share, thinned, whole

_LONGEST: Final = 300  # most characters of a line of a table

Row = tuple[str, str, str]
"""Words of a row of a table of progress: time (empty if the row has none), dual bound, best objective."""


@dataclass(frozen=True)
class LogReader:
    """A reader of the logs of one solver.

    start: pattern of the start of a run. version: pattern of the version, which may precede the first run.
    end: pattern of the words that state how the search ended. claim: their status, by the program's table.
    facts: patterns by attribute of RunLog, the preferred one first; `rounded` is a bound that the log rounds,
    `tolerance` the relative gap at which the search was to end. rows: the rows of the table of progress.
    from_table: attributes that the table gives if no line does.
    """

    solver: str
    title: str
    start: re.Pattern[str]
    version: str
    end: str
    claim: Callable[[str], Status]
    facts: dict[str, tuple[str, ...]]
    rows: Callable[[str], Iterable[Row]]
    from_table: tuple[str, ...] = ()

    def parse(self, text: str) -> RunLog:
        """The content of the text of one run."""
        words = {name: _first(patterns, text) for name, patterns in self.facts.items()}
        rows = list(self.rows(text))
        bound, best = number(words.get("bound")), number(words.get("objective"))
        trace = tuple(
            Step(time, number(row[1]), number(row[2]))
            for row in rows
            if (time := seconds(row[0])) is not None
        )
        shown = bound
        if bound is None and "bound" in self.from_table:
            in_rows = (row[1] for row in reversed(rows) if number(row[1]) is not None)
            rounded = words.get("rounded") or next(in_rows, None)
            shown, bound = number(rounded), at_least(rounded)
        if best is None and "objective" in self.from_table and trace:
            best = trace[-1].objective
        return RunLog(
            self.solver,
            ended=self._end(text, shown, best, share(words.get("tolerance"))),
            bound=bound,
            objective=best,
            seconds=number(words.get("seconds")),
            threads=whole(words.get("threads")),
            limit=number(words.get("limit")),
            columns=whole(words.get("columns")),
            rows=whole(words.get("rows")),
            trace=trace,
        )

    def _end(
        self, text: str, bound: float | None, best: float | None, tolerance: float | None
    ) -> Literal["optimal", "limit"] | None:
        """How the search ended; None if the log does not state it.

        A claim of optimality needs a bound close to the objective, or a small tolerance without objective.
        bound: as the log shows it, without the allowance for its rounding.
        """
        words = last(self.end, text)
        if words is None:
            return None
        if bound is None or self.claim(words) is not Status.OPTIMAL_GLOBAL:
            return "limit"
        near = (tolerance or 0.0) <= OPTIMAL_GAP[0] if best is None else closes(bound, best)
        return "optimal" if near else "limit"


def _first(patterns: tuple[str, ...], text: str) -> str | None:
    return next(filter(None, (last(each, text) for each in patterns)), None)


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
        if row and number(line[22:35].strip()) is not None:
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
                new if number(new) is not None else old for new, old in ((shown, bound), (integer, best))
            )
            yield "", bound, best
        elif time := _CPLEX_TIME.match(line):
            yield time[1] or time[2], bound, best


_BARON_BEFORE: Final = re.compile(r" *Lower bound is +(\S+)$")


def _baron_rows(text: str) -> Iterator[Row]:
    """Iteration, time, memory, bound, objective, progress; earlier versions have no memory and progress."""
    for line in _lines(text):
        words = [word for word in line.split() if word != "*" and not word.endswith(("B", "%"))]
        if len(words) == 4 and whole(words[0]) is not None and number(words[2]) is not None:
            yield words[1], words[2], words[3]
        elif before := _BARON_BEFORE.match(line):
            yield "", before[1], ""


LOG_READERS: Final = (
    LogReader(
        "baron",
        "BARON",
        re.compile(r"^ *BARON version \d", re.MULTILINE),
        version=r"^ *BARON version (\d[\d.]*\d)",
        end=r"^ +\*\*\* (.+?) \*\*\* *$",
        claim=partial(of_baron, has_table=True, unbounded=False),
        facts={
            "bound": (r"^Best possible += +(\S+)$",),
            "objective": (r"^Solution += +(\S+)",),
            "seconds": (r"^ *Wall clock time: +(\S+)$",),
        },
        rows=_baron_rows,
        from_table=("bound", "objective"),
    ),
    LogReader(
        "highs",
        "HiGHS",
        re.compile(r"^(?:Running HiGHS |(?:LP|QP|MIP|MIQP)\b.* has \d+ rows; \d+ cols; )", re.MULTILINE),
        version=r"^Running HiGHS (\S+)",
        end=r"^ +Status +(\S.*?) *$",
        claim=partial(of_log, HIGHS),
        facts={
            "bound": (r"^ +Dual bound +(\S+)$",),
            "objective": (r"^ +Primal bound +(\S+)$",),
            "tolerance": (r"^ +Gap +\S+ \(tolerance: (\S+)\)$",),
            "seconds": (r"^ +Timing +(\S+)",),
            "threads": (r"^ +Thread count (\d+) ", r"^ +Thread count: .* across (\d+) threads"),
            "columns": (r"^\S+ .*has \d+ rows; (\d+) cols;",),
            "rows": (r"^\S+ .*has (\d+) rows; \d+ cols;",),
        },
        rows=_highs_rows,
    ),
    LogReader(
        "gurobi",
        "Gurobi",
        re.compile(r"^Gurobi Optimizer version ", re.MULTILINE),
        version=r"^Gurobi Optimizer version (\S+)",
        end=r"^(Optimal solution found|\w+ limit reached|Interrupt request received)",
        claim=partial(of_log, GUROBI_LOG),
        facts={
            "bound": (r"^Best objective \S+, best bound (\S+), gap",),
            "objective": (r"^Best objective (\S+), best bound \S+, gap",),
            "tolerance": (r"^Optimal solution found \(tolerance (\S+)\)",),
            "seconds": (r"^Explored .* in (\S+) seconds",),
            "threads": (r"using up to (\d+) threads?",),
            "limit": (r"^TimeLimit  (\S+)$",),
            "columns": (r"^Optimize a model with \d+ rows, (\d+) columns",),
            "rows": (r"^Optimize a model with (\d+) rows",),
        },
        rows=_gurobi_rows,
    ),
    LogReader(
        "scip",
        "SCIP",
        re.compile(r"^(?:SCIP version |original problem has \d+ variables)", re.MULTILINE),
        version=r"^SCIP version (\S+)",
        end=r"^SCIP Status +: (?:.*\[)?(.+?)\]? *$",
        claim=of_scip,
        facts={
            "bound": (r"^Dual Bound +: (\S+)",),
            "objective": (r"^Primal Bound +: (\S+)",),
            "seconds": (r"^Solving Time \(sec\) : (\S+)$",),
            "columns": (r"^original problem has (\d+) variables \([^)]*\) and \d+ constraints",),
            "rows": (r"^original problem has \d+ variables \([^)]*\) and (\d+) constraints",),
        },
        rows=_scip_rows,
    ),
    LogReader(
        "xpress",
        "Xpress",
        re.compile(r"^FICO Xpress .*v\d", re.MULTILINE),
        version=r"Xpress.* v([\d.]+)",
        end=r"\*\*\* Search (completed|unfinished) \*\*\*",
        claim=partial(of_log, XPRESS_LOG),
        facts={
            "bound": (r"^Final MIP bound +: (\S+)$",),
            "objective": (r"^Final MIP objective +: (\S+)$",),
            "seconds": (r"^ +Solution time / primaldual integral : +([\d.]+)s",),
            "threads": (r"using (?:up to )?(\d+) threads?",),
            "limit": (r"^TIMELIMIT = (\S+)$",),
            "columns": (r"^Original problem has:\n +\d+ rows +(\d+) cols",),
            "rows": (r"^Original problem has:\n +(\d+) rows +\d+ cols",),
        },
        rows=_xpress_rows,
    ),
    LogReader(
        "cplex",
        "CPLEX",
        re.compile(
            r"^(?:Version identifier: \d|Welcome to IBM.*CPLEX|--- GAMS/CPLEX|IBM ILOG CPLEX)", re.MULTILINE
        ),
        version=r"(?:Version identifier:|Interactive Optimizer) +([\d.]+)",
        end=r"^(MIP - .*|Proven optimal solution)",
        claim=partial(of_log, CPLEX_LOG),
        facts={
            "bound": (
                r"^Current MIP best bound = +(\S+)",
                r"^MIP - Integer optimal solution: +Objective = +(\S+)",
            ),
            "rounded": (r"^Best possible: +(\S+)",),
            "objective": (r"^MIP - .*Objective = +(\S+)", r"^MIP Solution: +(\S+)"),
            "tolerance": (r"^MIP - Integer optimal, tolerance \(([^/]+)/",),
            "seconds": (r"^Total \(root\+branch&cut\) = +(\S+) sec", r"^Solution time = +(\S+) sec"),
            "threads": (r"using (?:up to )?(\d+) threads?\.",),
            "limit": (r"^CPXPARAM_TimeLimit +(\S+)$",),
        },
        rows=_cplex_rows,
        from_table=("bound",),
    ),
)
"""The first one that recognises a log reads it: BARON and GAMS name the solvers that they call."""


def read_log(path: str | Path) -> RunLog:
    """Read a solver's log for the last run that it describes.

    Raises InputError when the file cannot be opened or has more than MAX_LOG bytes. Raises SolutionError when
    it is not a log of a known solver, or states neither a bound nor an objective.
    """
    data = read_bytes(Path(path), MAX_LOG, "give the part of the last run")
    with naming(path):
        return parse_log(data)


def parse_log(data: bytes) -> RunLog:
    """Read the content of a log. Raises SolutionError."""
    text = data.decode("utf-8-sig", "replace").replace("\r\n", "\n")
    for reader in LOG_READERS:
        starts = [found.start() for found in reader.start.finditer(text)]
        if starts:
            found = reader.parse(text[starts[-1] :])
            if (found.bound, found.objective) == (None, None) and not found.trace:
                raise SolutionError(
                    f"this log of {reader.title} states neither a bound nor an objective; give one of a run "
                    "that began its search"
                )
            version = last(reader.version, text)
            return replace(
                found, version=version, trace=_trace(found), stamps=digits_in_text(text.encode()), text=text
            )
    known = ", ".join(sorted(reader.title for reader in LOG_READERS))
    raise SolutionError(f"this is not a log of a known solver; give one of {known}, or the bound itself")


def _trace(found: RunLog) -> tuple[Step, ...]:
    """The steps of a run, including its end if the log states it."""
    if found.seconds is None:
        return thinned(found.trace, found.bound)
    before = found.trace[-1].objective if found.trace else None
    best = before if found.objective is None else found.objective
    return thinned((*found.trace, Step(found.seconds, found.bound, best)), found.bound)
