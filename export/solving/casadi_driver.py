"""A driver in AMPL's manner: reads stub.nl, solves it with Ipopt or Bonmin through CasADi, leaves stub.sol.

Run as a child process, `python -m crossfield.export.solving.casadi_driver ipopt model.nl model.sol gap stamp
seconds`: a crash of a solver ends only the child, and its log is the child's output. The seconds count from
the start of the child. The log's first line says that the solver starts; from then on an interrupt (SIGINT)
ends the search, and the best point so far is written. The child ends with its parent: when its standard input
closes.

The stamp says of which problem the model is, and is repeated in the message.

Bonmin takes no starting point for its integers. A feasible one is therefore its cutoff: it looks for better
points only, and the start is the answer when there is none.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType
from typing import Any, Final, NamedTuple

import numpy as np

from ...models.errors import SolverError
from ...models.instance.grid import Floats
from ...models.processes.deadline import Deadline
from ...models.processes.side_by_side import leave_with_parent
from ..solutions.readers.ampl import write_ampl_sol
from .job import LEAST
from .nl_model import NlModel, ca, read_nl

# AMPL's solve codes: 0 solved, 100 solved?, 200 infeasible, 300 unbounded, 400 limit with point, 500 failure.
_CODES: Final = {
    "Solve_Succeeded": 0,
    "Solved_To_Acceptable_Level": 100,
    "Feasible_Point_Found": 100,
    "Infeasible_Problem_Detected": 200,
    "Diverging_Iterates": 300,
    "User_Requested_Stop": 400,
    "Maximum_Iterations_Exceeded": 400,
    "Maximum_CpuTime_Exceeded": 400,
    "Maximum_WallTime_Exceeded": 400,
    "Search_Direction_Becomes_Too_Small": 100,
    "SUCCESS": 0,
    "INFEASIBLE": 220,
    "CONTINUOUS_UNBOUNDED": 300,
    "LIMIT_EXCEEDED": 400,
    "USER_INTERRUPT": 400,
}
_FAILURE: Final = 500
_LIMIT: Final = 400
_STOPPED: Final = {"User_Requested_Stop", "USER_INTERRUPT"}
_NO_POINT: Final = 1e49
"""Bonmin's objective when it has no incumbent is 1e50."""


class Watch(ca.Callback):
    """Called by Ipopt at every iterate: keeps the best feasible point, and asks it to stop on an interrupt.

    best: the lowest feasible point so far, the start to begin with; None where there is none. value: its
    objective.
    """

    def __init__(self, model: NlModel) -> None:
        """A callback for a model."""
        ca.Callback.__init__(self)
        self.model = model
        columns, rows = len(model.start), len(model.row_lower)
        self.sizes = {"x": columns, "f": 1, "g": rows, "lam_x": columns, "lam_g": rows, "lam_p": 0}
        self.wanted = False
        start = model.feasible_value(model.start)
        self.value = np.inf if start is None else start
        self.best = None if start is None else model.start
        self.construct("watch", {})

    def on_signal(self, _number: int, _frame: FrameType | None) -> None:
        """Remember the interrupt."""
        self.wanted = True

    def get_n_in(self) -> int:
        """Number of inputs, as CasADi asks for it."""
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
        """1 to stop, 0 to go on."""
        by_name = dict(zip(self.sizes, arguments, strict=True))
        self.see(*(np.array(by_name[name]).ravel() for name in ("x", "f", "g")))
        return [int(self.wanted)]

    def see(self, point: Floats, value: Floats, rows: Floats) -> None:
        """Keep a point (n,) with its objective (1,) and rows (m,) if it is feasible and lower."""
        if value[0] < self.value and self.model.holds(point, rows):
            self.value, self.best = float(value[0]), point


class AmplAnswer(NamedTuple):
    """The solver's own words, AMPL's solve code, and the point in .nl order, empty when there is none."""

    words: str
    code: int
    point: Floats


