"""A solver in a child process: its deadline, Ctrl-C, and its end, whatever it is."""

from __future__ import annotations

import signal
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

from ...models.processes.deadline import Deadline

GRACE: Final = 0.5
GRACE_SHARE: Final = 0.05
"""Seconds after its deadline, and a share of its time, in which a child may hand over its best point.

Then it is killed.
"""
PATIENCE: Final = 4.0
"""Seconds that it may take to answer Ctrl-C: half way it is interrupted again, then killed."""
_TICK: Final = 0.1


class ChildExit(NamedTuple):
    """How a child ended: its exit code (negative: a signal), and whether the user interrupted it."""

    code: int
    interrupted: bool

    @property
    def killed(self) -> bool:
        """Whether it was not let to its end."""
        return self.code == -signal.SIGKILL


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
