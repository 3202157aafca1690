"""GAMS: the free gamspy_base compiles a model, CONVERT translates it, its solvers solve it.

CONVERT writes its own .nl file, which CasADi evaluates: an independent path from our GAMS text to numbers.
BARON comes as gamspy_baron, whose files have to be in the folder of gamspy_base: both are linked into a
folder of the child process.
"""

from __future__ import annotations

import os
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Final

from ..licences import package_folder
from ..statuses import status_of_gams
from . import casadi as casadi_program
from .model_content import Behaviour, Points
from .protocol import Job, Outcome, RefusedError, TooLargeError, run_command, write_in_full

_LINEAR_AND_QUADRATIC: Final = ("lp", "mip", "qcp", "miqcp")
_NONLINEAR: Final = ("nlp", "minlp")
_OPTIONS: Final = {
    "convert": "AmplNL out.nl\n",
    "cplex": "eprhs 1e-9\nepopt 1e-9\nepint 0\nbarepcomp 1e-10\n",
    "baron": "AbsConFeasTol 1e-9\nAbsIntFeasTol 1e-9\n",
}
"""Option files of the solvers in GAMS: tight tolerances."""
_GAP: Final = {"cplex": "epgap", "baron": "EpsR"}
"""The option of each solver that replaces the relative gap of the model, which the command line does not."""
_TABLE: Final = "gmscmpNT.txt" if os.name == "nt" else "gmscmpun.txt"


def version() -> str:
    """Its version, and the version of CasADi, which evaluates CONVERT's file."""
    from importlib.metadata import version as installed

    return f"{installed('gamspy_base')} (demo; CONVERT, read by CasADi {casadi_program.version()})"


def _gams_folder(solver: str) -> Path:
    """The folder of GAMS; for BARON a copy, by links where possible, with BARON's files and its entry."""
    base, baron = package_folder("gamspy_base"), package_folder("gamspy_baron")
    assert base is not None
    if solver != "baron" or baron is None:
        return base
    folder = Path("gams_with_baron").resolve()
    if folder.exists():
        return folder
    shutil.copytree(
        base, folder, copy_function=_link_or_copy, ignore=shutil.ignore_patterns(_TABLE, "__pycache__")
    )
    from gamspy_baron import files, verbatim

    for name in files:
        _link_or_copy(baron / name, folder / name)
    head, mark, tail = (base / _TABLE).read_text("utf-8").partition("DEFAULTS")
    (folder / _TABLE).write_text(f"{head}{verbatim}\n\n{mark}{tail}", "utf-8", newline="\n")
    return folder


def _link_or_copy(source: str | Path, target: str | Path) -> None:
    try:
        Path(target).hardlink_to(source)
    except OSError:  # another file system
        shutil.copy2(source, target)


def option_file(solver: str, gap: float | None = None) -> str:
    """Return the content of the option file of a solver in GAMS. gap: None for the gap in the model."""
    stated = "" if gap is None else f"{_GAP[solver]} {gap:g}\n"
    return f"{_OPTIONS[solver]}{stated}"


def _run(path: Path, solver: str, *options: str, gap: float | None = None) -> str:
    """Log and listing of a run. Raises TooLargeError, and RefusedError when GAMS reports an error."""
    kinds = _LINEAR_AND_QUADRATIC if solver == "cplex" else _LINEAR_AND_QUADRATIC + _NONLINEAR
    chosen = [f"{kind}={solver}" for kind in kinds]
    Path(f"{solver}.opt").write_text(option_file(solver, gap), "ascii", newline="\n")
    command = [
        str(_gams_folder(solver) / "gams"),
        str(path),
        "optfile=1",
        "lo=4",
        "lf=run.log",
        "o=run.lst",
        *chosen,
        *options,
    ]
    done = run_command(command)
    log, listing = (_read_text(Path(name)) for name in ("run.log", "run.lst"))
    if re.search(r"exceeds the demo license|demo license limits|Licensing Problem", log + listing):
        raise TooLargeError("beyond the limits of the demo licence")
    if done.returncode:
        errors = [line for line in (log + listing).splitlines() if line.startswith(("****", "***"))]
        raise RefusedError(f"GAMS ends with code {done.returncode}: {' '.join(errors[:2])}")
    return log + listing


def _read_text(path: Path) -> str:
    return path.read_text("utf-8", "replace") if path.exists() else ""


def evaluate(path: Path, points: Points) -> Behaviour:
    """The GAMS model as CONVERT translates it and CasADi reads it, without columns in no term."""
    Path("out.nl").unlink(missing_ok=True)
    _run(path, "convert")
    if not Path("out.nl").exists():
        raise RefusedError("CONVERT wrote no .nl")
    behaviour = casadi_program.evaluate(Path("out.nl").resolve(), points)
    return replace(behaviour, may_lack=True, rounding=1e-14)


def solve(job: Job) -> Outcome:
    """Solve the file with one of GAMS's solvers; the solution is the CSV that our models write."""
    solver = job.solver.removeprefix("gams-")
    threads = (f"threads={job.threads}",) if job.threads else ()
    with write_in_full(job.solution) as part:
        log = _run(job.model, solver, f"reslim={job.seconds:g}", *threads, f"--RESULTS={part}", gap=job.gap)
    used = re.search(r"^ +SOLVER +(\w+) +FROM LINE", log, re.MULTILINE)
    if used and used[1].lower() != solver:
        raise RefusedError(f"it is of a type that GAMS gives to {used[1]}")
    refusal = re.search(r"\*\*\* (Cannot handle function .*)", log)
    if refusal:
        raise RefusedError(refusal[1])
    outcome = outcome_of(log)
    if outcome.status is None or not outcome.status.needs_point:
        job.solution.unlink(missing_ok=True)  # its values are not an answer
    elif not job.solution.exists():
        raise RefusedError(f"GAMS wrote no solution: {outcome.message}")
    return outcome


def outcome_of(log: str) -> Outcome:
    """Return what log and listing of a run state: status, words and dual bound."""
    model, state = (_find_integer(rf"\*\*\*\* {kind} STATUS +(\d+)", log) for kind in ("MODEL", "SOLVER"))
    status, words = status_of_gams(model, state)
    best = re.search(r"^Best possible *[=:] *(\S+)$", log, re.MULTILINE)
    try:
        return Outcome(status, words, float(best[1]) if best else None)
    except ValueError:  # NA, or asterisks
        return Outcome(status, words)


def _find_integer(pattern: str, log: str) -> int:
    match = re.search(pattern, log)
    return int(match[1]) if match else 0
