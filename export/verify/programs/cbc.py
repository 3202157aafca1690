"""CBC's executable as a reader of LP and MPS. It knows nothing of products: hand it linear models only.

What it read is told by its own export to MPS, twelve characters a number and no names, which HiGHS reads; the
names, in the same order, by its table of all rows and columns.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from ....models.errors import SolutionError
from ...solutions.readers.registry import read_raw
from ...solutions.readers.text import RawSolution, Status
from . import highs as highs_program
from .protocol import NotTold, Refused, started
from .reading import Meaning, told


def version() -> str:
    """Its version."""
    found = re.search(r"Version: (\S+)", _run("-quit"))
    return found[1] if found else "unknown"


def _run(*arguments: str) -> str:
    done = started("cbc", *arguments)
    return done.stdout + done.stderr


def _fresh(name: str) -> Path:
    path = Path(name)
    path.unlink(missing_ok=True)
    return path


def read(path: Path) -> Meaning:
    """The file as CBC reads it."""
    copy, listed = _fresh("cbc.mps"), _fresh("cbc.txt")
    said = _run(str(path), "export", copy.name, "printi", "all", "solution", listed.name)
    if re.search(r"ERROR|too many errors|not valid", said) or not copy.exists():
        raise Refused(f"CBC cannot read it: {' '.join(re.findall(r'.*(?:ERROR|errors).*', said)[:1])}")
    model = highs_program.read(copy)
    names = [line.removeprefix("**").split()[1] for line in listed.read_text("utf-8").splitlines()[1:]]
    if len(names) != len(model.rows) + len(model.columns):
        raise NotTold("CBC leaves out of its export what its presolve removes, and its numbers have no names")
    return replace(model, rows=names[: len(model.rows)], columns=names[len(model.rows) :])


def solve(path: Path, seconds: float, _solver: str, gap: float = 0.0) -> RawSolution:
    """Its answer within the time; its solution file has eight digits."""
    answer = _fresh("cbc.sol")
    gaps = ("ratio", f"{gap:g}", "allow", "1e-9", "primalT", "1e-9", "integerT", "1e-9")
    limits = (*gaps, "sec", f"{seconds:g}", "timem", "elapsed")
    said = _run(str(path), *limits, "solve", "solution", answer.name)
    try:
        raw = read_raw(answer)
    except SolutionError as error:
        raise Refused(f"CBC leaves no answer: {error}") from error
    bound = re.search(r"^Lower bound: +(\S+)$", said, re.MULTILINE)
    if raw.status == Status.INFEASIBLE:
        return told(raw.status, raw.message)
    return replace(raw, bound=float(bound[1]) if bound else None)
