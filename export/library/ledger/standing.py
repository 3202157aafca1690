"""Status and grade of an entry, from its dual bounds and runs; the best run of each solver.

A solver's bound is good to its tolerances, and may lie a little above the objective of a point that is
feasible to 1e-16. Within `slack` it is cut to that objective; beyond, it contradicts the point.

A bound of a program is a claim. It solves an entry when three programs of different makers give it, each in
a run that was measured here or whose log shows it; a certificate or the tangent does so alone.

Grades follow MIPLIB:

easy  a run on this very entry, on one thread, ended with a proof of optimality within EASY seconds; or the
      tangent at the best point shows it
hard  an optimum is proven, or a program claims so, in another way: by a longer run, on several threads, by
      the certificate of the instance, or on an equivalent entry
open  no optimum is proven

The grade depends on measurements: an entry without runs is open, or hard by a certificate.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Final, Literal

from ...solvers_table import SOLVERS
from .ledger import Record

Difficulty = Literal["easy", "hard", "open"]

EASY: Final = 60.0
"""Seconds."""
PROVEN: Final = (1e-6, 1e-9)
"""Greatest gap of an optimal point: relative to its objective, plus an absolute part."""
AGREE: Final = 3
"""Number of programs of different makers that have to agree."""
MAKERS: Final = {solver.title: solver.maker for solver in SOLVERS.values()}
"""Maker of each solver in the table, by title."""

_SHOWN: Final = {"objective": "primal", "limit": "time_limit"} | {
    name: name for name in ("bound", "seconds", "threads", "machine", "by", "date", "evidence", "log")
}
"""Keys of a run in a sidecar, and the fields of a record that they are."""


def slack(objective: float) -> float:
    """Return the distance by which a solver's tolerances may lift its bound above the optimum."""
    return 1e-6 * max(1.0, abs(objective))


def contradicts(bound: float, objective: float) -> bool:
    """Whether a bound lies so far above the objective of a feasible point that it cannot be a bound."""
    return bound - objective > slack(objective)


def cut(bound: float, objective: float) -> float:
    """Return the bound, or the objective of the best feasible point if that is lower."""
    return min(bound, objective)


def is_proven(objective: float, bound: float) -> bool:
    """Whether a point of that objective is optimal by a dual bound: see PROVEN."""
    return objective - bound <= PROVEN[0] * abs(objective) + PROVEN[1]


def relative_gap(objective: float, bound: float) -> float:
    """Return objective minus bound over the objective's size, between 0 and 1."""
    return min(max(objective - bound, 0.0) / max(abs(objective), PROVEN[1]), 1.0)


def preference(record: Record, entry: str) -> tuple[Any, ...]:
    """Sort key: the greatest bound first; among equal ones the entry itself, then the fastest."""
    bound = -float("inf") if record.bound is None else record.bound
    return (-bound, record.entry != entry, _least(record.primal), _least(record.seconds), record.rank)


def _least(value: float | None) -> float:
    return float("inf") if value is None else value


def best_of_each(records: Iterable[Record], entry: str) -> list[Record]:
    """Return the best run of each solver, in the order of their names."""
    chosen: dict[str, Record] = {}
    for record in sorted(records, key=lambda each: preference(each, entry)):
        chosen.setdefault(record.solver, record)
    return sorted(chosen.values(), key=lambda each: each.solver)


def runs_of(records: Iterable[Record], entry: str, objective: float) -> list[dict[str, Any]]:
    """Return the best run of each solver on an entry for its sidecar, bounds cut to the objective."""
    return [_run(each, objective) for each in best_of_each((r for r in records if r.entry == entry), entry)]


def _run(record: Record, objective: float) -> dict[str, Any]:
    shown = {key: getattr(record, name) for key, name in _SHOWN.items()}
    if record.bound is not None:
        shown["bound"] = cut(record.bound, objective)
    known = {key: value for key, value in shown.items() if value is not None}
    trace = {"trace": [list(step) for step in record.trace]} if record.trace else {}
    return {"solver": record.solver, "version": record.version, "status": record.status} | known | trace


def standing(
    objective: float, bounds: Sequence[dict[str, Any]], records: Iterable[Record], entry: str
) -> dict[str, Any]:
    """Return the status of an entry, with `solved` or `claimed` if it is so.

    bounds: as the sidecar has them; records: of the entry and of those with the same optimum.
    """
    computed = [
        each for each in bounds if each["status"] == "computed" and is_proven(objective, each["bound"])
    ]
    for by, found in (
        ("certificate", [each for each in computed if "certificate" in each]),
        ("tangent", [each for each in computed if "certificate" not in each]),
    ):
        if found:
            return _solved(by, [{key: each[key] for key in ("solver", "version")} for each in found])
    claims = [
        each
        for each in records
        if each.bound is not None and is_proven(objective, cut(each.bound, objective))
    ]
    sound = best_of_each((each for each in claims if _counts(each)), entry)
    if len({MAKERS[each.solver] for each in sound}) >= AGREE:
        return _solved("agreement", [_program(each, entry) for each in sound])
    if claims:
        programs = [_program(each, entry) for each in best_of_each(claims, entry)]
        return {"status": "claimed", "claimed": programs}
    return {"status": "best known"}


def _counts(record: Record) -> bool:
    """Whether a run counts for agreement: of a known solver, and with evidence beyond a word."""
    return record.solver in MAKERS and record.evidence != "word"


def _solved(by: str, programs: list[dict[str, Any]]) -> dict[str, Any]:
    return {"status": "optimal", "solved": {"by": by, "programs": programs}}


def _program(record: Record, entry: str) -> dict[str, Any]:
    via = {} if record.entry == entry else {"via": record.entry}
    return {"solver": record.solver, "version": record.version} | via


def difficulty(status: str, runs: Iterable[Record], *, tangent: bool) -> Difficulty:
    """Return the grade of an entry of a status.

    runs: those on its very problem; tangent: whether that at its point shows the optimum.
    """
    if status == "best known":
        return "open"
    return "easy" if tangent or any(map(_is_quick, runs)) else "hard"


def _is_quick(run: Record) -> bool:
    """Whether a run proved an optimum on one thread within EASY seconds."""
    return run.status == "optimal" and run.threads == 1 and run.seconds is not None and run.seconds <= EASY
