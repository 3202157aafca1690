"""Deadlines, requests to stop and reports of progress of work, which all its parts receive.

Work that may be cut off checks the deadline at every good place, and then returns its present result.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

from ..errors import InputError

Clock = Callable[[], float]

IsOver = Callable[[], bool]  # returns whether work has to end now

Progress = Callable[[str], None]  # receives one line that describes the current step


class Event(Protocol):
    """Interface of `threading.Event` and `multiprocessing.Event`."""

    def is_set(self) -> bool:
        """Whether the event has happened."""


Stop = Callable[[], bool] | Event
"""A request to end work early: a function that returns whether to stop, or an event."""


def stop_function(stop: Stop | None) -> IsOver:
    """A request to stop as a function; for None it never stops. Raises InputError for other values."""
    if stop is None:
        return never
    if callable(stop):
        return stop
    if callable(getattr(stop, "is_set", None)):
        return stop.is_set
    raise InputError(f"stop is {type(stop).__name__}; give a function without arguments, or an event")


def never() -> bool:
    """Return False: the work runs to its own end, and its result depends only on its input."""
    return False


def silent(_line: str) -> None:
    """Ignore a report of progress."""


@dataclass(frozen=True)
class Deadline:
    """A moment of the clock of this process; `inf` for none.

    Other processes may have another clock. A pickled deadline therefore holds the seconds that are left when
    it is sent, and counts them from its arrival.
    """

    at: float = math.inf
    clock: Clock = time.monotonic

    @classmethod
    def after(cls, seconds: float, clock: Clock = time.monotonic) -> Deadline:
        """The moment that many seconds from now."""
        return cls(clock() + seconds, clock)

    def __reduce__(self) -> tuple[Callable[[float], Deadline], tuple[float]]:
        return Deadline.after, (self.left(),)

    def left(self) -> float:
        """Seconds until the moment; 0.0 once it has passed."""
        return max(0.0, self.at - self.clock())

    def passed(self) -> bool:
        """Whether the moment has passed."""
        return self.left() == 0.0

    def later(self, seconds: float) -> Deadline:
        """The moment that many seconds after this one; before it for a negative number."""
        return replace(self, at=self.at + seconds)

    def share(self, part: float) -> Deadline:
        """The moment after that share of the time left."""
        return replace(self, at=self.clock() + part * self.left())

    def within(self, seconds: float) -> Deadline:
        """The earlier of this moment and the moment that many seconds from now."""
        return replace(self, at=min(self.at, self.clock() + seconds))
