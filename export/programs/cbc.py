"""CBC's executable as a reader of LP and MPS, for linear models only: it ignores products.

CBC reports what it read by its own export to MPS, with twelve characters per number and no names, which HiGHS
reads. The names, in the same order, come from its table of all rows and columns.
"""

from __future__ import annotations

import re
from pathlib import Path

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
    lines = [line.removeprefix("**").split() for line in listed.read_text("utf-8").splitlines()[1:]]
    highs = highs_program.load_model(copy)
    if highs.getModel().hessian_.dim_:
        raise RefusedError("CBC reads its products, and ignores them when it solves")
    count, size = highs.getNumRow(), highs.getNumCol()
    # CBC does not export ONE of a problem without a constant, which is in no term; its table shows it.
    ones = [line for line in lines if is_one_column(line[1])] if len(lines) == count + size + 1 else []
    names = [line[1] for line in lines if line not in ones]
    if len(names) != count + size:
        raise NotReportedError("CBC does not export what its presolve removes, and its numbers have no names")
    model = highs_program.content_of(highs, names[count:], names[:count])
    model.columns.update({name: (float(value), float(value), False) for _, name, value, *_ in ones})
    return model


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
