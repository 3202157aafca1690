"""When work has to end: a number of seconds from now, or never.

Work that may be cut off asks `over()` at every good place and then gives what it has. Between processes the seconds that are left are handed
over, not the time of a clock: a monotonic clock need not be the same in two processes.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Over = Callable[[], bool]
"""Says whether work has to end now."""


def never() -> bool:
    """False: the work goes on to its own end, and what it gives depends on its input alone."""
    return False


@dataclass(frozen=True)
class Deadline:
    """A time of this process's monotonic clock, in seconds; infinite: never."""

    end: float = np.inf

    @classmethod
    def after(cls, seconds: float) -> Deadline:
        """The deadline that many seconds from now."""
        return cls(time.monotonic() + seconds)

    @property
    def left(self) -> float:
        """Seconds until then, 0 once it has passed."""
        return max(0.0, self.end - time.monotonic())

    def passed(self) -> bool:
        """Whether it has passed."""
        return time.monotonic() >= self.end
