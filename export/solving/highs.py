"""The one driver of HiGHS: `run` solves a written file in a process of its own.

The rest serves those who need its model in theirs.
"""

from __future__ import annotations

import signal
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import highspy
import numpy as np

from ...models.errors import CrossfieldError, OutputError, SolverError
from .job import LEAST, RunEnd

if TYPE_CHECKING:
    from .job import Job

_BOUND: Final = "dual bound "
"""What the last line of a log begins with where there is one."""
_RAW: Final = 0
"""The style of solution files that HiGHS reads and writes with all digits."""
_TICK: Final = 0.1
"""Seconds between two looks at a running solver."""


def version() -> str:
    """The version of HiGHS."""
    return str(_model().version())


def _model() -> Any:
    return highspy.Highs()  # type: ignore[no-untyped-call]


def loaded(path: Path, *, silent: bool = True, **options: str | float) -> Any:
    """The model of an LP or MPS file in HiGHS, with these options.

    Raises SolverError when HiGHS does not read the file.
    """
    highs = _model()
    set_options(highs, output_flag="false" if silent else "true", **options)
    if highs.readModel(str(path)) == highspy.HighsStatus.kError:
        raise SolverError("HiGHS cannot read it", file=path)
    return highs


def set_options(highs: Any, **options: str | float) -> None:
    """Set options by name; another number of threads than that of an earlier solve counts too."""
    for option, value in options.items():
        highs.setOptionValue(option, value)
    if options.get("threads"):
        highspy.Highs.resetGlobalScheduler(True)  # noqa: FBT003 - else that of the earlier solve is kept


def solved(highs: Any, path: Path) -> Any:
    """The model once its search is over. Raises SolverError, with its file, when that is an error."""
    if highs.run() == highspy.HighsStatus.kError:
        raise SolverError("HiGHS answers with an error (model status Not Set)", file=path)
    return highs


def leave(highs: Any, solution: Path) -> None:
    """Write the solution file. Raises OutputError."""
    beside = solution.with_suffix(".part")
    if highs.writeSolution(str(beside), _RAW) == highspy.HighsStatus.kError:
        beside.unlink(missing_ok=True)
        raise OutputError("HiGHS cannot write it; free some space or choose another folder", file=solution)
    beside.replace(solution)


def dual_bound(highs: Any) -> float | None:
    """The dual bound that a search over integers came to; None where there is none."""
    bound = highs.getInfo().mip_dual_bound if len(highs.getLp().integrality_) else None
    return bound if bound is not None and np.isfinite(bound) else None


def run(job: Job) -> RunEnd:
    """How the solve of the job ended; its solution file is there, and its log if HiGHS was started.

    Raises SolverError.
    """
    from ..bundle.starts import LAYOUTS, Start
    from ..writing.sink import save
    from .child import solved_by

    start = job.solution.with_suffix(".start")
    if job.start is not None:
        save(start, LAYOUTS["highs"](Start(job.problem, job.start)))
    files = map(str, (job.model, job.solution, start))
    arguments = *files, repr(float(job.limits.gap)), str(job.limits.threads)
    try:
        ended = solved_by("highs", arguments, job, lambda: start.replace(job.solution))
    finally:
        start.unlink(missing_ok=True)
    return RunEnd(ended.interrupted, _bound_in(job.log))


def _bound_in(log: Path) -> float | None:
    """The dual bound that a log ends with; None without one, and without a log: no time was left to start."""
    if not log.exists():
        return None
    last = log.read_text("utf-8", "replace").splitlines()[-1:]
    return float(last[0].removeprefix(_BOUND)) if last and last[0].startswith(_BOUND) else None


def main(arguments: list[str]) -> int:
    """0 when the solution file was written: the program that `run` starts, so that a solve can be ended.

    HiGHS looks at the clock only now and then: after some seconds without a look the process is killed. Its
    output is the log: the first line says that an interrupt (SIGINT) will be heard, and the last one the dual
    bound. It ends with its parent: when its standard input closes.
    """
    from ...models.processes.deadline import Deadline
    from ...models.processes.side_by_side import leave_with_parent

    deadline = Deadline.since_start(float(arguments.pop()))
    leave_with_parent()
    stop = threading.Event()
    signal.signal(signal.SIGINT, lambda *_: stop.set())
    (model, solution, start), (gap, threads) = map(Path, arguments[:3]), arguments[3:]
    try:
        highs = loaded(model, silent=False, mip_rel_gap=float(gap), threads=int(threads))
        if start.exists():
            highs.readSolution(str(start), _RAW)
        # It ends by itself, if it looks at the clock in time, before it is interrupted.
        set_options(highs, time_limit=max(deadline.left() - 2 * _TICK, LEAST))
        _until_it_ends(highs, stop)
        leave(highs, solution)
    except CrossfieldError as error:
        print(error)  # noqa: T201 - what is printed is the log
        return 1
    bound = dual_bound(highs)
    if bound is not None:
        print(f"{_BOUND}{bound!r}", flush=True)  # noqa: T201
    return 0


def _until_it_ends(highs: Any, stop: threading.Event) -> None:
    """Solve; an interrupt ends the search and keeps the incumbent."""
    highs.HandleUserInterrupt = True
    highs.startSolve()
    while not (stop.is_set() or highs.wait(_TICK)[0]):
        pass
    if stop.is_set():
        highs.cancelSolve()
    while not highs.wait(_TICK)[0]:
        pass


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
