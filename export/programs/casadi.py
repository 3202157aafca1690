"""CasADi as a reader of .nl, and the solvers that come with it: Ipopt and Bonmin.

Bonmin takes no starting point for its integers. A feasible start therefore serves as its cutoff: it searches
only for better points, and the start is the answer if there is none.
"""

from __future__ import annotations

import signal
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

with warnings.catch_warnings(action="ignore"):  # its import warns on newer Pythons
    import casadi as ca

from ...models.instance.domain import Bools, Floats
from ...models.processes.child_program import is_stopped, on_stop
from ..solutions.readers.ampl import write_ampl_sol
from ..statuses import CASADI
from .model_content import Behaviour, Points
from .protocol import FEASIBILITY, Job, Outcome, RefusedError, file_names, interrupt_self


@dataclass(frozen=True, eq=False)
class NlModel:
    """A .nl file in its own order: limits of columns (n,) and rows (m,), start (n,), integrality (n,).

    start: zeros if the file has none. problem: CasADi's expressions, `x`, `f` and `g`.
    """

    problem: dict[str, Any]
    lower: Floats
    upper: Floats
    row_lower: Floats
    row_upper: Floats
    start: Floats
    discrete: Bools

    @cached_property
    def _function(self) -> Any:
        return ca.Function("model", [self.problem["x"]], [self.problem["f"], self.problem["g"]])

    def evaluate(self, point: Floats) -> tuple[float, Floats]:
        """Objective and rows (m,) at a point (n,)."""
        objective, rows = self._function(point)
        return float(objective), np.array(rows).ravel()

    def feasible_value(self, point: Floats) -> float | None:
        """The objective at a point (n,), or None when the point is not feasible."""
        objective, rows = self.evaluate(point)
        are_whole = np.abs(point - np.round(point))[self.discrete].max(initial=0.0) <= FEASIBILITY
        return objective if are_whole and self.is_within_limits(point, rows) else None

    def is_within_limits(self, point: Floats, rows: Floats) -> bool:
        """Whether a point (n,) and the values of its rows (m,) respect their limits."""
        excess = (self.lower - point, point - self.upper, self.row_lower - rows, rows - self.row_upper)
        return all(float(part.max(initial=0.0)) <= FEASIBILITY for part in excess)


def read_nl(path: Path) -> NlModel:
    """The content of a .nl file."""
    read = ca.NlpBuilder()
    read.import_nl(str(path))
    problem = {"x": ca.vertcat(*read.x), "f": read.f, "g": ca.vertcat(*read.g)}
    numbers = (read.x_lb, read.x_ub, read.g_lb, read.g_ub, read.x_init)
    ends = (np.array(ca.DM(values), dtype=float).ravel() for values in numbers)
    lower, upper, row_lower, row_upper, start = ends
    discrete = np.array(read.discrete, dtype=bool)
    return NlModel(problem, lower, upper, row_lower, row_upper, start, discrete)


_FAILURE: Final = 500
_LIMIT: Final = 400
_STOPPED: Final = {"User_Requested_Stop", "USER_INTERRUPT"}
_NO_POINT: Final = 1e49
"""Least objective that means no incumbent: Bonmin then reports 1e50."""


class IterateWatch(ca.Callback):
    """Callback of Ipopt at every iterate: keeps the best feasible point and passes on a request to stop.

    best: the lowest feasible point so far, initially the start; None without one. value: its
    objective.
    """

    def __init__(self, model: NlModel) -> None:
        """A callback for a model."""
        ca.Callback.__init__(self)
        self.model = model
        columns, rows = len(model.start), len(model.row_lower)
        self.sizes = {"x": columns, "f": 1, "g": rows, "lam_x": columns, "lam_g": rows, "lam_p": 0}
        start = model.feasible_value(model.start)
        self.value = np.inf if start is None else start
        self.best = None if start is None else model.start
        self.construct("watch", {})

    def get_n_in(self) -> int:
        """Number of inputs, as required by CasADi."""
        return int(ca.nlpsol_n_out())

    def get_n_out(self) -> int:
        """One output: whether to stop."""
        return 1

    def get_name_in(self, i: int) -> str:
        """Names of inputs are those of a solver's outputs."""
        return str(ca.nlpsol_out(i))

    def get_name_out(self, _i: int) -> str:
        """Name of the output."""
        return "ret"

    def get_sparsity_in(self, i: int) -> Any:
        """Shape of an input."""
        return ca.Sparsity.dense(self.sizes[str(ca.nlpsol_out(i))], 1)

    def eval(self, arguments: Sequence[Any]) -> list[int]:
        """Return 1 to stop, 0 to continue."""
        by_name = dict(zip(self.sizes, arguments, strict=True))
        self.keep_if_better(*(np.array(by_name[name]).ravel() for name in ("x", "f", "g")))
        return [int(is_stopped())]

    def keep_if_better(self, point: Floats, value: Floats, rows: Floats) -> None:
        """Keep a point (n,) with its objective (1,) and rows (m,) if it is feasible and lower."""
        if value[0] < self.value and self.model.is_within_limits(point, rows):
            self.value, self.best = float(value[0]), point


