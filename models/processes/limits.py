"""Limits of work: seconds, relative gap, threads."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Final

from ..errors import InputError
from .deadline import Deadline
from .job_counts import check_jobs

LEAST: Final = 0.01  # seconds of a solve for which no time is left: its starting point is still returned


@dataclass(frozen=True)
class Limits:
    """Limits of a solve, a search, a proof or a run.

    Parameters
    ----------
    time_limit
        Seconds, files included. `math.inf` sets no limit; only `search` and `prove` accept it.
    gap
        Relative gap, (energy - bound) / energy, at which the work may stop. A search has no bound and
        ignores it.
    threads
        Threads inside one solver or proof. With 0 the solver chooses; `search` and `prove` then take as many
        as they have jobs.

    Raises
    ------
    InputError
        For values out of range.

    """

    time_limit: float = 60.0
    gap: float = 1e-6
    threads: int = 0
    _end: Deadline | None = field(default=None, repr=False, compare=False, kw_only=True)

    def __post_init__(self) -> None:
        """Check kinds and ranges."""
        if not (self.time_limit > 0 and 0 <= self.gap < math.inf):
            raise InputError(
                f"a time limit of {self.time_limit} s and a gap of {self.gap} are out of range; "
                "give a positive number of seconds, and a gap that is not negative"
            )
        check_jobs(self.threads, "threads", least=0)

    @classmethod
    def finite_or_default(cls, limits: Limits | None) -> Limits:
        """The limits of work that needs a time limit; the defaults for None. Raises InputError for none."""
        limits = limits or cls()
        if limits.time_limit == math.inf:
            raise InputError("this work needs a finite time limit; give a number of seconds")
        return limits

    def deadline(self) -> Deadline:
        """Return the moment at which the time limit ends, counted from now unless `until` fixed it."""
        return self._end or Deadline.after(self.time_limit)

    def until(self, deadline: Deadline) -> Limits:
        """Return the same limits with the seconds that are left until a deadline."""
        return replace(self, time_limit=max(deadline.left(), LEAST), _end=deadline)
