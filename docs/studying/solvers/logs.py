"""Progress and root bound of a run from its log."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from crossfield.export.solutions.logs.registry import LOG_READERS
from crossfield.export.solutions.logs.run_log import number, seconds

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


def progress(solver: str, text: str) -> Iterator[Step]:
    """Every step that a log shows."""
    for reader in LOG_READERS:
        if reader.solver == solver:
            for row in reader.rows(text):
                if (time := seconds(row[0])) is not None:
                    yield time, number(row[1]), number(row[2])
            return
    bound = best = None
    for objective, possible, found, time in _COIN.findall(text):
        bound = _within(possible) if possible else bound
        best = _within(found or objective) or best
        yield float(time), bound, best


def _within(word: str) -> float | None:
    """A number that is not one of the huge ones by which these programs mean none."""
    value = number(word)
    return None if value is None or abs(value) > 1e49 else value


def root_bound(solver: str, text: str) -> float | None:
    """The last lower bound before the first branching, as the log rounds it; None where it has none."""
    found = re.findall(_ROOT[solver], text, re.MULTILINE) if solver in _ROOT else []
    if not found:
        return None
    return number(found[-1] if isinstance(found[-1], str) else "".join(found[-1]))
