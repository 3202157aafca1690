"""Status and grade of an entry, from its dual bounds and runs; the best run of each solver.

A solver's tolerances may put its bound a little above the objective of a point that is feasible to 1e-16.
Within _LIFT of its size, or of 1, it is cut to that objective; a larger one contradicts the point.

A bound of a program is a claim, which nobody can check. If programs of three makers agree on it, it is still
no proof. A certificate or the tangent is one.

Grades follow MIPLIB:

easy  a run on this entry, on one thread, claims the optimum within EASY seconds; or the tangent proves it
hard  an optimum is proven or claimed in another way: by a longer run, on several threads, by a certificate,
      or on an equivalent entry
open  no optimum is proven or claimed
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, Final, Literal

from ...solvers_table import SOLVERS
from .ledger import Record

Difficulty = Literal["easy", "hard", "open"]

EASY: Final = 60.0  # seconds
_PROVEN: Final = (1e-6, 1e-9)  # greatest gap of an optimal point: relative part, absolute part
ACCEPTED_VIOLATION: Final = 1e-8  # greatest violation of a point that a library accepts
_LIFT: Final = 1e-6  # by which the tolerances of solvers may lift a bound above the optimum
SAME: Final = 1e-9  # objectives this close, relative to their size or absolute, are the same
AGREE: Final = 3  # programs of different makers that must agree
MAKERS: Final = {solver.title: solver.maker for solver in SOLVERS.values()}  # by title

_SHOWN: Final = {"objective": "primal", "limit": "time_limit"} | {
    name: name for name in ("bound", "seconds", "threads", "machine", "by", "date")
}
"""Keys of a run in a sidecar, and fields of a record."""


def is_refuted(bound: float, objective: float) -> bool:
    """Whether a bound is so far above the objective of a feasible point that no tolerance explains it."""
    return bound - objective > _LIFT * max(1.0, abs(objective))


def is_better(objective: float, known: float) -> bool:
    """Whether an objective is lower than the best known one by more than rounding."""
    return known - objective > SAME * max(abs(known), SAME)


def is_proven(objective: float, bound: float) -> bool:
    """Whether a dual bound proves a point of that objective optimal."""
    return objective - bound <= _PROVEN[0] * abs(objective) + _PROVEN[1]


def relative_gap(objective: float, bound: float) -> float:
    """Return objective minus bound over the objective's size, between 0 and 1."""
    return min(max(objective - bound, 0.0) / max(abs(objective), _PROVEN[1]), 1.0)


def best_runs(records: Iterable[Record], entry: str) -> list[Record]:
    """Return the best run of each solver by name: greatest bound, then this entry, then the fastest."""

    def preference(record: Record) -> tuple[Any, ...]:
        bound = -math.inf if record.bound is None else record.bound
        primal, seconds = (math.inf if value is None else value for value in (record.primal, record.seconds))
        return (-bound, record.entry != entry, primal, seconds, record.rank)

    chosen: dict[str, Record] = {}
    for record in sorted(records, key=preference):
        chosen.setdefault(record.solver, record)
    return sorted(chosen.values(), key=lambda record: record.solver)


def shown_runs(records: Iterable[Record], entry: str, objective: float) -> list[dict[str, Any]]:
    """Return the best run of each solver on an entry for its sidecar, bounds cut to the objective."""
    runs = []
    for record in best_runs((record for record in records if record.entry == entry), entry):
        shown = {key: getattr(record, name) for key, name in _SHOWN.items()}
        if record.bound is not None:
            shown["bound"] = min(record.bound, objective)
        known = {key: value for key, value in shown.items() if value is not None}
        runs.append({"solver": record.solver, "version": record.version, "status": record.status} | known)
    return runs


def entry_status(
    objective: float, bounds: Sequence[dict[str, Any]], records: Iterable[Record], entry: str
) -> dict[str, Any]:
    """Return the status of an entry, with `solved` or `claimed`. records: also of equivalent entries."""
    computed = [
        bound for bound in bounds if bound["status"] == "computed" and is_proven(objective, bound["bound"])
    ]
    certified = [bound for bound in computed if "certificate" in bound]
    if computed:
        programs = [{key: bound[key] for key in ("solver", "version")} for bound in certified or computed]
        by = "certificate" if certified else "tangent"
        return {"status": "optimal", "solved": {"by": by, "programs": programs}}
    claims = [record for record in records if record.bound is not None and is_proven(objective, record.bound)]
    if not claims:
        return {"status": "best known"}
    makers = {MAKERS[record.solver] for record in claims if record.solver in MAKERS}
    programs = [
        {"solver": record.solver, "version": record.version}
        | ({} if record.entry == entry else {"via": record.entry})
        for record in best_runs(claims, entry)
    ]
    return {"status": "agreed" if len(makers) >= AGREE else "claimed", "claimed": programs}


def difficulty(status: str, objective: float, runs: Iterable[Record], *, tangent: bool) -> Difficulty:
    """Return the grade of an entry, from its status and the objective of its best point.

    runs: on its problem; the bound of a run must prove that point. tangent: whether the tangent does.
    """
    if status == "best known":
        return "open"
    quick = (
        run.status == "optimal"
        and run.threads == 1
        and run.seconds is not None
        and run.seconds <= EASY
        and run.bound is not None
        and is_proven(objective, run.bound)
        for run in runs
    )
    return "easy" if tangent or any(quick) else "hard"
