"""CBC's executable as a reader of LP and MPS, for linear models only: it ignores products.

CBC reports what it read by its own export to MPS, with twelve characters per number and no names, which HiGHS
reads. The names, in the same order, come from its table of all rows and columns.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from . import highs as highs_program
from .protocol import Job, NotReportedError, Outcome, RefusedError, complete, run_program
from .reading import Meaning


def version() -> str:
    """Its version."""
    found = re.search(r"Version: (\S+)", _run("-quit"))
    return found[1] if found else "unknown"


def _run(*arguments: str) -> str:
    return run_program("cbc", *arguments)


def _fresh(name: str) -> Path:
    path = Path(name)
    path.unlink(missing_ok=True)
    return path


def read(path: Path) -> Meaning:
    """The file as CBC reads it."""
    copy, listed = _fresh("cbc.mps"), _fresh("cbc.txt")
    output = _run(str(path), "export", copy.name, "printi", "all", "solution", listed.name)
    if re.search(r"ERROR|too many errors|not valid", output) or not copy.exists():
        raise RefusedError(f"CBC cannot read it: {' '.join(re.findall(r'.*(?:ERROR|errors).*', output)[:1])}")
    model = highs_program.read(copy)
    names = [line.removeprefix("**").split()[1] for line in listed.read_text("utf-8").splitlines()[1:]]
    if len(names) != len(model.rows) + len(model.columns):
        raise NotReportedError("CBC does not export what its presolve removes, and its numbers have no names")
    return replace(model, rows=names[: len(model.rows)], columns=names[len(model.rows) :])


def solve(job: Job) -> Outcome:
    """Solve the file; the solution is the file of CBC's command `solution`, which has eight digits."""
    gaps = ("ratio", f"{job.gap:g}", "allow", "1e-9", "primalT", "1e-9", "integerT", "1e-9")
    limits = (*gaps, "sec", f"{job.seconds:g}", "timem", "elapsed")
    with complete(job.solution) as part:
        output = _run(str(job.model), *limits, "solve", "solution", str(part))
    if not job.solution.exists():
        raise RefusedError(f"CBC wrote no solution: {' '.join(output.split())[-200:]}")
    bound = re.search(r"^Lower bound: +(\S+)$", output, re.MULTILINE)
    nodes = re.search(r"^Enumerated nodes: +(\d+)$", output, re.MULTILINE)
    return Outcome(bound=float(bound[1]) if bound else None, nodes=int(nodes[1]) if nodes else None)
