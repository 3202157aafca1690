"""Claims of solvers about their answers, and the words and codes by which each program states them.

One table per program, for readers of solution files and drivers. Nothing heavy is imported:
the child processes of solvers load this module.
"""

from __future__ import annotations

import re
from enum import StrEnum
from typing import Final


class Status(StrEnum):
    """A solver's claim about its answer, and the remaining status once the point is checked.

    no-point: there is none, without a reason. unknown: the point contradicts the claim.
    """

    OPTIMAL_GLOBAL = "optimal-global"
    OPTIMAL_LOCAL = "optimal-local"
    FEASIBLE = "feasible"
    INFEASIBLE = "infeasible"
    UNBOUNDED = "unbounded"
    LIMIT_WITH_POINT = "limit-with-point"
    LIMIT_WITHOUT_POINT = "limit-without-point"
    NO_POINT = "no-point"
    ERROR = "error"
    UNKNOWN = "unknown"

    @property
    def needs_point(self) -> bool:
        """Whether the status implies a feasible point."""
        return self in {
            Status.OPTIMAL_GLOBAL,
            Status.OPTIMAL_LOCAL,
            Status.FEASIBLE,
            Status.LIMIT_WITH_POINT,
        }

    @property
    def without_point(self) -> Status:
        """The status of a file that states this one, but holds no point."""
        if self is Status.LIMIT_WITH_POINT:
            return Status.LIMIT_WITHOUT_POINT
        return Status.ERROR if self.needs_point else self


OPTIMAL_GAP: Final = 1.01e-4, 1e-6
"""Largest relative and absolute gap of an optimum: the defaults of solvers."""


def is_gap_closed(bound: float, objective: float) -> bool:
    """Whether a dual bound is so close to an objective that a claim of optimality holds."""
    relative, absolute = OPTIMAL_GAP
    return objective - bound <= max(absolute, relative * abs(objective))


HIGHS: Final = {
    "Optimal": Status.OPTIMAL_GLOBAL,
    "Infeasible": Status.INFEASIBLE,
    "Primal infeasible or unbounded": Status.INFEASIBLE,  # our objectives are bounded below
    "Unbounded": Status.UNBOUNDED,
    "Bound on objective reached": Status.LIMIT_WITH_POINT,
    "Target for objective reached": Status.LIMIT_WITH_POINT,
    "Time limit reached": Status.LIMIT_WITH_POINT,
    "Iteration limit reached": Status.LIMIT_WITH_POINT,
    "Solution limit reached": Status.LIMIT_WITH_POINT,
    "Memory limit reached": Status.LIMIT_WITH_POINT,
    "Interrupted by user": Status.LIMIT_WITH_POINT,
    "Interrupted by HiGHS": Status.LIMIT_WITH_POINT,
    "Unknown": Status.LIMIT_WITH_POINT,
}
"""HiGHS's words for its model status."""

GUROBI: Final = {
    2: (Status.OPTIMAL_GLOBAL, "optimal"),
    3: (Status.INFEASIBLE, "infeasible"),
    4: (Status.INFEASIBLE, "infeasible or unbounded"),  # our objectives are bounded below
    5: (Status.UNBOUNDED, "unbounded"),
    6: (Status.LIMIT_WITH_POINT, "cutoff"),
    7: (Status.LIMIT_WITH_POINT, "iteration limit"),
    8: (Status.LIMIT_WITH_POINT, "node limit"),
    9: (Status.LIMIT_WITH_POINT, "time limit"),
    10: (Status.LIMIT_WITH_POINT, "solution limit"),
    11: (Status.LIMIT_WITH_POINT, "interrupted"),
    13: (Status.FEASIBLE, "suboptimal"),
    15: (Status.LIMIT_WITH_POINT, "objective limit"),
    16: (Status.LIMIT_WITH_POINT, "work limit"),
    17: (Status.LIMIT_WITH_POINT, "memory limit"),
    18: (Status.OPTIMAL_LOCAL, "locally optimal"),
    19: (Status.LIMIT_WITH_POINT, "locally infeasible"),  # proves nothing, and has no point
}
"""Gurobi's status codes, and their words."""

