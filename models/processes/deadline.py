"""When work has to end: made once from a limit and passed down, so that every part asks for what is left.

Work that may be cut off asks whether it is over at every good place, and then gives what it has.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

from ..errors import InputError

Clock = Callable[[], float]

Over = Callable[[], bool]
"""Says whether work has to end now: it is asked at every good place, and the work then gives what it has."""


class Event(Protocol):
    """What `threading.Event` and `multiprocessing.Event` offer."""

    def is_set(self) -> bool:
        """Return whether the event has happened."""


Stop = Callable[[], bool] | Event
"""A request to end work early: a function that returns whether to stop, or an event."""


def asked(stop: Stop | None) -> Over:
    """Return the function that says whether a caller asks to stop; for None it never does.

    Raises
    ------
    InputError
        When `stop` is neither a function nor an event.

    """
    if stop is None:
        return never
    if callable(stop):
        return stop
    if callable(getattr(stop, "is_set", None)):
        return stop.is_set
    raise InputError(f"stop is {type(stop).__name__}; give a function without arguments, or an event")


def never() -> bool:
    """False: the work goes on to its own end, and what it gives depends on its input alone."""
    return False


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
        """The moment so many seconds from now."""
        return cls(clock() + seconds, clock)

    @classmethod
    def of(cls, limit: float | Deadline | None) -> Deadline:
        """Deadline of a limit: itself, the moment so many seconds from now, or none for None."""
        if isinstance(limit, Deadline):
            return limit
        return cls() if limit is None else cls.after(limit)

    def __reduce__(self) -> tuple[Callable[[float], Deadline], tuple[float]]:
        return Deadline.after, (self.left(),)

    def left(self) -> float:
        """Seconds until then; 0.0 once it has passed."""
        return max(0.0, self.at - self.clock())

    def passed(self) -> bool:
        """Whether nothing is left."""
        return self.left() == 0.0

    def steps(self) -> Over:
        """Return a function to call before each of some equal steps of work.

        It says whether the deadline would pass during the next step, if that took as long as the last one.
        """
        began = [self.clock()]

        def over() -> bool:
            now = self.clock()
            last, began[0] = now - began[0], now
            return self.at - now <= last

        return over

    def later(self, seconds: float) -> Deadline:
        """The moment so many seconds after this one; before it where they are negative."""
        return replace(self, at=self.at + seconds)

    def share(self, part: float) -> Deadline:
        """The moment at which that part of what is left will have gone by."""
        return replace(self, at=self.clock() + part * self.left())

    def within(self, seconds: float) -> Deadline:
        """The sooner one of this moment and that so many seconds from now."""
        return replace(self, at=min(self.at, self.clock() + seconds))
