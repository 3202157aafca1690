"""GLPK's executable as a reader of LP, MPS and AMPL models with their data. It takes linear models only.

GLPK reports what it read by its own dump of the model (--wglp), with fifteen digits. For an AMPL model the
dump also contains the objective as a row, and indexed columns: alpha[1,2].
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from ..statuses import Status
from ..writing.terms import terms_of_entries
from .model_content import Algebra, Behaviour, Points
from .protocol import Job, Outcome, RefusedError, run_command, run_program, write_in_full

_FLAGS: Final = {"lp": "--lp", "mps": "--freemps", "mod": "--model"}
_OBJECTIVE: Final = "energy"
_ROUNDING: Final = 1e-14
_IN_GAP: Final = "MIP GAP TOLERANCE REACHED"


def version() -> str:
    """Its version."""
    stated = re.search(r"(\d+\.\d+)", run_program("glpsol", "--version"))
    return stated[1] if stated else "unknown"


def _run(path: Path, *arguments: str) -> str:
    kind = path.suffix.removeprefix(".")
    inputs = [_FLAGS[kind], str(path)]
    if kind == "mod":
        inputs += ["--data", str(path.with_suffix(".dat"))]
    done = run_command(["glpsol", *inputs, *arguments])
    if done.returncode:
        lines = [line for line in done.stdout.splitlines() if line.startswith(str(path))]
        raise RefusedError(f"GLPK cannot read it: {' '.join(lines[-1:]).removeprefix(f'{path}:')}")
    return done.stdout


def read(path: Path) -> Algebra:
    """The file as GLPK reads it."""
    _run(path, "--check", "--wglp", "model.glp")
    lines = [line.split() for line in Path("model.glp").read_text("utf-8").splitlines()]
    head = next(line for line in lines if line[0] == "p")
    if head[2] != "min":
        raise RefusedError("it is not minimised")
    names = {kind: [line[3] for line in lines if line[:2] == ["n", kind]] for kind in "ij"}
    entries = [
        (int(i), int(j), float(value)) for key, i, j, value in (line for line in lines if line[0] == "a")
    ]
    if any(not j for _, j, _ in entries):
        raise RefusedError("it has a constant besides ONE")
    costs = np.zeros(len(names["j"]))
    for _, j, value in (entry for entry in entries if not entry[0]):
        costs[j - 1] = value
    coefficients = [(i - 1, j - 1, value) for i, j, value in entries if i]
    mixed = head[1] == "mip"
    lower, upper = _limits(lines, "j", len(costs), 3 if mixed else 2)
    row_lower, row_upper = _limits(lines, "i", len(names["i"]), 2)
    continuous = {int(line[1]) - 1 for line in lines if line[0] == "j" and line[2] == "c"}
    integer = [mixed and place not in continuous for place in range(len(costs))]  # binary by default
    model = Algebra.of(
        names["j"],
        names["i"],
        lower=lower,
        upper=upper,
        integer=integer,
        costs=costs,
        row_lower=row_lower,
        row_upper=row_upper,
        matrix=terms_of_entries(coefficients, indices=2),
    )
    return _without_objective(model, path) if path.suffix == ".mod" else model


def evaluate(path: Path, points: Points) -> Behaviour:
    """The AMPL model as GLPK reads it, without columns in no term, as in AMPL."""
    model = read(path)
    values = points.of(model.columns)
    return Behaviour(
        model.columns,
        model.lower,
        model.upper,
        model.integer,
        model.rows,
        model.row_lower,
        model.row_upper,
        model.objective(values),
        model.activities(values),
        rounding=_ROUNDING,
        may_lack=True,
    )


def _without_objective(model: Algebra, path: Path) -> Algebra:
    """The model with our names, without the objective among the rows."""
    goal = model.rows.index(_OBJECTIVE)
    places = model.matrix_at[model.matrix_at[:, 0] != goal]
    return replace(
        model,
        columns=_our_names(model.columns, path),
        rows=_our_names([name for name in model.rows if name != _OBJECTIVE], path),
        row_lower=np.delete(model.row_lower, goal),
        row_upper=np.delete(model.row_upper, goal),
        matrix_at=np.stack([places[:, 0] - (places[:, 0] > goal), places[:, 1]], axis=1),
        matrix=model.matrix[model.matrix_at[:, 0] != goal],
    )


def _our_names(names: list[str], path: Path) -> list[str]:
    """Names of an AMPL model in our style: p1[1,2,u] is p1_01_02_u, with the printed number of digits.

    Names with one number may have more digits than those with a row and a column.
    """
    printed = re.findall(r'"\w+?((?:_%0\d+d)+)', path.read_text("utf-8"))
    digits = {label.count("%"): int(label[3:-1].split("d")[0]) for label in printed}
    return [_our_name(name, digits) for name in names]


def _our_name(name: str, digits: dict[int, int]) -> str:
    stem, index = name.removesuffix("]").split("[")
    parts = index.split(",")
    width = digits[sum(map(str.isdigit, parts))]
    return "_".join([stem, *(part.zfill(width) if part.isdigit() else part for part in parts)])


def _limits(lines: list[list[str]], kind: str, count: int, at: int) -> tuple[Any, Any]:
    """Bounds of rows or columns: a letter (free, lower, upper, double, s: fixed) at place `at`, and numbers.

    A row without a line is an equation with 0 on its right; a column without a line is at least 0, and in a
    model with integers it is binary.
    """
    default = 0.0 if kind == "i" else 1.0 if at == 3 else np.inf
    lower, upper = np.zeros(count), np.full(count, default)
    for line in (line for line in lines if line[0] == kind and len(line) > at):
        place, letter, numbers = int(line[1]) - 1, line[at], [float(text) for text in line[at + 1 :]]
        lower[place] = numbers[0] if letter in "lds" else -np.inf
        upper[place] = numbers[-1] if letter in "uds" else np.inf
    return lower, upper


def solve(job: Job) -> Outcome:
    """Solve the file; the solution is the file of `-w`, whose columns have no names."""
    limits = ("--tmlim", str(max(1, int(job.seconds))), "--mipgap", f"{job.gap:g}")
    with write_in_full(job.solution) as part:
        output = _run(job.model, *limits, "-w", str(part))
    return Outcome(Status.OPTIMAL_IN_GAP if _IN_GAP in output else None)
