"""A solver driver in AMPL's manner: reads stub.nl, solves it with Ipopt or Bonmin through CasADi, leaves stub.sol.

Run as a child process, `python -m crossfield.export.casadi_driver ipopt model.nl model.sol seconds gap`: a crash of a solver takes
the child alone, and its log is the child's output. On an interrupt (SIGINT) the best point so far is left.
"""

from __future__ import annotations

import signal
import sys
from pathlib import Path
from types import FrameType
from typing import Any, Final

import casadi as ca
import numpy as np

from .ampl_sol import write_ampl_sol

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


class Stop(ca.Callback):  # type: ignore[misc]
    """Called by Ipopt at every iterate; asks it to stop once an interrupt has come."""

    def __init__(self, columns: int, rows: int) -> None:
        """A callback for a problem of that size."""
        ca.Callback.__init__(self)
        self.sizes = {"x": columns, "f": 1, "g": rows, "lam_x": columns, "lam_g": rows, "lam_p": 0}
        self.wanted = False
        self.construct("stop", {})

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

    def eval(self, _arguments: list[Any]) -> list[int]:
        """1 to stop, 0 to go on."""
        return [int(self.wanted)]


def options(solver: str, seconds: float, gap: float) -> dict[str, Any]:
    """Options of the solver for a time limit and a relative gap."""
    if solver == "ipopt":
        return {"ipopt.max_wall_time": seconds, "ipopt.tol": 1e-10, "ipopt.max_iter": 10000, "ipopt.bound_relax_factor": 0.0, "ipopt.sb": "yes"}
    return {"bonmin.time_limit": seconds, "bonmin.allowable_fraction_gap": gap, "bonmin.algorithm": "B-BB"}


def solve(solver: str, model: Path, seconds: float, gap: float) -> tuple[str, int, np.ndarray[Any, Any], tuple[int, int]]:
    """The solver's own words, AMPL's solve code, the point in .nl order, and the numbers of columns and rows."""
    builder = ca.NlpBuilder()
    builder.import_nl(str(model))
    problem = {"x": ca.vertcat(*builder.x), "f": builder.f, "g": ca.vertcat(*builder.g)}
    chosen = options(solver, seconds, gap) | {"print_time": False, "error_on_fail": False}
    rows = len(builder.g)
    stop = Stop(len(builder.x), rows)
    if solver == "ipopt":
        chosen["iteration_callback"] = stop
        signal.signal(signal.SIGINT, stop.on_signal)  # Bonmin installs a handler of its own
    else:
        chosen["discrete"] = builder.discrete
    run = ca.nlpsol("solver", solver, problem, chosen)
    answer = run(x0=builder.x_init, lbx=builder.x_lb, ubx=builder.x_ub, lbg=builder.g_lb, ubg=builder.g_ub)
    words = str(run.stats()["return_status"])
    code = _CODES.get(words, _FAILURE)
    lacks_point = solver == "bonmin" and float(answer["f"]) >= 1e49  # Bonmin's infinity: no incumbent
    point = np.zeros(0) if lacks_point or code in {220, 300} else np.array(answer["x"]).ravel()
    return f"{solver} through CasADi {ca.__version__}: {words}", code + 70 * (lacks_point and code == 400), point, (len(builder.x), rows)


def main(arguments: list[str]) -> int:
    """0 when a .sol was written; the solver's status stands in it."""
    solver, model, solution, seconds, gap = arguments
    message, code, point, (columns, rows) = solve(solver, Path(model), float(seconds), float(gap))
    write_ampl_sol(solution, message, point, rows, code, columns=columns)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
