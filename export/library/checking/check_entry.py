"""Checks of an entry against its problem, formulated again from the instance, and of its runs.

The entry is made again from what it was made of, and compared with what is in the library, model files
unpacked; the best known point is read by the readers of solution files and evaluated, and, by the checker
that ships with every library, against the .mps and the instance without any rounding.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from ....models.errors import CrossfieldError
from ....models.formulations.problem import Problem
from ...formats.registry import generator
from ...solutions.logs.registry import parse_log
from ...solutions.solution import Solution, read_solution
from ...solvers_table import SOLVERS
from ...writing.curvature import probtype
from ..building.entry_task import Entry
from ..documents.check_point import BadInputError, check
from ..documents.documents import problem_of
from ..documents.statistics import counts, curvature, ranges, sizes
from ..ledger.ledger import FILE as LEDGER
from ..ledger.ledger import Ledger, Record
from ..ledger.points import complete_point
from ..ledger.standing import MAKERS, is_proven, relative_gap
from .finding import FEASIBLE, Finding, close, of_error
from .made_again import entry_findings

_AGAIN: Final = "restore it, or submit the run again"


def verify_entry(
    folder: Path, sidecar: dict[str, Any], ledger: Ledger, task: Entry | None
) -> Iterator[Finding]:
    """Yield findings about an entry whose sidecar obeys its schema and whose files are those listed.

    task: its inputs; None if they are damaged or missing, which is reported elsewhere.
    """
    name = f"{sidecar['name']}.json"
    try:
        problem = problem_of(folder, sidecar)
    except CrossfieldError as error:
        yield of_error(error, Path(error.file or name).name)
        return
    if sidecar["generator"] != generator():
        made = f"was made by {sidecar['generator']}, so that {generator()} cannot make it again to compare it"
        yield Finding(name, made, f"verify with {sidecar['generator']}")
        task = None
    yield from _facts(name, sidecar, problem) if task is None else _again(folder, sidecar, task)
    if sidecar["best"] is not None:
        yield from _points(folder, sidecar, problem)
        yield from _exactly(folder, sidecar)
        yield from _unused(sidecar, problem, ledger)
    yield from _bounds(name, sidecar)


def _again(folder: Path, sidecar: dict[str, Any], task: Entry) -> Iterator[Finding]:
    """Differences from the rebuilt entry, or the reason why it cannot be rebuilt."""
    try:
        yield from entry_findings(folder, sidecar, task)
    except CrossfieldError as error:
        yield of_error(error, Path(error.file or f"{task.name}.json").name)


def _facts(name: str, sidecar: dict[str, Any], problem: Problem) -> Iterator[Finding]:
    """Wrong facts about the problem in the sidecar."""
    instance = problem.instance
    facts: dict[str, Any] = {
        "class": problem.problem_class,
        "convex": problem.convex,
        "probtype": probtype(problem),
        "counts": counts(problem),
        "curvature": curvature(problem),
        "ranges": ranges(problem),
        "instance": sidecar["instance"] | sizes(instance) | {"sha256": instance.sha256},
    }
    for key, value in facts.items():
        if sidecar[key] != value:
            yield Finding(name, f"states another {key} than its problem has")


def _points(folder: Path, sidecar: dict[str, Any], problem: Problem) -> Iterator[Finding]:
    """Findings in the files of the best known point: unreadable, or another objective than stated."""
    best, listed = sidecar["best"], {file["name"] for file in sidecar["files"]}
    for key in ("point", "nl_point"):
        name = best[key]
        if name is None:
            continue
        if name not in listed:
            yield Finding(f"{sidecar['name']}.json", f"names {name} as a point and does not list it")
            continue
        try:
            solution = read_solution(folder / name, problem)
        except CrossfieldError as error:
            yield of_error(error, name)
            continue
        yield from (Finding(name, what) for what in _differences(best, solution))


def _differences(best: dict[str, Any], solution: Solution) -> Iterator[str]:
    """Differences between a point that was read and the statements of its sidecar."""
    if solution.objective is None or solution.violation is None:
        yield "holds no point"
        return
    if not close(solution.objective, best["objective"]):
        yield f"has objective {solution.objective!r}, but its sidecar states {best['objective']!r}"
    if solution.reported is not None and not close(solution.reported, best["objective"]):
        yield f"claims objective {solution.reported!r}, but its sidecar states {best['objective']!r}"
    found = solution.violation
    if found.worst > FEASIBLE:
        yield f"is not feasible: worst violation {found.worst:.3g}"
    elif not close(max(found.rows, found.bounds), best["violation"]) or not close(
        found.integrality, best["integrality"]
    ):
        yield "has other violations than its sidecar states"
    if not close(solution.field.energy().total, best["energy_2norm"]):
        yield (
            f"is of a field of energy {solution.field.energy().total!r}, "
            f"but its sidecar states {best['energy_2norm']!r}"
        )


def _exactly(folder: Path, sidecar: dict[str, Any]) -> Iterator[Finding]:
    """Findings of the exact checker, against the .mps and, where possible, the instance."""
    best, point = sidecar["best"], folder / sidecar["best"]["point"]
    models = [(file["name"], best["objective"]) for file in sidecar["files"] if file["format"] == "mps"]
    if sidecar["jumps"] is None:
        models.append((sidecar["instance"]["file"], best["energy_2norm"]))
    for model, stated in models:
        try:
            found = check(str(folder / model), str(point))
        except BadInputError as error:
            yield Finding(
                point.name, f"the checker refuses it: {str(error).removeprefix(f'{folder}{os.sep}')}"
            )
            continue
        if float(found.worst) > FEASIBLE:
            yield Finding(
                point.name, f"is not feasible against {model}: worst violation {float(found.worst):.3g}"
            )
        if not close(float(found.objective), stated):
            yield Finding(
                point.name,
                f"has {float(found.objective)!r} against {model}, but its sidecar states {stated!r}",
            )


def _unused(sidecar: dict[str, Any], problem: Problem, ledger: Ledger) -> Iterator[Finding]:
    """A field of the ledger that is better than the best known point, because a build was stopped."""
    record = ledger.with_point(sidecar["name"])
    if record is None or record.problem_sha256 != problem.sha256:
        return
    try:
        objective = problem.objective_value(complete_point(problem, ledger.field(record)))
    except CrossfieldError:
        return  # reported with the ledger
    if record.primal is not None and not close(objective, record.primal):
        yield Finding(
            LEDGER,
            f"states another objective of {record.point} than it has",
            "restore it, or submit the point again",
        )
    stated = sidecar["best"]["objective"]
    if objective < stated and not close(objective, stated):
        yield Finding(
            f"{sidecar['name']}.json", f"states a worse point than {record.point}, which the ledger has"
        )


def _bounds(name: str, sidecar: dict[str, Any]) -> Iterator[Finding]:
    """Contradictions between bounds, status, gap and the best known point."""
    bounds = [each["bound"] for each in sidecar["bounds"] if each["bound"] is not None]
    bound = max(bounds, default=None)
    if sidecar["bound"] != bound:
        yield Finding(name, f"states the bound {sidecar['bound']}, but the best of its bounds is {bound}")
    if sidecar["best"] is None:
        return
    objective = sidecar["best"]["objective"]
    if bound is not None and bound > objective:
        yield Finding(name, f"has a dual bound {bound!r} above the objective {objective!r} of its point")
    gap = None if bound is None else relative_gap(objective, bound)
    if (sidecar["status"], sidecar["gap"]) != (_status(sidecar, objective), gap):
        yield Finding(name, "states another status or gap than follows from its bounds and its point")


def _status(sidecar: dict[str, Any], objective: float) -> str:
    """The status that follows from a sidecar's bounds; a closed gap is solved or claimed."""
    if sidecar["bound"] is None or not is_proven(objective, sidecar["bound"]):
        return "best known"
    return "optimal" if "solved" in sidecar else "claimed"


def run_findings(ledger: Ledger, record: Record) -> Iterator[Finding]:
    """Yield findings about a run: its log is missing, damaged or contradicts the record."""
    if record.log is None:
        if record.evidence == "log":
            yield Finding(
                LEDGER, f"states that a log shows a bound of {record.entry}, and names none", _AGAIN
            )
        return
    if record.evidence is None and record.bound is not None:
        yield Finding(LEDGER, f"does not state whether {record.log} shows the bound of its run", _AGAIN)
    try:
        stated = parse_log(ledger.log(record))
    except CrossfieldError as error:
        yield of_error(error, record.log)
        return
    if MAKERS.get(record.solver) != SOLVERS[stated.solver].maker:
        yield Finding(LEDGER, f"states that {record.log} is of {record.solver}, and it is not", _AGAIN)
    if record.evidence == "log" and record.bound != stated.bound:
        yield Finding(LEDGER, f"states another bound than {record.log} does", _AGAIN)
    if record.trace != stated.trace:
        yield Finding(LEDGER, f"states another course of the run than {record.log} does", _AGAIN)
    if record.status == "optimal" and stated.ended == "limit":
        yield Finding(
            LEDGER, f"states that the run of {record.log} proved an optimum, and it did not", _AGAIN
        )
