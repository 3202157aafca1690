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
from .model_content import Algebra
from .protocol import Job, Outcome, RefusedError, run_command, run_program, write_in_full

_FLAGS: Final = {"lp": "--lp", "mps": "--freemps", "mod": "--model"}
_OBJECTIVE: Final = "energy"
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
    entries = [(int(i) - 1, int(j) - 1, float(value)) for _, i, j, value in (w for w in lines if w[0] == "a")]
    if any(j < 0 for _, j, _ in entries):
        raise RefusedError("it has a constant besides ONE")
    mixed = head[1] == "mip"
    columns, rows = names["j"], names["i"]
    lower, upper = _limits(lines, "j", len(columns), 3 if mixed else 2)
    row_lower, row_upper = _limits(lines, "i", len(rows), 2)
    continuous = {int(line[1]) - 1 for line in lines if line[0] == "j" and line[2] == "c"}
    if path.suffix == ".mod":
        columns, rows = _our_names(columns, path), _our_names(rows, path)
    model = Algebra.of(
        columns,
        rows,
        ((None if i < 0 else i, j, value) for i, j, value in entries),
        lower=lower,
        upper=upper,
        integer=[mixed and place not in continuous for place in range(len(columns))],  # binary by default
        row_lower=row_lower,
        row_upper=row_upper,
    )
    if model.rows.pop(_OBJECTIVE, None) is not None:  # of a .mod
        terms = {key: value for key, value in model.terms.items() if key[0] != _OBJECTIVE}
        return replace(model, terms=terms)
    return model


def _our_names(names: list[str], path: Path) -> list[str]:
    """Names of an AMPL model in our style: p1[1,2,u] is p1_01_02_u, with the printed number of digits.

    Names with one number may have more digits than those with a row and a column.
    """
    printed = re.findall(r'"\w+?((?:_%0\d+d)+)', path.read_text("utf-8"))
    digits = {label.count("%"): int(label[3:-1].split("d")[0]) for label in printed}
    return [_our_name(name, digits) for name in names]


def _our_name(name: str, digits: dict[int, int]) -> str:
    if name == _OBJECTIVE:
        return name
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
