"""The ways to a field that the package has: one table for `crossfield solve --method`, `crossfield run` and the docs."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from ..models.box_qp import fitted
from ..models.field import CrossField
from ..models.greedy import greedy
from ..models.instance import Instance
from ..models.power_field import power_field
from ..models.search import search
from .solution import Solution
from .solvers import Limits
from .stages import find_jumps, fit_angles

Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Candidate:
    """A field and how it was found: method, seconds, and the solution file's facts where a solver gave it."""

    method: str
    field: CrossField
    seconds: float
    solution: Solution | None = None
    interrupted: bool = False

    def facts(self) -> dict[str, Any]:
        """What a report says of it: energies in both norms, singularities, skew, and claims beside recomputed values."""
        answer = self.field
        facts: dict[str, Any] = {
            "method": self.method,
            "energy_2_norm": answer.energy(2).total,
            "energy_1_norm": answer.energy(1).total,
            "singularities": len(answer.singularities.index),
            "degenerate_pixels": int(answer.degenerate.sum()),
            "mean_abs_beta_degrees": float(np.degrees(np.abs(answer.beta).mean())),
            "seconds": round(self.seconds, 3),
            "interrupted": self.interrupted,
        }
        return facts if self.solution is None else facts | solution_facts(self.solution)


def solution_facts(solution: Solution) -> dict[str, Any]:
    """What a solution file claims, beside what was recomputed from the instance."""
    violation = solution.violation
    facts = {
        "formulation": solution.problem.name,
        "status": str(solution.status),
        "message": solution.message,
        "objective_reported": solution.reported,
        "objective_recomputed": solution.objective,
        "dual_bound": solution.bound,
        "worst_violation": None if violation is None else violation.worst,
        "worst_family": None if violation is None else violation.worst_family,
        "furthest_rounding": solution.rounded,
        "unknown_names": solution.unknown,
        "interrupted": solution.interrupted,
        "seconds": None if solution.seconds is None else round(solution.seconds, 3),
    }
    return {key: _finite(value) for key, value in facts.items()}


def _finite(value: Any) -> Any:
    """The value; None for an infinity, which JSON has not."""
    return None if isinstance(value, float) and not np.isfinite(value) else value


def _tell_nobody(_text: str) -> None:
    pass


@dataclass(frozen=True, eq=False)
class Request:
    """What a method is asked: the instance, a folder for files of solvers, limits, and options of the formulations.

    start: a field to go on from, for methods that start from one; None: their own, the greedy field.
    """

    instance: Instance
    folder: Path
    limits: Limits = field(default_factory=Limits)
    options: dict[str, Any] = field(default_factory=dict)
    start: CrossField | None = None
    progress: Progress = _tell_nobody


@dataclass(frozen=True)
class Method:
    """A way to a field. find: the fields it comes to, one by one, for a later one may fail; the last one is its answer."""

    name: str
    summary: str
    find: Callable[[Request], Iterator[Candidate]]


def _greedy(request: Request) -> Iterator[Candidate]:
    request.progress("greedy field")
    yield _timed("greedy", lambda: greedy(request.instance))


def _power(request: Request) -> Iterator[Candidate]:
    request.progress("power field")
    power = _timed("power", lambda: power_field(request.instance))
    yield power
    yield _timed("power + QP", lambda: fitted(power.field))


def _search(request: Request) -> Iterator[Candidate]:
    import joblib

    limits = request.limits
    begin = time.perf_counter()

    def tell(rounds: int, energy: float) -> None:
        left = max(0.0, limits.seconds - time.perf_counter() + begin)
        request.progress(
            f"search: energy {energy:.5g} after {rounds} rounds, at most {left:.0f} s more; Ctrl-C keeps the best field so far"
        )

    request.progress("search: starting fields")
    jobs = limits.threads or joblib.cpu_count()
    found = search(request.instance, seconds=limits.seconds, jobs=jobs, start=request.start, progress=tell)
    seconds = time.perf_counter() - begin
    yield Candidate("search", found.field, seconds, interrupted=found.ended == "interrupted")


def _two_stage(request: Request) -> Iterator[Candidate]:
    limits = request.limits
    request.progress(
        f"HiGHS: MILP for the jumps, at most {limits.seconds:g} s; Ctrl-C keeps the best point so far"
    )
    milp = find_jumps(request.instance, request.folder, limits=limits, start=request.start, **request.options)
    yield _of("MILP", milp)
    request.progress("Ipopt: angles for the jumps of the MILP")
    yield _of("two-stage", fit_angles(milp.field, request.folder, limits=limits))


METHODS: Final = {
    method.name: method
    for method in (
        Method("greedy", "the greedy strategy of BendFields, then the best angles: the baseline", _greedy),
        Method("power", "smooth exp(4 i theta), right angles; then the best angles for its jumps", _power),
        Method("search", "local search over jumps and singularities from the greedy field on, up to the time limit", _search),
        Method("two-stage", "section 5 of the paper: HiGHS on milp-mccormick up to the time limit, Ipopt on qp-fixed", _two_stage),
    )
}  # fmt: skip
"""The table of methods; command line, runs, docs and tests are generated from it."""


def _timed(method: str, find: Callable[[], CrossField]) -> Candidate:
    begin = time.perf_counter()
    found = find()
    return Candidate(method, found, time.perf_counter() - begin)


def _of(method: str, solution: Solution) -> Candidate:
    seconds = solution.seconds or 0.0
    return Candidate(method, solution.field, seconds, solution, solution.interrupted)
