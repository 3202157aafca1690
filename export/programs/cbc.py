"""CBC's executable as a reader of LP and MPS, for linear models only: it ignores products.

CBC reports what it read by its own export to MPS, with twelve characters per number and no names, which HiGHS
reads. The names, in the same order, come from its table of all rows and columns.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..writing.stamps import is_one_column
from . import highs as highs_program
from .model_content import Algebra
from .protocol import Job, NotReportedError, Outcome, RefusedError, run_program, write_in_full


def version() -> str:
    """Its version."""
    stated = re.search(r"Version: (\S+)", _run("-quit"))
    return stated[1] if stated else "unknown"


def _run(*arguments: str) -> str:
    return run_program("cbc", *arguments)


def _new_path(name: str) -> Path:
    path = Path(name)
    path.unlink(missing_ok=True)
    return path


def read(path: Path) -> Algebra:
    """The file as CBC reads it."""
    copy, listed = _new_path("cbc.mps"), _new_path("cbc.txt")
    output = _run(str(path), "export", copy.name, "printi", "all", "solution", listed.name)
    if re.search(r"ERROR|too many errors|not valid", output) or not copy.exists():
        raise RefusedError(f"CBC cannot read it: {' '.join(re.findall(r'.*(?:ERROR|errors).*', output)[:1])}")
    model = highs_program.read(copy)
    if len(model.quadratic):
        raise RefusedError("CBC reads its products, and ignores them when it solves")
    lines = [line.removeprefix("**").split() for line in listed.read_text("utf-8").splitlines()[1:]]
    names = [words[1] for words in lines]
    one = next((at for at, name in enumerate(names) if is_one_column(name)), None)
    if one is not None and len(names) == len(model.rows) + len(model.columns) + 1:
        model = _insert_fixed_column(model, one - len(model.rows), float(lines[one][2]))
    if len(names) != len(model.rows) + len(model.columns):
        raise NotReportedError("CBC does not export what its presolve removes, and its numbers have no names")
    return replace(model, rows=names[: len(model.rows)], columns=names[len(model.rows) :])


def _insert_fixed_column(model: Algebra, place: int, value: float) -> Algebra:
    """The model with a column that is fixed to a value, and in no term.

    CBC does not export such a column, ONE of a problem without a constant; its table of values shows it.
    """
    at = model.matrix_at.copy()
    at[:, 1] += at[:, 1] >= place
    fixed = {"lower": value, "upper": value, "costs": 0.0, "integer": False}
    arrays: dict[str, Any] = {
        name: np.insert(getattr(model, name), place, number) for name, number in fixed.items()
    }
    return replace(model, columns=[*model.columns, ""], matrix_at=at, **arrays)


def solve(job: Job) -> Outcome:
    """Solve the file; the solution is the file of CBC's command `solution`, which has eight digits."""
    gaps = ("ratio", f"{job.gap:g}", "allow", "1e-9", "primalT", "1e-9", "integerT", "1e-9")
    limits = (*gaps, "sec", f"{job.seconds:g}", "timem", "elapsed")
    with write_in_full(job.solution) as part:
        output = _run(str(job.model), *limits, "solve", "solution", str(part))
    if not job.solution.exists():
        raise RefusedError(f"CBC wrote no solution: {' '.join(output.split())[-200:]}")
    bound = re.search(r"^Lower bound: +(\S+)$", output, re.MULTILINE)
    nodes = re.search(r"^Enumerated nodes: +(\d+)$", output, re.MULTILINE)
    return Outcome(bound=float(bound[1]) if bound else None, nodes=int(nodes[1]) if nodes else None)
