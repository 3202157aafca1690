"""CasADi as a reader of .nl, and the solvers that come with CasADi: Ipopt and Bonmin."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from ...solutions.readers.text import RawSolution, Status
from ...solving import casadi_driver
from ...solving.nl_model import ca, read_nl
from .protocol import file_names
from .reading import Evaluation, Points, told


def version() -> str:
    """Its version."""
    return str(ca.CasadiMeta.version())


def evaluate(path: Path, points: Points, renamed: Callable[[str], str] = str) -> Evaluation:
    """The .nl file as CasADi reads it; names come from .col and .row, through `renamed`."""
    model = read_nl(path)
    columns, rows = ([renamed(name) for name in names] for names in file_names(path))
    values = [model.evaluate(point) for point in points.of(columns)]
    return Evaluation(
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


def solve(path: Path, seconds: float, solver: str, gap: float = 0.0) -> RawSolution:
    """The answer of Ipopt or Bonmin within the time."""
    model = read_nl(path)
    answer = casadi_driver.solve(solver, model, seconds, gap)
    if not len(answer.point):
        status = Status.INFEASIBLE if 200 <= answer.code < 300 else Status.LIMIT_WITHOUT_POINT
        return told(status, answer.words)
    status = Status.OPTIMAL_LOCAL if answer.code < 200 else Status.LIMIT_WITH_POINT
    columns, _ = file_names(path)
    return told(status, answer.words, columns, answer.point, objective=model.evaluate(answer.point)[0])
