"""The table of methods for fields, for `crossfield solve --method`, `crossfield run` and the docs."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ...models.errors import DomainError
from ...models.field.field import CrossField, field_in_windows
from ...models.formulations.problem import formulate
from ...models.instance.instance import Instance
from ...models.orthogonal.energy import takes_integers
from ...models.processes.deadline import Clock, Deadline, IsOver, Progress, never, silent
from ...models.processes.job_counts import cores
from ...models.processes.limits import Limits
from ...models.search.box_qp import fit_in_box
from ...models.search.greedy import greedy_field
from ...models.search.search import search
from ...models.search.starts import first_field, polyvector_start, start_fields
from ...models.smooth.bend import surface_field
from ...models.smooth.polyvector import polyvector_field, power_field
from ..solutions.solution import Solution
from ..solvers_table import SOLVERS
from ..solving.local import names_of_solve, solve

if TYPE_CHECKING:
    from ...models.proof.descent.record import Proof

_STARTING: Final = 0.5  # share of the seconds for the field from which solvers start
_ANGLES: Final = 0.2  # share of the seconds for the second of two stages
_ANGLES_LEAST: Final = 2.0  # seconds for it: its process has to start


@dataclass(frozen=True, eq=False)
class Candidate:
    """A field and how it was found: method, seconds, counts, and the solution if a solver returned it.

    proof: the method's proof about the field, if it proves anything.
    """

    method: str
    field: CrossField
    seconds: float
    solution: Solution | None = None
    interrupted: bool = False
    counts: Mapping[str, int] | None = None
    proof: Proof | None = None

    def facts(self) -> dict[str, Any]:
        """Facts for a report: the facts of the field, seconds, and claims with recomputed values."""
        facts: dict[str, Any] = {
            "method": self.method,
            **self.field.facts(),
            "seconds": round(self.seconds, 3),
            "interrupted": self.interrupted,
            **(self.counts or {}),
        }
        return facts if self.solution is None else facts | self.solution.facts()


def table_cells(facts: dict[str, Any]) -> list[str]:
    """Facts of a field of a run as the cells of a table; the gap only if there is a bound."""
    gap = []
    if "gap_2_norm" in facts:
        gap = ["optimal" if facts["proven_optimal"] else f"{facts['gap_2_norm']:.2%}"]
    return [
        f"{facts['energy_2_norm']:.4g}",
        *gap,
        f"{facts['energy_1_norm']:.4g}",
        f"{facts['stroke_deviation_mean_degrees']:.1f}°",
        f"{facts['lines_under_45_degrees']:.0%}",
        str(facts["singularities"]),
        f"{facts['seconds']:.1f}",
    ]


@dataclass(frozen=True, eq=False)
class Request:
    """Input of a method: instance, folder for files of solvers, and limits of the whole.

    start: a field to go on from, for methods that start from one; None: their own, the greedy field. stop:
    says whether to end early. clock: measures the time limit.
    """

    instance: Instance
    folder: Path
    limits: Limits = field(default_factory=Limits)
    start: CrossField | None = None
    progress: Progress = silent
    stop: IsOver = never
    clock: Clock = time.monotonic

    def deadline(self) -> Deadline:
        """Return the end of the time limit, counted from now."""
        return Deadline.after(self.limits.time_limit, self.clock)

    def stop_at_limit(self) -> IsOver:
        """Return a function that states whether the time limit, from now on, or the caller ends the work."""
        deadline = self.deadline()
        return lambda: deadline.passed() or self.stop()

    def starting_field(self, deadline: Deadline) -> CrossField:
        """The field to start from; the greedy one is improved for no more than half of the time."""
        return self.start or first_field(self.instance, deadline.share(_STARTING).passed)


@dataclass(frozen=True)
class Method:
    """A method. find: yields its fields one by one, because a later one may fail.

    The last one is its answer. timed: whether it runs up to the time limit, or ends when it is done.
    in_parallel: whether a run does it during other timed methods, because it occupies one processor. takes:
    whether it finds fields of an instance. solves: formulations whose files it writes, with their solvers.
    """

    name: str
    summary: str
    find: Callable[[Request], Iterator[Candidate]]
    timed: bool = True
    in_parallel: bool = False
    takes: Callable[[Instance], bool] = lambda _: True
    solves: tuple[tuple[str, str], ...] = ()

    def file_names(self, instance: Instance) -> list[str]:
        """Names of all files that the solvers of the method may read and write."""
        names = (names_of_solve(instance, *stage, SOLVERS[stage[1]].formats) for stage in self.solves)
        return [name for stage in names for name in stage]


def _find_greedy(request: Request) -> Iterator[Candidate]:
    request.progress("greedy field")
    is_over = request.stop_at_limit()
    yield time_candidate("greedy", lambda: greedy_field(request.instance, stop=is_over))


def _find_power(request: Request) -> Iterator[Candidate]:
    request.progress("power field")
    is_over = request.stop_at_limit()
    power = time_candidate("power", lambda: power_field(request.instance))
    yield power
    yield time_candidate("power + QP", lambda: fit_in_box(power.field, is_over))


def _find_polyvector(request: Request) -> Iterator[Candidate]:
    request.progress("PolyVector field")
    is_over = request.stop_at_limit()
    yield time_candidate("polyvector", lambda: polyvector_field(request.instance))
    if not is_over():
        yield time_candidate("polyvector + QP", lambda: polyvector_start(request.instance, is_over))


def _find_bend(request: Request) -> Iterator[Candidate]:
    request.progress("bend field")
    is_over = request.stop_at_limit()
    yield time_candidate("bend", lambda: surface_field(request.instance, stop=is_over))


def _find_by_search(request: Request) -> Iterator[Candidate]:
    begin, deadline = time.perf_counter(), request.deadline()
    request.progress("search: starting fields")
    result = search(
        request.instance,
        limits=request.limits.until(deadline),
        jobs=request.limits.threads or cores(),
        start=request.start,
        progress=lambda line: request.progress(
            f"search: {line}, at most {deadline.left():.0f} s more; Ctrl-C keeps the best field so far"
        ),
        stop=request.stop,
    )
    yield Candidate(
        "search",
        result.field,
        time.perf_counter() - begin,
        interrupted=result.ended == "interrupted",
        counts={"rounds": result.rounds},
    )


def _find_by_proof(request: Request) -> Iterator[Candidate]:
    begin, deadline = time.perf_counter(), request.deadline()
    from ...models.proof.prove import prove  # it loads compiled functions

    request.progress("prove: starting fields")
    proof = prove(
        request.instance,
        start=request.start,
        limits=request.limits.until(deadline),
        jobs=request.limits.threads or cores(),
        progress=lambda line: request.progress(f"prove: {line}; Ctrl-C keeps them"),
        stop=request.stop,
    )
    field = proof.field
    if request.instance.gauge == "box":
        near = field_in_windows(request.instance, field.alpha, field.beta, field.p)
        field = start_fields(request.instance, near, request.stop)[0]
    yield Candidate(
        "prove",
        field,
        time.perf_counter() - begin,
        interrupted=proof.ended == "interrupted",
        counts={"levels": len(proof.levels), "forced_jumps": proof.forced},
        proof=proof,
    )


def _find_in_two_stages(request: Request) -> Iterator[Candidate]:
    deadline = request.deadline()
    start = request.starting_field(jumps_until(deadline))
    begin, limits = time.perf_counter(), request.limits.until(jumps_until(deadline))
    request.progress(
        f"HiGHS: MILP for the jumps, at most {limits.time_limit:.3g} s; Ctrl-C keeps the best point so far"
    )
    # Without a start HiGHS finds no good field beyond 10 x 10 pixels.
    problem = formulate(request.instance, "milp-mccormick")
    milp = solve(problem, "highs", folder=request.folder, limits=limits, start=start, stop=request.stop)
    yield _solution_candidate("MILP", milp)
    files = time.perf_counter() - begin - (milp.seconds or 0.0)
    if deadline.left() <= files or request.stop():  # those of the second stage take about as long
        return
    request.progress("Ipopt: angles for the jumps of the MILP")
    problem = formulate(request.instance, "qp-fixed", p=milp.field.p)
    rest = request.limits.until(deadline)
    yield _solution_candidate(
        "two-stage",
        solve(problem, "ipopt", folder=request.folder, limits=rest, start=milp.field, stop=request.stop),
    )


def jumps_until(deadline: Deadline) -> Deadline:
    """Deadline of the first stage: a fifth or 2 s before the whole deadline, but not before half the time."""
    left = deadline.left()
    return deadline.later(-min(max(_ANGLES * left, _ANGLES_LEAST), left / 2))


METHODS: Final = {
    method.name: method
    for method in (
        Method(
            "greedy",
            "the greedy strategy of BendFields, on meshes of mixed-integer quadrangulation, then the best"
            " angles: the baseline",
            _find_greedy,
            timed=False,
        ),
        Method(
            "power",
            "smooth exp(4 i theta), right angles; then the best angles for its jumps; no limit cuts off the"
            " first factorisation",
            _find_power,
            timed=False,
            takes=lambda instance: instance.indices is None,
        ),
        Method(
            "polyvector",
            "smooth polynomials whose roots are the lines, at any angle; then the best angles for its jumps;"
            " no limit cuts off the first factorisation",
            _find_polyvector,
            timed=False,
            takes=lambda instance: not takes_integers(instance),
        ),
        Method(
            "bend",
            "lines that change little along the other line, from the PolyVector field with hard strokes; no"
            " limit cuts off the factorisation of that field",
            _find_bend,
            timed=False,
            takes=lambda instance: not takes_integers(instance),
        ),
        Method(
            "search",
            "local search over jumps and singularities from the greedy field on, up to the time limit",
            _find_by_search,
        ),
        Method(
            "two-stage",
            "section 5 of the paper: HiGHS on milp-mccormick up to the time limit, Ipopt on qp-fixed",
            _find_in_two_stages,
            in_parallel=True,
            takes=lambda instance: instance.indices is None,
            solves=(("milp-mccormick", "highs"), ("qp-fixed", "ipopt")),
        ),
        Method(
            "prove",
            "lower bounds on lattices of crosses, and fields from them, until one is proven optimal",
            _find_by_proof,
            takes=lambda instance: instance.orthogonal or not takes_integers(instance),
        ),
    )
}
"""The table of methods; command line, runs, docs and tests are generated from it."""


def methods_of(instance: Instance) -> list[Method]:
    """The methods that find fields of an instance."""
    return [method for method in METHODS.values() if method.takes(instance)]


def find_method(name: str, instance: Instance) -> Method:
    """The method of that name. Raises DomainError if it finds no fields of the instance."""
    names = [method.name for method in methods_of(instance)]
    if name not in names:
        raise DomainError(
            f"{name} finds no fields on the {instance.domain.kind}s of {instance.name} with "
            f"{'right' if instance.orthogonal else 'free'} angles"
            f"{' and prescribed indices' * (instance.indices is not None)}; use {', '.join(names)}"
        )
    return METHODS[name]


def time_candidate(method: str, find: Callable[[], CrossField]) -> Candidate:
    """The field that a function finds, with the seconds that it takes."""
    begin = time.perf_counter()
    field = find()
    return Candidate(method, field, time.perf_counter() - begin)


def _solution_candidate(method: str, solution: Solution) -> Candidate:
    seconds = solution.seconds or 0.0
    return Candidate(method, solution.field, seconds, solution, solution.interrupted)
