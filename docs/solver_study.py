"""Measure how far solvers get with the formulations; the rows go to docs/studying/data/solvers.csv.

    python docs/solver_study.py [--minutes N] [--jobs N]
    python docs/solver_study.py --quick --data FOLDER
    python docs/solver_study.py --plan

It does the runs of the plan (studying/solvers/plan.py) that have no row yet, in their order, and continues
after an interruption. Each run is a process on one thread, pinned to a core, with a limit of time and memory.
A run is discarded, and repeated later, if its core spends more than a twentieth of the time on other work:
use a quiet machine. --quick tries every kind of run, beside any work. --minutes ends the program after about
that time. --plan counts the runs. Then `python docs/study.py --page` writes docs/evidence.md. The
certificates of `prove` are kept in docs/studying/data/certificates, outside of the repository.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import threading
import time
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

# Every run is on one thread: libraries read this when they are loaded, here and in all children.
os.environ |= dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1")

from crossfield.export.library.documents.lock import library_lock
from crossfield.export.solvers_table import SOLVERS
from studying.rows import Row
from studying.solvers.measure import SLACK, busy_seconds, measure_run
from studying.solvers.plan import DATA, FULL, PROVE, QUICK, Plan, Run, table
from studying.solvers.statistics import DISCARDED, FAILED, best_pairs

_LONGEST: Final = 200  # characters of a note
_CAPTURED: Final[dict[str, Any]] = {"capture_output": True, "text": True}
_BUSY: Final = 0.2  # seconds of work in a second before a run
_GRACE: Final = 45.0
"""Seconds for runs under way at the end: the limit of a run does not count the start of its process."""


class Study:
    """The runs that are left, for threads that each have a core."""

    def __init__(self, plan: Plan, data: Path, end: float) -> None:
        """Start without rows. end: time of the monotonic clock."""
        self.plan, self.data, self.end = plan, data, end
        self.discards, self._lock = Counter[Run](), threading.Lock()
        self.results = table(data)
        self._taken: set[Run] = set()

    def left(self) -> list[Run]:
        """The runs without a row whose solver is installed, those discarded least often first."""
        done, best = self.results.done, best_pairs(self.results.rows, self.plan.limit)
        runs = [run for run in self.plan.first() if run.key not in done and _is_installed(run)]
        runs = runs or [run for run in self.plan.last(best) if run.key not in done]
        return sorted(runs, key=lambda run: self.discards[run])

    def work(self, core: int) -> None:
        """Do runs on a core until the end."""
        while self._is_quiet(core) and (run := self._next()) is not None:
            row = self._measured(run, core)
            with self._lock:
                self._taken.remove(run)
                if row["status"] == DISCARDED:
                    self.discards[run] += 1
                else:
                    self.results.append(run, row)
            times = f"{row.get('cpu') or 0:.1f} s, beside {row.get('beside') or 0:.1f} s"
            print(f"{run}: {row['status']}, {times}", file=sys.stderr, flush=True)

    def _is_quiet(self, core: int) -> bool:
        """Wait until a core is idle for most of a second; False at the end of the study."""
        while time.monotonic() < self.end:
            before = busy_seconds(core)
            time.sleep(1 if self.plan is not QUICK else 0)
            if busy_seconds(core) - before < _BUSY:
                return True
        return False

    def _next(self) -> Run | None:
        with self._lock:
            run = next((run for run in self.left() if run not in self._taken), None)
            if run is not None:
                self._taken.add(run)
            return run

    def _measured(self, run: Run, core: int) -> Row:
        command = [sys.executable, __file__, "--data", str(self.data)]
        command += ["--quick"] * (self.plan is QUICK) + ["--one", json.dumps(asdict(run))]
        # A run that has begun may reach its limit, or none of the longest would ever end in a short session.
        left = max(self.end - time.monotonic(), run.limit + _GRACE) + _GRACE
        done = subprocess.run([*command, str(core), f"{left:.1f}"], check=False, **_CAPTURED)
        if not done.returncode:
            return dict(json.loads(done.stdout.splitlines()[-1]))
        note = (done.stderr.splitlines() or [f"ended with code {done.returncode}"])[-1]
        return {"status": FAILED, "note": note[:_LONGEST]}


def _is_installed(run: Run) -> bool:
    return run.solver == PROVE or not SOLVERS[run.solver].missing


def certificates(data: Path) -> Path:
    """The folder of certificates for a file of rows."""
    return data.parent / "certificates"


def row_of_run(data: Path, words: list[str], *, quick: bool) -> Row:
    """The row of a run, in the process for it."""
    run, core, left = words
    slack = float("inf") if quick else SLACK
    return measure_run(Run(**json.loads(run)), int(core), float(left), certificates(data), slack)


def main() -> None:
    """Do the runs that are left."""
    parser = argparse.ArgumentParser(description="Measure how far solvers get with the formulations.")
    parser.add_argument("--quick", action="store_true", help="every kind of run on a tiny instance")
    parser.add_argument("--plan", action="store_true", help="only print the number of runs that are left")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="end after that time")
    parser.add_argument("--jobs", type=int, choices=(1, 2), default=2, help="runs side by side")
    parser.add_argument("--data", type=Path, default=DATA.parent, help="folder of the rows")
    parser.add_argument("--one", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    data = options.data / DATA.name if options.data.suffix != ".csv" else options.data
    if options.one:
        print(json.dumps(row_of_run(data, options.one, quick=options.quick)))
        return
    if options.quick and data == DATA:
        parser.error("--quick is another plan; give --data FOLDER for its rows")
    study = Study(QUICK if options.quick else FULL, data, time.monotonic() + 60 * options.minutes)
    if options.plan:
        print(f"{study.plan.size} runs, {len(study.results.rows)} done")
        return
    certificates(data).mkdir(parents=True, exist_ok=True)
    with library_lock(data.parent, "a study", lambda line: print(line, file=sys.stderr)):
        study.results = table(data)
        cores = sorted(os.sched_getaffinity(0))[-options.jobs :]
        threads = [threading.Thread(target=study.work, args=(core,)) for core in cores]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()


if __name__ == "__main__":
    main()
