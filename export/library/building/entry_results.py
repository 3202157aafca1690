"""Dual bounds, status, runs and grade of an entry, from its best point, the ledger and certificates."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Final

from ....models.errors import InputError
from ..documents.statistics import density, tangent_bound
from ..ledger.grades import (
    best_runs,
    cut_bound,
    difficulty,
    entry_status,
    is_proven,
    is_refuted,
    relative_gap,
    shown_runs,
)
from ..ledger.ledger import Record
from ..ledger.points import METHOD, BestPoint, provenance_by
from ..plan.equivalence import equivalent_entries
from ..plan.problems import formulate_entry
from .tasks import EntryTask

_TANGENT: Final = "tangent at the point"


def entry_results(task: EntryTask, best: BestPoint) -> dict[str, Any]:
    """Return dual bounds, status, gap, runs and grade of an entry.

    Raises InputError for a bound that the point contradicts.
    """
    records = _records(task, best)
    bounds = _bounds(task, best, records)
    status = entry_status(best.objective, bounds, records, task.name)
    bound = max((facts["bound"] for facts in bounds), default=None)
    tangents = [facts["bound"] for facts in bounds if facts["solver"] == provenance_by(_TANGENT).solver]
    tangent = any(is_proven(best.objective, value) for value in tangents)
    runs = [record for record in records if record.entry == task.name]
    return {
        "bounds": bounds,
        "bound": bound,
        "status": status["status"],
        "gap": None if bound is None else relative_gap(best.objective, bound),
        "runs": shown_runs(records, task.name, best.objective),
        "density": density(best.problem.instance),
        "difficulty": difficulty(status["status"], best.objective, runs, tangent=tangent),
    } | status


def _records(task: EntryTask, best: BestPoint) -> list[Record]:
    """The records about this problem and those with the same optimum, without bounds that the point refutes.

    The point is feasible to more digits than a solver keeps its rows.
    """
    problems = {task.name: best.problem.sha256}
    for relative in equivalent_entries(task.recipe, task.relatives):
        if relative["entry"] is not None:
            instance, jumps = best.problem.instance, best.known.field.p
            problem = formulate_entry(instance, relative["formulation"], "hull", jumps)
            problems[relative["entry"]] = problem.sha256
    return [
        replace(record, bound=None) if is_refuted(record.bound or -math.inf, best.objective) else record
        for record in task.records
        if problems.get(record.entry) == record.problem_sha256
    ]


def _bounds(task: EntryTask, best: BestPoint, records: list[Record]) -> list[dict[str, Any]]:
    """The best dual bound of each solver for this optimum, and the bounds of tangent and certificate.

    A bound is at most the best objective. Raises InputError if the point contradicts a computed one.
    """
    bounds, name = [], task.name
    stated = ("solver", "version", "bound", "status", "seconds", "threads")
    for record in best_runs((record for record in records if record.bound is not None), name):
        via = None if record.entry == name else record.entry
        bounds.append({key: getattr(record, key) for key in stated} | {"via": via})
    tangent = tangent_bound(best.problem, best.point)
    certificate = task.certificate
    if tangent is not None:
        bounds.append(_computed_bound(_TANGENT, tangent))
    if certificate is not None:
        facts = {"certificate": certificate["file"]}
        bounds.append(_computed_bound(METHOD, certificate["bound"]) | facts)
    for facts in bounds:
        bound = float(facts["bound"])
        if is_refuted(bound, best.objective):
            raise InputError(
                f"has the bound {bound!r} of {name} by {facts['solver']}, but there is a feasible point of "
                f"{best.objective!r}; that bound is wrong, build again without it",
                file=facts.get("certificate"),
            )
        facts["bound"] = cut_bound(bound, best.objective)
    return bounds


def _computed_bound(method: str, bound: float) -> dict[str, Any]:
    provenance = provenance_by(method)
    facts = {"solver": provenance.solver, "version": provenance.version, "bound": bound, "status": "computed"}
    return facts | {"seconds": None, "threads": None, "via": None}