XPRESS: Final = {
    "NOTFOUND": Status.LIMIT_WITHOUT_POINT,
    "OPTIMAL": Status.OPTIMAL_GLOBAL,
    "FEASIBLE": Status.LIMIT_WITH_POINT,
    "INFEASIBLE": Status.INFEASIBLE,
    "UNBOUNDED": Status.UNBOUNDED,
}
"""Xpress's names of a solution status (SolStatus)."""

_CPLEX_CODES: Final = {
    Status.OPTIMAL_GLOBAL: (1, 101, 102, 129, 130),
    Status.OPTIMAL_LOCAL: (24,),
    # 5 and 115: optimal, but infeasible before scaling; 127: a further solution of a pool
    Status.FEASIBLE: (5, 23, 115, 127),
    Status.INFEASIBLE: (3, 4, 103, 119),  # 4 and 119: or unbounded, which our objectives are not
    Status.UNBOUNDED: (2, 20, 118, 133),
    Status.LIMIT_WITH_POINT: (6, 104, 105, 107, 109, 111, 113, 116, 128, 131),
    Status.LIMIT_WITHOUT_POINT: (106, 108, 110, 112, 114, 117, 132),
}
CPLEX: Final = {code: status for status, codes in _CPLEX_CODES.items() for code in codes}
"""CPLEX's codes of CPXgetstat: 1 to 25 for continuous problems, from 101 for integer ones."""

CPLEX_STOPPED: Final = {10, 11, 12, 13, 21, 22, 25}
"""CPLEX's codes of a continuous problem that was stopped: its header states whether the point is feasible."""

SCIP: Final = {
    "optimal solution found": Status.OPTIMAL_GLOBAL,
    "optimal": Status.OPTIMAL_GLOBAL,
    "infeasible": Status.INFEASIBLE,
    "infeasible or unbounded": Status.INFEASIBLE,  # our objectives are bounded below
    "inforunbd": Status.INFEASIBLE,
    "unbounded": Status.UNBOUNDED,
    "user interrupt": Status.LIMIT_WITH_POINT,
    "userinterrupt": Status.LIMIT_WITH_POINT,
    "termination signal received": Status.LIMIT_WITH_POINT,
    "terminate": Status.LIMIT_WITH_POINT,
    "unknown": Status.FEASIBLE,
}
"""SCIP's words (SCIPprintStatus), and PySCIPOpt's names for the same."""

SCIP_GAP: Final = "gaplimit"
"""PySCIPOpt's name for a search that ended at the gap it was given."""


def status_of_scip(words: str) -> Status:
    """The status in SCIP's words; every limit that it reaches has words of its own."""
    limit = words.endswith(("limit reached", "limit"))
    return Status.LIMIT_WITH_POINT if limit else SCIP.get(words, Status.ERROR)


CBC: Final = {
    "optimal": Status.OPTIMAL_GLOBAL,
    "infeasible": Status.INFEASIBLE,
    "integer infeasible": Status.INFEASIBLE,
    "linear relaxation infeasible": Status.INFEASIBLE,
    "unbounded": Status.UNBOUNDED,
    "linear relaxation unbounded": Status.UNBOUNDED,
    "stopped on difficulties": Status.ERROR,
    "stopped": Status.LIMIT_WITH_POINT,
}
"""The start of CBC's words in lower case; the first that fits counts."""


def status_of_cbc(words: str) -> Status:
    """The status in CBC's words, which may end with what values follow."""
    known = (status for start, status in CBC.items() if words.lower().startswith(start))
    status = next(known, Status.ERROR)
    relaxed = "continuous used" in words and status.needs_point
    return Status.LIMIT_WITHOUT_POINT if relaxed else status


