"""A solver in a child process: its deadline, Ctrl-C, and its end, whatever it is."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

from ...models.errors import SolverError
from ...models.processes.deadline import Deadline
from .job import Job

GRACE: Final = 0.5
GRACE_SHARE: Final = 0.05
"""Seconds after its deadline, and a share of its time, in which a child may hand over its best point.

Then it is killed.
"""
PATIENCE: Final = 4.0
"""Seconds that it may take to answer Ctrl-C: half way it is interrupted again, then killed."""
FEASIBLE: Final = 1e-6
"""Violation up to which a start is a point of the problem: the solvers' own tolerance."""
_TICK: Final = 0.1


class ChildExit(NamedTuple):
    """How a child ended: its exit code (negative: a signal), and whether the user interrupted it."""

    code: int
    interrupted: bool

    @property
    def killed(self) -> bool:
        """Whether it was not let to its end."""
        return self.code == -signal.SIGKILL


def solved_by(
    module: str, arguments: Iterable[str | float], job: Job, leave_start: Callable[[], object]
) -> ChildExit:
    """How a module of this folder ended that was run as a program; the job's solution file is there then.

    The program's last argument is the number of seconds that are left when it is started.
    leave_start: makes the start the solution; it is called where the program was stopped before it had one,
    if the start is feasible. Raises SolverError with the program's last words.
    """
    # -P: a folder `crossfield` or a file numpy.py where the user happens to be is not meant.
    program = [sys.executable, "-P", "-m", f"{__package__}.{module}", *map(str, arguments)]
    program.append(repr(job.deadline.left()))
    ended = run_child(program, job.log, job.deadline)
    if job.solution.exists():
        return ended
    stopped = ended.interrupted or ended.killed
    if not (stopped and job.start is not None and job.problem.violation(job.start).worst <= FEASIBLE):
        raise SolverError(_no_answer(job, ended), file=job.model)
    leave_start()
    return ended


def _no_answer(job: Job, ended: ChildExit) -> str:
    """What is said of a solver that left nothing: how it ended, and its last words."""
    if ended.killed and not ended.interrupted:
        return f"{job.solver} left no answer within its time; give it more, or a start"
    last = job.log.read_text("utf-8", "replace").strip().splitlines()[-1:] or ["nothing in its log"]
    how = "interrupted" if ended.interrupted else f"exit code {ended.code}"
    return f"{job.solver} left no answer ({how}): {last[0][:200]}; see {job.log.name} beside it"


def run_child(command: list[str], log: Path, deadline: Deadline) -> ChildExit:
    """How a child ended whose output went to `log`.

    Its standard input is a pipe that closes with this process. A deadline that has passed is as one that
    kills it. Once the deadline has passed, or the user interrupts, the child is interrupted (SIGINT) and may
    leave what it has. A second Ctrl-C kills it at once and goes on as KeyboardInterrupt.
    """
    if deadline.passed():
        return ChildExit(-signal.SIGKILL, interrupted=False)
    with log.open("wb") as output:
        child = subprocess.Popen(
            command, stdout=output, stderr=subprocess.STDOUT, stdin=subprocess.PIPE, start_new_session=True
        )
    with child:
        kill = deadline.later(GRACE + GRACE_SHARE * deadline.left())
        try:
            return _Watch(child, log, deadline, kill).until_it_ends()
        finally:
            child.kill()


@dataclass
class _Watch:
    """A running child: how often it was interrupted, and until when it may answer Ctrl-C."""

    child: subprocess.Popen[bytes]
    log: Path
    deadline: Deadline
    kill: Deadline
    asked: int = 0
    patience: Deadline | None = None

    def until_it_ends(self) -> ChildExit:
        while True:
            try:
                return ChildExit(self.child.wait(_TICK), self.patience is not None)
            except subprocess.TimeoutExpired:
                self._look()
            except KeyboardInterrupt:
                if self.patience is not None:
                    raise
                self.patience = Deadline.after(PATIENCE)

    def _look(self) -> None:
        # Before its first output it does not listen, and has nothing to hand over.
        listens = self.log.stat().st_size > 0
        end = self.kill if listens else self.deadline
        if end.passed() or (self.patience is not None and self.patience.passed()):
            self.child.kill()
        elif listens and self.asked < self._reasons():
            self.child.send_signal(signal.SIGINT)
            self.asked += 1

    def _reasons(self) -> int:
        """How often it should have been interrupted by now; a first signal may come too early."""
        late = self.deadline.passed()
        return late if self.patience is None else late + 1 + self.patience.later(-PATIENCE / 2).passed()
