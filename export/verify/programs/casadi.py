"""CasADi's reader of .nl as a consumer, and the solvers that come with CasADi: Ipopt and Bonmin."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

with warnings.catch_warnings(action="ignore"):  # its import warns on newer Pythons
    import casadi

from ....models.instance.grid import Floats
from ...solutions.readers.text import Status
from ...solving import casadi_driver
from .reading import Evaluation, Outcome, Points
from .registry import file_names


def version() -> str:
    """Its version."""
    return str(casadi.CasadiMeta.version())


@dataclass(frozen=True, eq=False)
class NlModel:
    """A .nl file as CasADi reads it, in its order: bounds, integrality, start, and objective and rows at a point."""

    lower: Floats
    upper: Floats
    row_lower: Floats
    row_upper: Floats
    discrete: list[bool]
    start: Floats
    function: Any

    def evaluate(self, point: Floats) -> tuple[float, Floats]:
        """Objective and rows at a point."""
        objective, rows = self.function(point)
        return float(objective), np.array(rows).ravel()


def load(path: Path) -> NlModel:
    """The .nl file as CasADi reads it."""
    read = casadi.NlpBuilder()
    read.import_nl(str(path))
    function = casadi.Function("model", [casadi.vertcat(*read.x)], [read.f, casadi.vertcat(*read.g)])
    ends = (read.x_lb, read.x_ub, read.g_lb, read.g_ub)
    lower, upper, row_lower, row_upper = (np.array(casadi.DM(values), dtype=float).ravel() for values in ends)
    start = np.array(casadi.DM(read.x_init)).ravel()
    return NlModel(lower, upper, row_lower, row_upper, list(read.discrete), start, function)


def evaluate(path: Path, points: Points, renamed: Callable[[str], str] = str) -> Evaluation:
    """The .nl file as CasADi reads it; names come from .col and .row, through `renamed`."""
    model = load(path)
    columns, rows = ([renamed(name) for name in names] for names in file_names(path))
    values = [model.evaluate(point) for point in points.of(columns)]
    return Evaluation(
        columns,
        model.lower,
        model.upper,
        np.array(model.discrete, dtype=bool),
        rows,
        model.row_lower,
        model.row_upper,
        np.array([objective for objective, _ in values]),
        np.array([row for _, row in values]).reshape(len(values), len(rows)),
    )


def solve(path: Path, seconds: float, solver: str) -> Outcome:
    """The answer of Ipopt or Bonmin within the time."""
    model = casadi_driver.read_model(path)
    ending = casadi_driver.solve(solver, model, seconds, 0.0)
    columns, _ = file_names(path)
    if not len(ending.point):
        status = Status.INFEASIBLE if 200 <= ending.code < 300 else Status.LIMIT_WITHOUT_POINT
        return Outcome(status, ending.words, columns, np.zeros(0))
    status = Status.OPTIMAL_LOCAL if ending.code < 200 else Status.LIMIT_WITH_POINT
    goal: Any = casadi.Function("goal", [model.problem["x"]], [model.problem["f"]])
    return Outcome(status, ending.words, columns, ending.point, float(goal(ending.point)))