class AmplAnswer(NamedTuple):
    """The solver's own words, AMPL's solve code, and the point in .nl order, empty when there is none."""

    words: str
    code: int
    point: Floats


def solver_options(solver: str, seconds: float, gap: float) -> dict[str, Any]:
    """Options of the solver for a time limit and a relative gap."""
    if solver == "ipopt":
        return {
            "ipopt.max_wall_time": seconds,
            "ipopt.tol": 1e-10,
            "ipopt.max_iter": 10000,
            # Fixed integers make equations of the facets.
            # Without this tolerance Ipopt then stops early and reports an optimum.
            "ipopt.bound_relax_factor": 1e-9,
            "ipopt.honor_original_bounds": "yes",
            "ipopt.sb": "yes",
        }
    return {
        "bonmin.time_limit": seconds,
        "bonmin.allowable_fraction_gap": gap,
        "bonmin.algorithm": "B-BB",
        # These two start a search in the search, which ignores limits and interrupts.
        "bonmin.heuristic_dive_MIP_fractional": "no",
        "bonmin.heuristic_dive_MIP_vectorLength": "no",
    }


def version() -> str:
    """Its version."""
    return str(ca.CasadiMeta.version())


def evaluate(path: Path, points: Points) -> Behaviour:
    """The .nl file as CasADi reads it; names come from .col and .row."""
    model = read_nl(path)
    columns, rows = file_names(path)
    values = [model.evaluate(point) for point in points.of(columns)]
    return Behaviour(
        columns,
        model.lower,
        model.upper,
        model.discrete,
        rows,
        model.row_lower,
        model.row_upper,
        np.array([objective for objective, _ in values]),
        np.array([row for _, row in values]).reshape(len(values), len(rows)),
    )


def solve(job: Job) -> Outcome:
    """Solve the file with Ipopt or Bonmin; the solution is an AMPL .sol, which states the stamp."""
    model = read_nl(job.model)
    answer = solve_model(job.solver, model, job.seconds, job.gap)
    message = f"{job.solver} through CasADi {version()}: {answer.words}"
    columns, rows = len(model.start), len(model.row_lower)
    write_ampl_sol(job.solution, message, answer.point, rows, answer.code, columns=columns, stamp=job.stamp)
    return Outcome()


def solve_model(solver: str, model: NlModel, seconds: float, gap: float) -> AmplAnswer:
    """Solve a model in the main thread of a separate process, because SIGINT interrupts Bonmin.

    Raises RefusedError for an error inside the solver.
    """
    chosen = solver_options(solver, seconds, gap) | {"print_time": False, "error_on_fail": False}
    watch = IterateWatch(model)
    if solver == "ipopt":
        chosen["iteration_callback"] = watch
    else:
        chosen["discrete"] = model.discrete.tolist()
        chosen |= {} if watch.best is None else {"bonmin.cutoff": watch.value}
    run = ca.nlpsol("solver", solver, model.problem, chosen)
    ends = {"lbx": model.lower, "ubx": model.upper, "lbg": model.row_lower, "ubg": model.row_upper}
    size = f"{len(model.start)} columns, {len(model.row_lower)} rows"
    print(f"{solver}: {size}, at most {seconds:.3g} s", flush=True)  # noqa: T201 - the output is the log
    hook: Callable[[], object] = is_stopped
    if solver == "bonmin":
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Bonmin handles it once its search has begun
        hook = interrupt_self
    try:
        with on_stop(hook):
            answer = run(x0=model.start, **ends)
    except RuntimeError as error:  # CasADi first names places in its source
        why = str(error).rpartition(": ")[2]
        raise RefusedError(f"{solver.title()} ended with an error, {why!r}") from error
    words = str(run.stats()["return_status"])
    code = CASADI.get(words, _FAILURE)
    words += " (at the limit, or by Ctrl-C)" if words in _STOPPED else ""
    point, value = np.array(answer["x"]).ravel(), float(answer["f"])
    if solver == "bonmin" and value >= _NO_POINT:
        return _answer_of_start(words, code, watch)
    if solver == "ipopt" and code == _LIMIT and watch.best is not None:
        watch.keep_if_better(point, np.array([value]), np.array(answer["g"]).ravel())
        words += "" if watch.best is point else ", the best feasible point before it"
        return AmplAnswer(words, code, watch.best)
    return AmplAnswer(words, code, np.zeros(0) if code == 300 else point)


def _answer_of_start(words: str, code: int, watch: IterateWatch) -> AmplAnswer:
    """The answer of a search by Bonmin without a result: the start, if it is feasible."""
    if watch.best is None:
        return AmplAnswer(words, 470 if code == _LIMIT else code, np.zeros(0))
    return AmplAnswer(f"{words}, nothing better than the start", 0 if code == 220 else code, watch.best)
