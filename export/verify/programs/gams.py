"""GAMS: the free gamspy_base compiles a model, CONVERT translates it, its solvers solve it.

CONVERT writes an .nl file of its own, which CasADi evaluates: an independent way from our GAMS text to
numbers. BARON comes as gamspy_baron, whose files have to lie among those of gamspy_base: both are linked into
a folder of the child process.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from ....models.errors import SolutionError
from ...solutions.readers.registry import read_raw
from ...solutions.readers.text import RawSolution, Status
from . import casadi as casadi_program
from .protocol import Refused, TooLarge
from .reading import Evaluation, Points, told

_LINEAR_AND_QUADRATIC: Final = ("lp", "mip", "qcp", "miqcp")
_NONLINEAR: Final = ("nlp", "minlp")
_OPTIONS: Final = {
    "convert": "AmplNL out.nl\n",
    "cplex": "eprhs 1e-9\nepopt 1e-9\nepint 0\nbarepcomp 1e-10\n",
    "baron": "AbsConFeasTol 1e-9\nAbsIntFeasTol 1e-9\n",
}
"""Option files of the solvers in GAMS: tight tolerances."""
_TABLE: Final = "gmscmpNT.txt" if os.name == "nt" else "gmscmpun.txt"


def _package(name: str) -> Path | None:
    found = find_spec(name)
    return None if found is None or found.origin is None else Path(found.origin).parent


def version() -> str:
    """Its version, and that of CasADi, which evaluates what CONVERT writes."""
    from importlib.metadata import version as installed

    return f"{installed('gamspy_base')} (demo; CONVERT, read by CasADi {casadi_program.version()})"


def _system(solver: str) -> Path:
    """The folder of GAMS; for BARON a copy, by links where that works, with BARON's files and its entry."""
    base, baron = _package("gamspy_base"), _package("gamspy_baron")
    assert base is not None
    if solver != "baron" or baron is None:
        return base
    folder = Path("gams_with_baron").resolve()
    if folder.exists():
        return folder
    shutil.copytree(base, folder, copy_function=_link, ignore=shutil.ignore_patterns(_TABLE, "__pycache__"))
    from gamspy_baron import files, verbatim

    for name in files:
        _link(baron / name, folder / name)
    head, mark, tail = (base / _TABLE).read_text("utf-8").partition("DEFAULTS")
    (folder / _TABLE).write_text(f"{head}{verbatim}\n\n{mark}{tail}", "utf-8", newline="\n")
    return folder


def _link(source: str | Path, target: str | Path) -> None:
    try:
        Path(target).hardlink_to(source)
    except OSError:  # another file system
        shutil.copy2(source, target)


def _run(path: Path, solver: str, *options: str) -> str:
    """The listing of a run. Raises TooLarge or Refused when GAMS does not come to its normal end."""
    kinds = _LINEAR_AND_QUADRATIC if solver == "cplex" else _LINEAR_AND_QUADRATIC + _NONLINEAR
    chosen = [f"{kind}={solver}" for kind in kinds]
    for name, lines in _OPTIONS.items():
        Path(f"{name}.opt").write_text(lines, "ascii", newline="\n")
    command = [
        str(_system(solver) / "gams"),
        str(path),
        "optfile=1",
        "lo=2",
        "lf=run.log",
        "o=run.lst",
        *chosen,
        *options,
    ]
    done = subprocess.run(command, check=False, capture_output=True)
    log, listing = (_text(Path(name)) for name in ("run.log", "run.lst"))
    if re.search(r"exceeds the demo license|demo license limits|Licensing Problem", log + listing):
        raise TooLarge
    if done.returncode:
        errors = [line for line in (log + listing).splitlines() if line.startswith(("****", "***"))]
        raise Refused(f"GAMS ends with code {done.returncode}: {' '.join(errors[:2])}")
    return log + listing


def _text(path: Path) -> str:
    return path.read_text("utf-8", "replace") if path.exists() else ""


def our_name(name: str) -> str:
    """The name of an indexed symbol as ours: `s(00,01,u)` is `s_00_01_u`."""
    return re.sub(r"[(,]", "_", name).rstrip(")")


def evaluate(path: Path, points: Points) -> Evaluation:
    """The GAMS model as CONVERT translates it and CasADi reads it; columns in no term are not there."""
    Path("out.nl").unlink(missing_ok=True)
    _run(path, "convert")
    if not Path("out.nl").exists():
        raise Refused("CONVERT wrote no .nl")
    found = casadi_program.evaluate(Path("out.nl").resolve(), points, our_name)
    return replace(found, may_lack=True, rounding=1e-14)


_MODEL_STATUS: Final = {
    1: Status.OPTIMAL_GLOBAL,
    2: Status.OPTIMAL_LOCAL,
    4: Status.INFEASIBLE,
    5: Status.INFEASIBLE,
    7: Status.LIMIT_WITH_POINT,
    8: Status.LIMIT_WITH_POINT,
    10: Status.INFEASIBLE,
}
_NORMAL: Final = 1


def solve(path: Path, seconds: float, solver: str, _gap: float = 0.0) -> RawSolution:
    """The answer of one of GAMS's solvers within the time, from the CSV that our models write.

    The gap stands in the model itself.
    """
    answer = Path("answer.csv").resolve()
    answer.unlink(missing_ok=True)
    said = _run(path, solver.removeprefix("gams-"), f"reslim={seconds:g}", "threads=1", f"--RESULTS={answer}")
    model, state = (
        int(found[1]) if (found := re.search(rf"\*\*\*\* {kind} STATUS +(\d+)", said)) else 0
        for kind in ("MODEL", "SOLVER")
    )
    words = f"model status {model}, solver status {state}"
    used = re.search(r"^ +SOLVER +(\w+) +FROM LINE", said, re.MULTILINE)
    if used and used[1].lower() != solver.removeprefix("gams-"):
        raise Refused(f"it is of a type that GAMS gives to {used[1]}")
    refusal = re.search(r"\*\*\* (Cannot handle function .*)", said)
    if refusal:
        raise Refused(refusal[1])
    status = _MODEL_STATUS.get(model, Status.ERROR)
    if model == 8 and state == _NORMAL:
        status = Status.OPTIMAL_GLOBAL
    bound = re.search(r"^Best possible *[=:] *(\S+)$", said, re.MULTILINE)
    try:
        raw = read_raw(answer)
    except SolutionError as error:
        raise Refused(f"no answer: {words}; {error}") from error
    if status in {Status.ERROR, Status.INFEASIBLE}:
        return told(status, words)
    return replace(raw, status=status, message=words, bound=float(bound[1]) if bound else None)