GLPK: Final = {
    "o": Status.OPTIMAL_GLOBAL,
    "f": Status.LIMIT_WITH_POINT,
    "n": Status.INFEASIBLE,
    "i": Status.LIMIT_WITHOUT_POINT,
    "u": Status.LIMIT_WITHOUT_POINT,
    "f f": Status.OPTIMAL_GLOBAL,
    "f i": Status.LIMIT_WITH_POINT,
    "f u": Status.LIMIT_WITH_POINT,
    "f n": Status.UNBOUNDED,
    "n f": Status.INFEASIBLE,
    "n i": Status.INFEASIBLE,
    "n n": Status.INFEASIBLE,
    "n u": Status.INFEASIBLE,
}
"""GLPK's letters: optimal, feasible, infeasible point, no solution, undefined; a basis has two of them, for
its primal and its dual side. Other pairs are LIMIT_WITHOUT_POINT."""

GAMS_MODEL: Final = {
    1: (Status.OPTIMAL_GLOBAL, "optimal"),
    2: (Status.OPTIMAL_LOCAL, "locally optimal"),
    3: (Status.UNBOUNDED, "unbounded"),
    4: (Status.INFEASIBLE, "infeasible"),
    5: (Status.LIMIT_WITHOUT_POINT, "locally infeasible"),  # proves nothing
    6: (Status.LIMIT_WITHOUT_POINT, "intermediate infeasible"),
    7: (Status.FEASIBLE, "feasible solution"),
    8: (Status.FEASIBLE, "integer solution"),
    9: (Status.LIMIT_WITHOUT_POINT, "intermediate non-integer"),
    10: (Status.INFEASIBLE, "integer infeasible"),
    14: (Status.LIMIT_WITHOUT_POINT, "no solution returned"),
    18: (Status.UNBOUNDED, "unbounded, no solution"),
    19: (Status.INFEASIBLE, "infeasible, no solution"),
}
"""GAMS's model states (modelStat), and their words."""

GAMS_SOLVER: Final = {
    1: "normal completion",
    2: "iteration limit",
    3: "time limit",
    4: "terminated by the solver",
    5: "evaluation errors",
    6: "capability problems",
    7: "licensing problems",
    8: "user interrupt",
    9: "setup failure",
    10: "solver failure",
    11: "internal solver error",
    12: "skipped",
    13: "system failure",
}
"""GAMS's solver states (solveStat) in words."""

GAMS_INTEGER, GAMS_NORMAL = 8, 1
"""GAMS's model state and solver state of a search that ended at the gap it was given."""

GAMS_LIMITS: Final = {2, 3, 4, 8}
"""GAMS's solver states at which a limit or the user ended the search."""


def status_of_gams(model: int, solver: int) -> tuple[Status, str]:
    """The claim of GAMS's model state and solver state, and both in words."""
    status, words = GAMS_MODEL.get(model, (Status.ERROR, f"model status {model}"))
    if status is Status.FEASIBLE and solver in GAMS_LIMITS:
        status = Status.LIMIT_WITH_POINT
    if status is Status.LIMIT_WITHOUT_POINT and solver not in GAMS_LIMITS | {1}:
        status = Status.ERROR
    return status, f"{words}; {GAMS_SOLVER.get(solver, f'solver status {solver}')}"


AMPL: Final = (
    (-1, Status.ERROR),
    (99, Status.OPTIMAL_LOCAL),
    (199, Status.FEASIBLE),
    (299, Status.INFEASIBLE),
    (399, Status.UNBOUNDED),
    # from 450 to 469: infeasible or unbounded, which points rule out; older SCIP uses 450 for interrupted
    (469, Status.LIMIT_WITH_POINT),
    (499, Status.LIMIT_WITHOUT_POINT),
)
"""Greatest AMPL solve code of each status (ampl/mp, include/mp/common.h); greater codes are failures."""

