"""Runs of the local solvers on the entries of a library: bounds and times for its ledger, and better points.

Each run starts from the best known point and uses one thread. What was measured is not measured again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final

from ....models.errors import InputError, SolutionError, SolverError
from ....models.field.field import CrossField
from ....models.formulations.problem import Problem
from ....models.processes.progress import Progress, silent
from ...solutions.readers.text import Status
from ...solutions.solution import Solution, read_solution
from ...solvers_table import DRIVEN, PROGRAMS
from ...solving.job import Limits
from ...solving.local import refusal, solve
from ..building.build import rebuild
from ..documents.documents import Library, problem_of, read_library
from ..documents.lock import locked
from ..ledger.dual_bounds import contradicts
from ..ledger.ledger import Record, RunStatus, add_record, read_ledger
from ..ledger.points import complete_point, field_of
from ..plan.spec import RUNGS

GAP: Final = 1e-7
"""Relative gap of a search: less than what counts as proven, for some points are a little infeasible."""
_BETTER: Final = 1e-9  # relative: a lower objective than this is no better point


def solve_library(
    folder: str | Path,
    *,
    solvers: Sequence[str] | None = None,
    time_limit: float = 10.0,
    up_to: str | None = None,
    by: str | None = None,
    progress: Progress = silent,
) -> list[dict[str, Any]]:
    """The new records, now in the ledger of the library, which is brought up to date in the end.

    solvers: names of solvers that are driven here, all by default, each on the entries that it takes.
    time_limit: seconds of a run; up_to: last rung; by: who runs it. Raises InputError for an unknown name.
    """
    chosen = _known(solvers or list(DRIVEN), DRIVEN, "solver")
    (last,) = _known([up_to or RUNGS[-1]], RUNGS, "rung")
    library, found = read_library(folder), []
    runs = list(_runs(library, chosen, RUNGS[: RUNGS.index(last) + 1], time_limit))
    for number, (document, solver) in enumerate(runs):
        progress(f"{number + 1} of {len(runs)} runs: {solver} on {document['name']}")
        record, field = _run(library, document, solver, time_limit, by)
        with locked(library.folder, "a solve of the library", progress):
            found.append(asdict(add_record(library.folder, record, field)))
    rebuild(library.folder, progress=progress)
    return found


def _known(names: Sequence[str], table: Any, kind: str) -> list[str]:
    for name in names:
        if name not in table:
            raise InputError(f"there is no {kind} {name!r}; choose from {', '.join(table)}")
    return list(dict.fromkeys(names))


def _runs(
    library: Library, solvers: list[str], rungs: Sequence[str], limit: float
) -> Iterator[tuple[dict[str, Any], str]]:
    """Sidecars and solvers of what is to be run: the solver takes it, and the ledger does not have it."""
    ledger = read_ledger(library.folder)
    for document in library.entries:
        if document["rung"] not in rungs:
            continue
        problem = problem_of(library, document)
        have = ledger.of(document["name"], problem.sha256)
        for solver in solvers:
            if not refusal(problem, DRIVEN[solver]) and not any(
                _covers(each, solver, limit) for each in have
            ):
                yield document, solver


def _covers(record: Record, solver: str, limit: float) -> bool:
    """Whether a record stands for a run of the solver for so long."""
    same = record.solver == DRIVEN[solver].title and record.version == _version(solver)
    return same and (record.status == "optimal" or (record.time_limit or 0.0) >= limit)


def _version(solver: str) -> str:
    """The version of its package, named where that is not the solver's own."""
    program = PROGRAMS[DRIVEN[solver].program]
    try:
        installed = version(program.needs)
    except PackageNotFoundError:
        return "not installed"
    return installed if program.name == solver else f"{program.needs} {installed}"


def _run(
    library: Library, document: dict[str, Any], solver: str, limit: float, by: str | None
) -> tuple[Record, CrossField | None]:
    """The record of a run, and the field that it found when that is better than the best known point."""
    problem = problem_of(library, document)
    record = Record(
        document["name"],
        problem.sha256,
        DRIVEN[solver].title,
        _version(solver),
        "no point",
        threads=1,
        time_limit=limit,
        by=by,
    )
    try:
        found = solve(problem, solver, limits=Limits(limit, GAP, 1), start=_start(library, document, problem))
    except (SolverError, SolutionError):
        return record, None
    if found.interrupted:
        raise KeyboardInterrupt
    seconds = None if found.seconds is None else round(found.seconds, 3)
    best = document["best"]["objective"]
    record = replace(record, bound=_bound(problem, solver, found, best), seconds=seconds)
    if found.point is None:
        return record, None
    field = field_of(found.problem, found.point)
    primal = problem.objective_value(complete_point(problem, field))
    record = replace(record, status=_run_status(problem, solver, found), primal=primal)
    return record, field if primal < best - _BETTER * max(abs(best), _BETTER) else None


def _start(library: Library, document: dict[str, Any], problem: Problem) -> CrossField | None:
    """The field of the best known point."""
    known = read_solution(library.folder / document["best"]["point"], problem)
    return None if known.point is None else field_of(known.problem, known.point)


def _run_status(problem: Problem, solver: str, found: Solution) -> RunStatus:
    if _proves(problem, solver, found):
        return "optimal"
    return "feasible" if found.status in {Status.OPTIMAL_LOCAL, Status.FEASIBLE} else "limit"


def _proves(problem: Problem, solver: str, found: Solution) -> bool:
    """Whether the solver came to its end, and that is a proof of a global optimum."""
    ended = found.status in {Status.OPTIMAL_GLOBAL, Status.OPTIMAL_LOCAL}
    return ended and problem.convex and DRIVEN[solver].proves != "local"


def _bound(problem: Problem, solver: str, found: Solution, known: float) -> float | None:
    """The dual bound that the solver tells, unless a feasible point contradicts it.

    Where it tells none and proves an optimum: that less the gap it was allowed.
    """
    if found.bound is not None:
        return None if contradicts(found.bound, known) else found.bound
    if found.objective is None or not _proves(problem, solver, found):
        return None
    bound = found.objective - GAP * abs(found.objective)
    return None if contradicts(bound, known) else bound
