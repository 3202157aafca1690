"""Claims of solvers about their answers, and the words and codes by which each program states them.

One table, statuses.csv, for readers of solution files and drivers. Nothing heavy is imported: the child
processes of solvers load this module.
"""

from __future__ import annotations

import csv
import re
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import Final, NamedTuple


class Status(StrEnum):
    """A solver's claim about its answer, and the remaining status once the point is checked.

    optimal-global: a dual bound closes the gap, or the program's word means that it is closed.
    optimal-in-gap: what a program calls optimal within a gap that its user may choose, and that is unknown.
    no-point: there is none, without a reason. unknown: the point contradicts the claim.
    """

    OPTIMAL_GLOBAL = "optimal-global"
    OPTIMAL_IN_GAP = "optimal-in-gap"
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
        return self.is_optimal or self in {Status.FEASIBLE, Status.LIMIT_WITH_POINT}

    @property
    def is_optimal(self) -> bool:
        """Whether the status calls the point optimal in any sense."""
        return self in {Status.OPTIMAL_GLOBAL, Status.OPTIMAL_IN_GAP, Status.OPTIMAL_LOCAL}

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


_INFINITE: Final = 1e19  # of numbers that programs mean as infinite, the least is 1e20


def finite_or_none(value: float | None) -> float | None:
    """The number, or None for a number that a program means as infinite."""
    return None if value is None or abs(value) >= _INFINITE else float(value)


class _Claim(NamedTuple):
    """A row of the table: pattern of whole words or codes, their status, and their meaning."""

    words: re.Pattern[str]
    status: Status
    meaning: str


@cache
def _rows(layout: str) -> list[_Claim]:
    """The rows of a layout, in the order of the table."""
    table = csv.DictReader(Path(__file__).with_suffix(".csv").read_text("utf-8").splitlines())
    return [
        _Claim(re.compile(row["words"], re.IGNORECASE), Status(row["status"]), row["meaning"])
        for row in table
        if row["layout"] == layout
    ]


def claim_of(words: str | int, *layouts: str) -> tuple[Status, str]:
    """The status of words or of a code, and the words, or the meaning of the code.

    The first row of the layouts that fits counts. Words without a row are an ERROR.
    """
    text = str(words)
    is_code = text.lstrip("-")[:1].isdigit()
    for layout in layouts:
        for row in _rows(layout):
            if row.words.fullmatch(text):
                return row.status, row.meaning if is_code else text
    return Status.ERROR, f"status {text}" if is_code else text


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


def status_of_gams(model: int, solver: int) -> tuple[Status, str]:
    """The claim of GAMS's model state (modelStat) and solver state, and both in words."""
    status, words = claim_of(f"{model} {solver}", "gams")
    return status, f"{words}; {GAMS_SOLVER.get(solver, f'solver status {solver}')}"


AMPL: Final = (
    (-1, Status.ERROR),
    (199, Status.FEASIBLE),
    (299, Status.INFEASIBLE),
    (399, Status.UNBOUNDED),
    # from 450 to 469: infeasible or unbounded, which points rule out; older SCIP uses 450 for interrupted
    (469, Status.LIMIT_WITH_POINT),
    (499, Status.LIMIT_WITHOUT_POINT),
)
"""Greatest AMPL solve code of each status (ampl/mp, include/mp/common.h); greater codes are failures."""


def status_of_ampl(code: int | None, message: str, *, with_point: bool) -> Status:
    """The status of an AMPL solve code, which states only `solved`: the message names who can prove more."""
    if code is None:
        return Status.FEASIBLE if with_point else Status.NO_POINT
    if 0 <= code <= 99:
        return claim_of(message, "ampl")[0]
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
