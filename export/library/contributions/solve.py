"""Runs of the installed solvers on the entries of a library, for its ledger.

Each run uses one thread. HiGHS, Ipopt and Bonmin start from the best known point, other solvers without a
start. Runs that the ledger has are not repeated.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

from ....models.arguments import check_choice
from ....models.errors import (
    MissingSolverError,
    SolutionError,
    SolverError,
    UnsupportedBySolverError,
)
from ....models.field.field import CrossField
from ....models.formulations.problem import Problem
from ....models.processes.deadline import Progress, silent
from ....models.processes.limits import Limits
from ....models.storage import temporary_folder
from ...solutions.read import read_solution
from ...solutions.solution import Solution
from ...solvers_table import SOLVERS
from ...solving.local import Solvers, choose_format
from ...statuses import Status
from ..building.build import rebuild
from ..documents.checksums import claim_targets, is_intact, read_checksums
from ..documents.documents import Library, problem_of, read_library
from ..documents.lock import library_lock
from ..ledger.grades import is_better
from ..ledger.ledger import LEDGER, Record, RunStatus, add_record, read_ledger
from ..ledger.points import clipped_field, complete_point
from ..plan.spec import RUNGS

GAP: Final = 1e-7  # relative gap of a search, smaller than the gap of a proof: points may be infeasible
_PURPOSE: Final = "a solve of the library"


def solve_library(
    folder: str | Path,
    *,
    solvers: Sequence[str] | None = None,
    time_limit: float = 10.0,
    up_to: str | None = None,
    by: str | None = None,
    machine: str | None = None,
    progress: Progress = silent,
) -> list[dict[str, Any]]:
    """Run solvers, add the records to the ledger, bring the library up to date and return the records.

    solvers: by default all that can be used; time_limit: seconds of a run; up_to: last rung. An entry that
    is too large for the free edition of a program is skipped. After Ctrl-C the library is brought up to date
    with the runs before it, and KeyboardInterrupt is raised. Raises InputError for an unknown name,
    MissingSolverError for a named solver that cannot be used.
    """
    check_choice("rung", up_to or RUNGS[-1], RUNGS)
    rungs = RUNGS[: RUNGS.index(up_to or RUNGS[-1]) + 1]
    for name in solvers or ():
        check_choice("solver", name, SOLVERS)
        if missing := SOLVERS[name].missing:
            raise MissingSolverError(missing)
    chosen = dict.fromkeys(solvers or [name for name, solver in SOLVERS.items() if not solver.missing])
    Record("cf_none", "0" * 64, "none", "0", "no point", by=by, machine=machine).check()
    library, records = read_library(folder), []
    read_ledger(library.folder)  # a damaged one is reported as such
    sums = read_checksums(library.folder)
    claim_targets(library.folder, (), (LEDGER,))
    try:
        with Solvers() as at_work:
            work = _SolveSession(library, at_work, time_limit, {"by": by, "machine": machine})
            runs = list(work.runs(list(chosen), rungs))
            for number, (document, solver) in enumerate(runs, 1):
                progress(f"{number} of {len(runs)} runs: {solver} on {document['name']}")
                try:
                    record, field = work.run(document, solver)
                except UnsupportedBySolverError as error:
                    progress(f"{document['name']}: {error}")
                    continue
                with library_lock(library.folder, _PURPOSE, progress):
                    records.append(asdict(add_record(library.folder, record, field)))
    finally:  # records count although Ctrl-C or an error ended the runs
        if not is_intact(library.folder, LEDGER, sums):
            rebuild(library.folder, progress=progress)
    return records


@dataclass
class _SolveSession:
    """Runs on a library with a time limit each. stated: who runs them, and on which machine."""

    library: Library
    solvers: Solvers
    limit: float
    stated: dict[str, Any]

    def runs(self, solvers: list[str], rungs: Sequence[str]) -> Iterator[tuple[dict[str, Any], str]]:
        """Yield sidecar and solver of each missing run that the solver supports."""
        ledger = read_ledger(self.library.folder)
        for document in self.library.entries:
            if document["rung"] not in rungs:
                continue
            problem = problem_of(self.library, document)
            key = (document["name"], problem.sha256)
            have = [record for record in ledger.records if (record.entry, record.problem_sha256) == key]
            for solver in solvers:
                takes = choose_format(problem, solver).answer == "yes"
                if takes and not any(self._is_covered_by(record, solver) for record in have):
                    yield document, solver

    def _is_covered_by(self, record: Record, solver: str) -> bool:
        """Whether a record is of a run of the solver with at least this time limit."""
        if record.solver != SOLVERS[solver].title or record.version != self.solvers.version(solver):
            return False
        return record.status == "optimal" or (record.time_limit or 0.0) >= self.limit

    def run(self, document: dict[str, Any], solver: str) -> tuple[Record, CrossField | None]:
        """Return the record of a run, without a point if it fails, and its field if that is the best one.

        Raises UnsupportedBySolverError for a problem that is too large.
        """
        problem, best = problem_of(self.library, document), document["best"]["objective"]
        title, version = SOLVERS[solver].title, self.solvers.version(solver)
        record = Record(
            document["name"],
            problem.sha256,
            title,
            version,
            "no point",
            threads=1,
            time_limit=self.limit,
            **self.stated,
        )
        try:
            solution = self._solve(document, problem, solver)
        except UnsupportedBySolverError:
            raise
        except (SolverError, SolutionError):
            return record, None
        if solution.interrupted:
            raise KeyboardInterrupt
        proves, bound = _has_proof(problem, solver, solution), solution.bound
        if bound is None and solution.objective is not None and proves:
            bound = solution.objective - GAP * abs(solution.objective)
        seconds = None if solution.seconds is None else round(solution.seconds, 3)
        record = replace(record, bound=bound, seconds=seconds)
        if solution.point is None:
            return record, None
        field = clipped_field(solution.problem, solution.point)
        primal = problem.objective_value(complete_point(problem, field))
        feasible = solution.status in {Status.OPTIMAL_LOCAL, Status.FEASIBLE}
        status: RunStatus = "optimal" if proves else "feasible" if feasible else "limit"
        return replace(record, status=status, primal=primal), field if is_better(primal, best) else None

    def _solve(self, document: dict[str, Any], problem: Problem, solver: str) -> Solution:
        """The solution of a solver. Raises SolverError if no time was left to start it."""
        limits, start = Limits(self.limit, GAP, 1), None
        if SOLVERS[solver].is_bundled:
            known = read_solution(self.library.folder / document["best"]["point"], problem)
            start = None if known.point is None else clipped_field(known.problem, known.point)
        with temporary_folder() as folder:
            solution = self.solvers.solve(problem, solver, folder=folder, limits=limits, start=start)
            if not solution.interrupted and not list(folder.glob("*.log")):
                raise SolverError(f"the time limit of {self.limit:g} s left no time to start {solver}")
        return solution


def _has_proof(problem: Problem, solver: str, solution: Solution) -> bool:
    """Whether the solver ended with a proof of a global optimum."""
    proves, optima = SOLVERS[solver].proves, {Status.OPTIMAL_GLOBAL}
    if problem.is_convex:
        optima.add(Status.OPTIMAL_LOCAL)
    elif proves != "global":
        return False
    return proves != "local" and not solution.problem.formulation.is_weakened and solution.status in optima
