"""Progress as a line every few seconds, for standard error that is not a terminal."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Final

from ...models.processes.deadline import Clock
from ...models.processes.progress import Progress

EVERY: Final = 5.0
"""Seconds between two lines, and before the first one: shorter work prints no line."""


class ProgressLines:
    """The current step of some work, written at most once every few seconds.

    Each line begins with the seconds since the object was created. write: function that prints a line.
    """

    def __init__(self, write: Callable[[str], object], clock: Clock = time.monotonic) -> None:
        self.text = "starting"
        self._write, self._clock = write, clock
        self._begin = self._last = clock()

    def update(self, text: str) -> None:
        """Set the current step; the next line that is due shows it."""
        self.text = text

    def seconds_left(self) -> float:
        """Seconds until the next line is due; 0.0 when it is due."""
        return max(0.0, self._last + EVERY - self._clock())

    def write_if_due(self) -> None:
        """Write the current step if a line is due."""
        if self.seconds_left() == 0.0:
            self._last = self._clock()
            self._write(f"[{self._last - self._begin:.0f} s] {self.text}")


@contextmanager
def progress_lines(write: Callable[[str], object]) -> Iterator[Progress]:
    """Function that sets the current step, which a thread writes every few seconds."""
    lines, ended = ProgressLines(write), threading.Event()

    def watch() -> None:
        with suppress(OSError, ValueError):  # the stream was closed: the work continues without lines
            while not ended.wait(lines.seconds_left()):
                lines.write_if_due()

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield lines.update
    finally:
        ended.set()
        thread.join()
