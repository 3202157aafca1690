"""A solver in a child process: its limit, Ctrl-C, and its end, whatever it is."""

from __future__ import annotations

import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

GRACE: Final = 2.0
"""Seconds that a solver may take beyond its limit before it is interrupted."""
PATIENCE: Final = 4.0
"""Seconds that it may take to answer an interrupt; then it is interrupted again, and at last killed."""
_TICK: Final = 0.1
_MOST_SIGNALS: Final = 2


class Ending(NamedTuple):
    """How a child ended: its exit code (negative: a signal), and whether the user interrupted it."""

    code: int
    interrupted: bool


def run_child(command: list[str], log: Path, seconds: float) -> Ending:
    """How a child ended whose output went to `log`.

    The limit counts from its first output, so that reading a large file is not part of it. When the limit has passed, or
    the user interrupts, the child is interrupted (SIGINT) and may leave what it has. A second Ctrl-C kills it at once
    and goes on as KeyboardInterrupt.
    """
    with log.open("wb") as output:
        child = subprocess.Popen(
            command, stdout=output, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, start_new_session=True
        )
    try:
        return _Watch(child, log, seconds).until_it_ends()
    finally:
        if child.poll() is None:
            child.kill()
            child.wait()


@dataclass
class _Watch:
    """A running child: since when it has been solving, and when and how often it was asked to stop."""

    child: subprocess.Popen[bytes]
    log: Path
    seconds: float
    interrupted: bool = False
    started: float | None = None
    asked: int = 0
    asked_at: float = 0.0

    def until_it_ends(self) -> Ending:
        while True:
            try:
                return Ending(self.child.wait(_TICK), self.interrupted)
            except subprocess.TimeoutExpired:
                self._look(time.monotonic())
            except KeyboardInterrupt:
                if self.interrupted:
                    raise
                self.interrupted = True

    def _look(self, now: float) -> None:
        if self.started is None and self.log.stat().st_size:
            self.started = now
        if self.started is not None and (self.interrupted or now > self.started + self.seconds + GRACE):
            self._ask(now)

    def _ask(self, now: float) -> None:
        """Interrupt the child, again when it does not answer: the first signal may have come before it listened."""
        if self.asked and now < self.asked_at + PATIENCE:
            return
        self.child.send_signal(signal.SIGINT if self.asked < _MOST_SIGNALS else signal.SIGKILL)
        self.asked, self.asked_at = self.asked + 1, now