AMPL_GLOBAL: Final = re.compile(
    r"(optimal solution found$|(baron|cbc|copt|cplex|gurobi|highs|scip|xpress)\b(?!.*\blocal).*\boptimal)",
    re.IGNORECASE,
)
"""Messages of AMPL's solvers that prove global optimality. SCIP writes the first three words instead of its
name; Ipopt writes them after its own."""


def status_of_ampl(code: int | None, message: str, *, with_point: bool) -> Status:
    """The status of an AMPL solve code, which states only `solved`: the message names who can prove more."""
    if code is None:
        return Status.FEASIBLE if with_point else Status.NO_POINT
    if 0 <= code <= 99 and AMPL_GLOBAL.match(message):
        return Status.OPTIMAL_GLOBAL
    if 450 <= code <= 469 and not with_point and "infeasible" in message.lower():
        return Status.INFEASIBLE
    status = next((status for last, status in AMPL if code <= last), Status.ERROR)
    return status if with_point else status.without_point


CASADI: Final = {
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
"""CasADi's words for the end of Ipopt and Bonmin, as AMPL's solve codes.

0: solved; 100: solved?; 200: infeasible; 300: unbounded; 400: limit with a point.
"""

BARON_NORMAL: Final = "Normal completion"
"""BARON's banner when its search ended by itself."""

BARON_STOPPED: Final = re.compile(r"max\. allowable|memory|interrupt", re.IGNORECASE)
"""BARON's banners at a limit."""


def status_of_baron(banner: str, *, has_table: bool, unbounded: bool) -> Status:
    """The status of BARON's last banner, and of whether a table of the best point and a ray follow it."""
    if banner == BARON_NORMAL:
        proven = Status.OPTIMAL_GLOBAL if has_table else Status.INFEASIBLE
        return Status.UNBOUNDED if unbounded else proven
    if has_table:
        return Status.LIMIT_WITH_POINT
    return Status.LIMIT_WITHOUT_POINT if BARON_STOPPED.search(banner) else Status.ERROR


PULP: Final = {
    1: (Status.OPTIMAL_GLOBAL, "optimal"),
    2: (Status.FEASIBLE, "feasible"),
    0: (Status.NO_POINT, "no solution found"),
    -1: (Status.INFEASIBLE, "infeasible"),
    -2: (Status.UNBOUNDED, "unbounded"),
}
"""PuLP's codes of a solution (LpSolution), and their words."""

PYOMO: Final = {
    "optimal": Status.OPTIMAL_LOCAL,
    "globallyOptimal": Status.OPTIMAL_GLOBAL,
    "locallyOptimal": Status.OPTIMAL_LOCAL,
    "feasible": Status.FEASIBLE,
    "maxTimeLimit": Status.LIMIT_WITH_POINT,
    "maxIterations": Status.LIMIT_WITH_POINT,
    "infeasible": Status.INFEASIBLE,
    "infeasibleOrUnbounded": Status.INFEASIBLE,  # our objectives are bounded below
    "unbounded": Status.UNBOUNDED,
}
"""Pyomo's termination conditions, also of plain documents: of any solver, so `optimal` counts as local."""


WORDS: Final = (
    (r"infeasible|inconsistent", Status.INFEASIBLE),
    (r"unbounded", Status.UNBOUNDED),
    (r"local", Status.OPTIMAL_LOCAL),
    (r"(?:integer |proven |globally )?optimal", Status.OPTIMAL_GLOBAL),
    (r".*\b(?:limit|interrupt|stopped|time|abort)", Status.LIMIT_WITH_POINT),
)
"""Start of the words of other programs, as in a comment `# Status: Optimal`; other words claim no more than a
point."""


def status_of_words(words: str) -> Status:
    """The status in words of any program."""
    known = (status for start, status in WORDS if re.match(start, words, re.IGNORECASE))
    return next(known, Status.FEASIBLE)
