"""What is being done, in a line every few seconds: for those who wait without a terminal."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Final

from ...models.processes.deadline import Clock
from ...models.processes.progress import Progress

EVERY: Final = 5.0
"""Seconds between two lines, and before the first: what ends sooner says nothing."""


class Teller:
    """Says what is being done, at most every few seconds, with the seconds since it was made.

    say: is given each line.
    """

    def __init__(self, say: Callable[[str], object], clock: Clock = time.monotonic) -> None:
        self.text = "starting"
        self._say, self._clock = say, clock
        self._begin = self._last = clock()

    def now(self, text: str) -> None:
        """Take note of what is done from now on; nothing is said yet."""
        self.text = text

    def left(self) -> float:
        """Seconds until the next line is due; 0.0 when it is."""
        return max(0.0, self._last + EVERY - self._clock())

    def look(self) -> None:
        """Say what is being done, if a line is due."""
        if self.left() == 0.0:
            self._last = self._clock()
            self._say(f"[{self._last - self._begin:.0f} s] {self.text}")


@contextmanager
def telling(say: Callable[[str], object]) -> Iterator[Progress]:
    """A function that is told what is being done; meanwhile a line of it is said every few seconds."""
    teller, over = Teller(say), threading.Event()

    def watch() -> None:
        with suppress(OSError, ValueError):  # nobody reads them any more
            while not over.wait(teller.left()):
                teller.look()

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield teller.now
    finally:
        over.set()
        thread.join()