def options(solver: str, seconds: float, gap: float) -> dict[str, Any]:
    """Options of the solver for a time limit and a relative gap."""
    if solver == "ipopt":
        return {
            "ipopt.max_wall_time": seconds,
            "ipopt.tol": 1e-10,
            "ipopt.max_iter": 10000,
            # Fixed integers make equations of the facets.
            # Without a little room Ipopt then stops early and says optimal.
            "ipopt.bound_relax_factor": 1e-9,
            "ipopt.honor_original_bounds": "yes",
            "ipopt.sb": "yes",
        }
    return {
        "bonmin.time_limit": seconds,
        "bonmin.allowable_fraction_gap": gap,
        "bonmin.algorithm": "B-BB",
        # These two start a search in the search, which heeds neither a limit nor an interrupt.
        "bonmin.heuristic_dive_MIP_fractional": "no",
        "bonmin.heuristic_dive_MIP_vectorLength": "no",
    }


def solve(
    solver: str, model: NlModel, seconds: float, gap: float, started: Callable[[], object] = lambda: None
) -> AmplAnswer:
    """How the solver ended. `started` is called when it is about to begin.

    Must run in the main thread of a process of its own: it takes over the handling of SIGINT. Raises
    SolverError for an error inside the solver.
    """
    chosen = options(solver, seconds, gap) | {"print_time": False, "error_on_fail": False}
    watch = Watch(model)
    signal.signal(signal.SIGINT, watch.on_signal)  # Bonmin puts a handler of its own in its place
    if solver == "ipopt":
        chosen["iteration_callback"] = watch
    else:
        chosen["discrete"] = model.discrete.tolist()
        chosen |= {} if watch.best is None else {"bonmin.cutoff": watch.value}
    run = ca.nlpsol("solver", solver, model.problem, chosen)
    started()
    ends = {"lbx": model.lower, "ubx": model.upper, "lbg": model.row_lower, "ubg": model.row_upper}
    try:
        answer = run(x0=model.start, **ends)
    except RuntimeError as error:  # CasADi names places in its source first
        why = str(error).rpartition(": ")[2]
        raise SolverError(f"{solver.title()} ended with an error, {why!r}") from error
    words = str(run.stats()["return_status"])
    code = _CODES.get(words, _FAILURE)
    words += " (at the limit, or by Ctrl-C)" if words in _STOPPED else ""
    point, value = np.array(answer["x"]).ravel(), float(answer["f"])
    if solver == "bonmin" and value >= _NO_POINT:
        return _without_better(words, code, watch)
    if solver == "ipopt" and code == _LIMIT and watch.best is not None:
        watch.see(point, np.array([value]), np.array(answer["g"]).ravel())
        words += "" if watch.best is point else ", the best feasible point before it"
        return AmplAnswer(words, code, watch.best)
    return AmplAnswer(words, code, np.zeros(0) if code == 300 else point)


def _without_better(words: str, code: int, watch: Watch) -> AmplAnswer:
    """The answer of a search by Bonmin that found nothing: the start, where it is feasible."""
    if watch.best is None:
        return AmplAnswer(words, 470 if code == _LIMIT else code, np.zeros(0))
    return AmplAnswer(f"{words}, nothing better than the start", 0 if code == 220 else code, watch.best)


def main(arguments: list[str]) -> int:
    """0 when a .sol was written, in which the status stands; else 1, and the log ends with the reason."""
    solver, path, solution, gap, stamp, limit = arguments
    deadline = Deadline.since_start(float(limit))
    leave_with_parent()
    model = read_nl(Path(path))
    seconds = max(deadline.left(), LEAST)
    columns, rows = len(model.start), len(model.row_lower)
    line = f"{solver}: {columns} columns, {rows} rows, at most {seconds:.3g} s"
    # What is printed is the log.
    try:
        answer = solve(solver, model, seconds, float(gap), started=lambda: print(line, flush=True))  # noqa: T201
    except SolverError as error:
        print(error)  # noqa: T201
        return 1
    message = f"{solver} through CasADi {ca.CasadiMeta.version()}: {answer.words}\n{stamp}"
    write_ampl_sol(solution, message, answer.point, rows, answer.code, columns=columns)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
