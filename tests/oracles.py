"""Independent readers of LP, MPS and .nl files in this process, each giving what it read to be compared with a Problem."""

from __future__ import annotations

import importlib.util
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from crossfield.export import consumer_asl, consumer_casadi, consumer_highs, consumer_scip
from crossfield.export.comparison import of_problem
from crossfield.export.consumers import CONSUMERS
from crossfield.export.meaning import Meaning as Model
from crossfield.models.grid import Floats

__all__ = ["Model", "by_asl", "by_casadi", "by_gurobi", "by_highs", "by_scip", "of_problem", "require", "scip_columns"]  # fmt: skip

by_highs = consumer_highs.read
by_scip = consumer_scip.read
by_casadi = consumer_casadi.load
scip_columns = consumer_scip.columns


def by_gurobi(path: Path) -> Model:
    """The file as Gurobi reads it; needs gurobipy."""
    from crossfield.export import consumer_gurobi

    return consumer_gurobi.read(path)


OTHERS = {
    "baron": (importlib.util.find_spec("gamspy_baron"), "BARON is not installed: pip install gamspy_baron"),
    "pyqplib": (importlib.util.find_spec("pyqplib"), "pyqplib is not installed: pip install pyqplib"),
    "cbc": (shutil.which("cbc"), "CBC is not installed: apt-get install coinor-cbc"),
}
"""Programs that are no consumers of `verify`: a sign that they are here, and what to do where they are not."""


def require(program: str) -> None:
    """Skip the test when a consumer or another program is absent; all such skips have this one place, and so one line each."""
    if program in OTHERS:
        present, words = OTHERS[program]
    else:
        entry = CONSUMERS[program]
        present, words = entry.present, f"{entry.title} is not installed: {entry.install}"
    if not present:
        pytest.skip(words)


def by_asl(path: Path) -> tuple[dict[str, Any], float, Floats, Floats, Floats]:
    """What the AMPL Solver Library says of an .nl file at its starting point.

    Statistics, objective, gradient, rows, Jacobian (rows, columns).
    """
    said = consumer_asl.at_start(path)
    statistics, values = said["problem statistics"], said["initial evaluations"]
    columns, rows = statistics["total no. of variables"], statistics["total no. of constraints"]
    goal = values["objective function"]["0"]
    gradient, jacobian = np.zeros(columns), np.zeros((rows, columns))
    for key, value in goal["gradient"].items():
        gradient[int(key)] = value
    for key, value in values.get("constraints' jacobian", {}).items():
        jacobian[tuple(map(int, key.split("_")))] = value
    activities = np.array([values["constraints"][str(row)] for row in range(rows)])
    return statistics, goal["value"], gradient, activities, jacobian
