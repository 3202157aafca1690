"""Programs that tests need and that may be absent, and the report of the AMPL Solver Library on a file."""

from __future__ import annotations

import importlib.util
import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
from crossfield.export.solvers_table import PROGRAMS
from crossfield.models.instance.domain import Floats


def browser() -> str | None:
    """The path of a Chromium."""
    return next(filter(None, map(shutil.which, ("chromium", "google-chrome", "chrome"))), None)


OTHERS = {
    "asl": (shutil.which("gjh_asl_json"), "AMPL Solver Library", "apt install gjh-asl-json"),
    "baron": (importlib.util.find_spec("gamspy_baron"), "BARON", "pip install gamspy_baron"),
    "pyqplib": (importlib.util.find_spec("pyqplib"), "pyqplib", "pip install pyqplib"),
    "linopy": (importlib.util.find_spec("linopy"), "linopy", "pip install linopy"),
    "pyomo": (importlib.util.find_spec("pyomo"), "Pyomo", "pip install pyomo"),
    "trimesh": (importlib.util.find_spec("trimesh"), "trimesh", "pip install trimesh"),
    "pyvista": (importlib.util.find_spec("pyvista"), "pyvista", "pip install pyvista"),
    "chromium": (
        importlib.util.find_spec("selenium") and shutil.which("chromedriver") and browser(),
        "Chromium with its driver, or selenium,",
        "apt install chromium chromium-driver; pip install selenium",
    ),
    "unshare": (
        shutil.which("unshare") and not subprocess.run(["unshare", "-Upfr", "true"], check=False).returncode,
        "unshare, with the right to make namespaces,",
        "apt install util-linux; sysctl kernel.unprivileged_userns_clone=1",
    ),
    "gzip": (shutil.which("gzip"), "gzip", "apt install gzip"),
    "distributed": (importlib.util.find_spec("distributed"), "distributed", "pip install '.[cluster]'"),
}
"""Programs that `verify` does not know: a sign that they are here, their names,
and what to do where they are not.
"""


def absence(program: str) -> str:
    """Why tests that need one of these programs cannot run, in a line; nothing where it is here."""
    if program in PROGRAMS:
        return PROGRAMS[program].missing
    present, title, remedy = OTHERS[program]
    return "" if present else f"{title} is not installed: {remedy}"


def by_asl(path: Path) -> tuple[dict[str, Any], float, Floats, Floats, Floats]:
    """The AMPL Solver Library's report on an .nl file at its starting point.

    Statistics, objective, gradient, rows, Jacobian (rows, columns).
    """
    subprocess.run(["gjh_asl_json", path.stem], cwd=path.parent, check=True, capture_output=True)
    answer = json.loads(path.with_suffix(".json").read_text("utf-8"))
    statistics, values = answer["problem statistics"], answer["initial evaluations"]
    columns, rows = statistics["total no. of variables"], statistics["total no. of constraints"]
    goal = values["objective function"]["0"]
    gradient, jacobian = np.zeros(columns), np.zeros((rows, columns))
    for key, value in goal["gradient"].items():
        gradient[int(key)] = value
    for key, value in values.get("constraints' jacobian", {}).items():
        jacobian[tuple(map(int, key.split("_")))] = value
    activities = np.array([values["constraints"][str(row)] for row in range(rows)])
    return statistics, goal["value"], gradient, activities, jacobian
