"""What an entry's runs amount to: solved, claimed, or open; and the best run of each solver.

A bound of a program is its word. It solves an entry when three programs of different makers give it, each in
a run that was measured here or whose log says so; a certificate or the tangent does so by itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Final

from ...solvers_table import SOLVERS
from .dual_bounds import cut, is_proven
from .ledger import Record

AGREE: Final = 3
"""Programs of different makers that have to agree."""
MAKERS: Final = {solver.title: solver.maker for solver in SOLVERS.values()}
"""Who makes a solver, by its title; of one that is not in the table nobody is known."""

_TOLD: Final = {"objective": "primal", "limit": "time_limit"} | {
    name: name for name in ("bound", "seconds", "threads", "machine", "by", "date", "evidence", "log")
}
"""Keys of a run in a sidecar, and the fields of a record that they are."""


def preference(record: Record, entry: str) -> tuple[Any, ...]:
    """The greatest bound first; of equal ones that of the entry itself, then the quickest."""
    bound = -float("inf") if record.bound is None else record.bound
    return (-bound, record.entry != entry, _least(record.primal), _least(record.seconds), record.rank)


def _least(value: float | None) -> float:
    return float("inf") if value is None else value


def best_of_each(records: Iterable[Record], entry: str) -> list[Record]:
    """The best run of each solver, in the order of their names."""
    chosen: dict[str, Record] = {}
    for record in sorted(records, key=lambda each: preference(each, entry)):
        chosen.setdefault(record.solver, record)
    return sorted(chosen.values(), key=lambda each: each.solver)


def runs_of(records: Iterable[Record], entry: str, objective: float) -> list[dict[str, Any]]:
    """The best run of each solver on an entry, as its sidecar tells them, bounds cut to the objective."""
    return [_run(each, objective) for each in best_of_each((r for r in records if r.entry == entry), entry)]


def _run(record: Record, objective: float) -> dict[str, Any]:
    told = {key: getattr(record, name) for key, name in _TOLD.items()}
    if record.bound is not None:
        told["bound"] = cut(record.bound, objective)
    known = {key: value for key, value in told.items() if value is not None}
    trace = {"trace": [list(step) for step in record.trace]} if record.trace else {}
    return {"solver": record.solver, "version": record.version, "status": record.status} | known | trace


def standing(
    objective: float, bounds: Sequence[dict[str, Any]], records: Iterable[Record], entry: str
) -> dict[str, Any]:
    """Status of an entry with a point of that objective; with `solved`, or `claimed`, where it is so.

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
    """Whether a run counts for agreement: of a known solver, and more than somebody's word."""
    return record.solver in MAKERS and record.evidence != "word"


def _solved(by: str, programs: list[dict[str, Any]]) -> dict[str, Any]:
    return {"status": "optimal", "solved": {"by": by, "programs": programs}}


def _program(record: Record, entry: str) -> dict[str, Any]:
    via = {} if record.entry == entry else {"via": record.entry}
    return {"solver": record.solver, "version": record.version} | via
