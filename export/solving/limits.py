"""Limits of a solve."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ...models.errors import InputError
from ...models.processes.deadline import Deadline
from ...models.processes.side_by_side import checked

LEAST: Final = 0.01
"""Seconds of a solve without time left: it still returns its starting point."""


@dataclass(frozen=True)
class Limits:
    """Seconds of a solve, files included; relative gap at which a discrete search may stop; threads.

    With 0 threads the solver chooses. Raises InputError for values out of range.
    """

    seconds: float = 60.0
    gap: float = 1e-6
    threads: int = 0

    def __post_init__(self) -> None:
        """Check the ranges."""
        if not (0 < self.seconds < np.inf and 0 <= self.gap < np.inf):
            raise InputError(
                f"a time limit of {self.seconds} s and a gap of {self.gap} are out of range; "
                "give a positive number of seconds, and a gap that is not negative"
            )
        checked(self.threads, "threads", least=0)

    def until(self, deadline: Deadline) -> Limits:
        """The same limits with the seconds that are left until a deadline."""
        return replace(self, seconds=max(deadline.left(), LEAST))
